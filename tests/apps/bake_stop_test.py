# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, SIGTERM and a closed pipe end a bake with their own exit codes and leave no partial file."""
import signal
import subprocess
import unittest

from support import TIMEOUT_S, FolderTest, command, run, sphere, write_off


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

    def start(self):
        return subprocess.Popen(
            command("sqbake", "bake", self.models, "--out-dir", self.out, "--progress", "always", "--format", "ndjson"),
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
