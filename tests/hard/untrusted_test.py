# SPDX-License-Identifier: Apache-2.0
"""sqinfo --untrusted: the work is done in a child with limits, and whatever ends the child is one error."""
import os
import signal
import subprocess
import time
import unittest
from pathlib import Path

# Of tests/apps, by PYTHONPATH.
from support import FolderTest, command, run

GOLDEN = Path(os.environ["SQMAP_SOURCE_DIR"]) / "tests" / "formats" / "golden" / "v1_0.h5"


def child_of(process):
    """The child process, once it has its limits."""
    for _ in range(1000):
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii").split()
        if children and "Seccomp:\t2" in Path(f"/proc/{children[0]}/status").read_text(encoding="ascii"):
            return int(children[0])
        time.sleep(0.01)
    raise AssertionError("no confined child")


class Untrusted(FolderTest):
    def waiting(self):
        """A query that waits for its points."""
        process = subprocess.Popen(command("sqinfo", "query", GOLDEN, "--points", "-", "--untrusted"),
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for pipe in (process.stdin, process.stdout, process.stderr):
            self.addCleanup(pipe.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process, child_of(process)

    def test_says_what_it_says_without(self):
        for arguments in (("show", GOLDEN), ("validate", GOLDEN), ("diff", GOLDEN, GOLDEN)):
            with self.subTest(command=arguments[0]):
                plain, guarded = run("sqinfo", *arguments), run("sqinfo", *arguments, "--untrusted")
                self.assertEqual((guarded.returncode, guarded.stdout, guarded.stderr), (0, plain.stdout, plain.stderr))

    def test_refuses_as_without(self):
        broken = self.folder / "broken.h5"
        broken.write_bytes(GOLDEN.read_bytes()[:-1])
        self.assert_exit(run("sqinfo", "validate", broken, "--untrusted"), 4)
        self.assert_exit(run("sqinfo", "show", self.folder / "none.h5", "--untrusted"), 3)

    def test_the_child_has_bounded_memory_and_time(self):
        process, child = self.waiting()
        limits = Path(f"/proc/{child}/limits").read_text(encoding="ascii")
        self.assertRegex(limits, r"Max cpu time +60 +60 ")
        self.assertRegex(limits, r"Max core file size +0 +0 ")
        if not os.environ.get("SQMAP_SANITIZED"):  # sanitizers reserve terabytes
            self.assertRegex(limits, r"Max address space +3221225472 +3221225472 ")
        output, _ = process.communicate("0,0,0\n")
        self.assertEqual(process.returncode, 0)
        self.assertEqual(len(output.splitlines()), 2)

    def test_a_crash_of_the_child_is_an_error_that_names_the_file(self):
        # A sanitizer would answer SIGSEGV itself.
        crash = signal.SIGABRT if os.environ.get("SQMAP_SANITIZED") else signal.SIGSEGV
        for number, text in ((crash, "crashed"), (signal.SIGXCPU, "processor time"), (signal.SIGSYS, "system")):
            with self.subTest(signal=number):
                process, child = self.waiting()
                os.kill(child, number)
                _, errors = process.communicate()
                self.assertEqual(process.returncode, 4, errors)
                self.assertIn(str(GOLDEN), errors)
                self.assertIn(text, errors)
                self.assertIn("do not open it", errors)

    def test_the_child_ends_with_its_parent(self):
        process, child = self.waiting()
        process.kill()
        process.wait()
        for _ in range(1000):
            state = Path(f"/proc/{child}/stat")
            if not state.exists() or state.read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] == "Z":
                return
            time.sleep(0.01)
        self.fail("the child still runs")


if __name__ == "__main__":
    unittest.main()
