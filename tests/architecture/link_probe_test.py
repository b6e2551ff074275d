# SPDX-License-Identifier: Apache-2.0
"""A program that links sqmap::runtime alone runs, and loads nothing but the C++ run-time; so do others, of which only
this is checked. Usage: link_probe_test.py PROBE [OTHER...]"""
import re
import subprocess
import sys

# An allow-list: a new dependency of the runtime must be a decision. The lib*san are those of sanitizer builds.
ALLOWED = re.compile(r"(libstdc\+\+|libm|libc|libgcc_s|ld-linux[\w-]*|lib(a|ub|t)san|libpthread|libdl)\.so(\.\d+)?$")

# The answers for the ball of radius 0.4 m: inside, distance [m], force [N] at 100 N/m; then the batch's distances; then
# whether a point touches the ball where it was moved to, and when a flying one does.
EXPECTED = ["1 -0.100 10.00 0.00 0.00", "0 0.050 0.00 0.00 0.00", "0 nan 0.00 0.00 0.00", "-0.100 0.050 nan", "0 0.8"]


def needed_libraries(program):
    text = subprocess.run(["readelf", "-d", program], check=True, capture_output=True, text=True).stdout
    return re.findall(r"\(NEEDED\).*\[(.+)\]", text)


def check_libraries(program):
    foreign = [name for name in needed_libraries(program) if not ALLOWED.match(name)]
    assert not foreign, f"{program} needs {foreign}, must need only the C++ run-time"


def main(program, *others):
    for each in (program, *others):
        check_libraries(each)
    lines = subprocess.run([program], check=True, capture_output=True, text=True).stdout.replace("-0.00", "0.00")
    assert lines.split("\n")[:-1] == EXPECTED, f"{lines!r}, must be {EXPECTED}"


if __name__ == "__main__":
    main(*sys.argv[1:])
