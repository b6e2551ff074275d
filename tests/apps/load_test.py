# SPDX-License-Identifier: Apache-2.0
"""scripts/load_test bakes as many meshes as it is told to, and finds a process or a file that a run leaves behind."""
import importlib.machinery
import importlib.util
import os
import re
import subprocess
import time
import unittest
from pathlib import Path

from support import BIN, TIMEOUT_S, FolderTest, box, write_off

LOAD_TEST = Path(os.environ["SQMAP_SOURCE_DIR"]) / "scripts" / "load_test"
ROW = re.compile(r"(?m)^-j(\d) .* / \d+ .* / \d+ +(\d+) +(\d+) +(\d+)$")


class LoadTest(FolderTest):
    def load(self, binaries, *options):
        """Exit code; processes left, files left and failures of each run; all that was printed."""
        mesh = write_off(self.folder / "box.off", box())
        result = subprocess.run([LOAD_TEST, "2", "--meshes", mesh, "--bin", binaries, *options], capture_output=True,
                                text=True, timeout=TIMEOUT_S, check=False)
        rows = [tuple(map(int, row)) for row in ROW.findall(result.stdout)]
        return result.returncode, rows, result.stdout + result.stderr

    def test_a_sound_baker_bakes_all_and_leaves_nothing(self):
        kept = self.folder / "kept"
        code, rows, text = self.load(BIN, "--keep", kept)
        self.assertEqual((code, rows), (0, [(1, 0, 0, 0), (2, 0, 0, 0)]), text)
        self.assertIn("bundles that differ: 0", text)
        for run in ("j1", "j2"):
            self.assertEqual(sorted(p.name for p in (kept / run).iterdir()), ["00000_box.h5", "00001_box.h5"])

    def test_the_run_with_one_thread_may_bake_the_first_only(self):
        kept = self.folder / "kept"
        code, rows, text = self.load(BIN, "--keep", kept, "--alone", "1")
        self.assertEqual((code, rows), (0, [(1, 0, 0, 0), (2, 0, 0, 0)]), text)
        for run, count in (("j1", 1), ("j2", 2)):
            self.assertEqual(len(list((kept / run).iterdir())), count)

    def test_a_file_that_stays_open_is_told_from_one_that_is_open_for_a_moment(self):
        loader = importlib.machinery.SourceFileLoader("load_script", str(LOAD_TEST))
        script = importlib.util.module_from_spec(importlib.util.spec_from_loader("load_script", loader))
        loader.exec_module(script)
        starting, ending, moment = [(0, 100, 3)] * 9, [(99, 100, 5)] * 9, (100, 11)
        steady = [(done, 100, 9) for done in range(1, 99) for _ in range(5)]
        with_moments = [look if i % 5 else (look[0], *moment) for i, look in enumerate(steady)]
        first, last = script.first_and_last(starting + with_moments + ending, 2, 100)
        self.assertEqual((first, last), ((100, 9), (100, 9)))
        leaking = [(done, memory, files + (done > 60)) for done, memory, files in with_moments]
        first, last = script.first_and_last(starting + leaking + ending, 2, 100)
        self.assertEqual((first, last), ((100, 9), (100, 10)))

    def test_a_stop_ends_the_baker_and_removes_what_was_written(self):
        (self.folder / "tmp").mkdir()
        (self.folder / "sqbake").write_text(f'#!/bin/sh\ntouch {self.folder}/begun\nexec sleep 100\n', encoding="utf-8")
        (self.folder / "sqbake").chmod(0o755)
        mesh = write_off(self.folder / "box.off", box())
        with subprocess.Popen([LOAD_TEST, "2", "--meshes", mesh, "--bin", self.folder], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, env={**os.environ, "TMPDIR": str(self.folder / "tmp")}) as test:
            while not (self.folder / "begun").exists():
                time.sleep(0.05)
            test.terminate()
            self.assertEqual(test.wait(TIMEOUT_S), 143)
        self.assertEqual(list((self.folder / "tmp").iterdir()), [])

    def test_what_is_left_over_or_not_baked_is_counted(self):
        for trick, row in (("sleep 100 >/dev/null 2>&1 &", (1, 0, 0)),
                           ('mkdir -p "$4"; touch "$4/stray"; echo > "$2/00000_box.ply"', (0, 1, 1))):
            with self.subTest(trick=trick):
                (self.folder / "sqbake").write_text(f'#!/bin/sh\n{trick}\nexec "{BIN}/sqbake" "$@"\n', encoding="utf-8")
                (self.folder / "sqbake").chmod(0o755)
                code, rows, text = self.load(self.folder)
                self.assertEqual((code, rows), (1, [(1, *row), (2, *row)]), text)


if __name__ == "__main__":
    unittest.main()
