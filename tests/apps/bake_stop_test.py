# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, SIGTERM and a closed pipe end a bake with their own exit codes and leave no partial file."""
import fcntl
import json
import signal
import subprocess
import unittest

from support import ROUGH, TIMEOUT_S, FolderTest, command, run, sphere, write_off


class Stop(FolderTest):
    COUNT = 40

    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        self.models.mkdir()
        mesh = sphere(4)
        for k in range(self.COUNT):
            vertices = [(x * (1 + 0.1 * k), y + x * x, z) for x, y, z in mesh[0]]
            write_off(self.models / f"{k:02}.off", (vertices, mesh[1]))
        self.out = self.folder / "out"

    def start(self, *options):
        return subprocess.Popen(
            command("sqbake", "bake", self.models, "--out-dir", self.out, "--progress", "always", "--format", "ndjson",
                    *options),
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def check_leftovers(self):
        """Only whole bundles: every file is a valid one under its final name."""
        left = sorted(self.out.iterdir())
        self.assertLess(len(left), self.COUNT, "the signal came too late to mean anything")
        for path in left:
            self.assertEqual(path.suffix, ".h5")
            self.assertEqual(run("sqinfo", "validate", path).returncode, 0, path)

    def test_a_signal_in_the_middle_leaves_only_whole_bundles(self):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(number=number):
                process = self.start()
                for line in process.stderr:  # stages of the second asset: the first is done or under way
                    if "01.off" in line and "read" not in line:
                        break
                process.send_signal(number)
                _, stderr = process.communicate(timeout=TIMEOUT_S)
                self.assertEqual(process.returncode, code, stderr)
                self.check_leftovers()

    def records(self, text):
        """Outcomes, checked to be whole: one a mesh, and a summary that counts them."""
        *assets, summary = map(json.loads, text.splitlines())
        outcomes = [record["outcome"] for record in assets]
        self.assertEqual(len(outcomes), self.COUNT)
        self.assertEqual({name: outcomes.count(name) for name in set(outcomes)},
                         {name: summary[name] for name in set(outcomes)})
        return outcomes

    def test_the_records_of_a_run_that_is_stopped_or_fails_are_whole(self):
        process = self.start("-j2")
        for line in process.stderr:
            if "01.off" in line and "read" not in line:
                break
        process.send_signal(signal.SIGTERM)
        stdout, _ = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 143)
        outcomes = self.records(stdout)
        self.assertEqual(outcomes.count("ok"), len(list(self.out.iterdir())))
        self.assertGreater(outcomes.count("cancelled"), 0)
        self.out.rename(self.folder / "earlier")
        (self.models / "00.off").write_text("OFF\n", encoding="ascii")
        process = self.start("--fail-fast", "-j1")
        stdout, _ = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((process.returncode, self.records(stdout)), (1, ["failed"] + (self.COUNT - 1) * ["cancelled"]))

    def test_what_a_killed_run_left_is_gone_after_the_next(self):
        self.out.mkdir()
        for name in (".sqmap-abc123.tmp", ".sqmap-def456.tmp"):
            (self.out / name).write_bytes(b"half a bundle")
        with open(self.out / ".sqmap-def456.tmp", "rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX)  # as a run does that still writes
            result = run("sqbake", "bake", self.models / "00.off", *ROUGH, "-o", self.out / "00.h5")
        self.assert_exit(result, 0)
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), [".sqmap-def456.tmp", "00.h5"])

    def test_a_reader_that_goes_away_stops_the_run(self):
        process = self.start()
        process.stdout.readline()
        process.stdout.close()
        process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.wait(timeout=TIMEOUT_S), 141)
        self.check_leftovers()


if __name__ == "__main__":
    unittest.main()
