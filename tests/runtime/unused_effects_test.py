# SPDX-License-Identifier: Apache-2.0
"""unused_effects_test.py ALL ONE: effects that a scene does not name cost its frames nothing.

ALL and ONE are scene_frames_probe with every effect there is, and with a table that holds the reaction alone. Valgrind
counts the instructions of 20 and of 60 frames; the difference is that of 40 frames, without the start of the program.
Exit code 77 where there is no valgrind.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

FRAMES = (20, 60)


def instructions(program, frames, effects):
    with tempfile.TemporaryDirectory() as folder:
        out = subprocess.run(
            ["valgrind", "--tool=callgrind", "--callgrind-out-file=" + os.path.join(folder, "out"), program,
             str(frames), *effects], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=250)
    found = re.search(r"Collected : (\d+)", out.stdout)
    if out.returncode != 0 or not found:
        sys.exit("%s %d: exit code %d\n%s" % (program, frames, out.returncode, out.stdout))
    return int(found.group(1))


def of_frames(program, *effects):
    few, many = (instructions(program, frames, effects) for frames in FRAMES)
    return (many - few) / (FRAMES[1] - FRAMES[0])


def main():
    if shutil.which("valgrind") is None:
        print("skipped: no valgrind")
        return 77
    every, one = sys.argv[1:3]
    counts = {"reaction, nothing else built in": of_frames(one), "reaction": of_frames(every),
              "reaction and friction": of_frames(every, "friction")}
    for name, count in counts.items():
        print("%-32s %10.1f instructions a frame" % (name, count))
    alone, named, more = counts.values()
    if named != alone:
        print("a frame that names the reaction alone runs %+.1f instructions for effects it does not name" %
              (named - alone))
        return 1
    if not more > named + 100:
        print("friction was not counted: the test sees nothing")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
