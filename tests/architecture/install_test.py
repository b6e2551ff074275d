# SPDX-License-Identifier: Apache-2.0
"""sqmap serves an outside project: installed, with and without HDF5, also after the installation has been moved; and
as a folder of that project.

Usage: install_test.py BUILD_DIR SOURCE_DIR CXX_COMPILER [BUNDLE]    (no bundle: sqmap was built without io)
"""
import os
import re
import subprocess
import sys
import tempfile

import link_probe_test


HERE = os.path.dirname(os.path.abspath(__file__))
PROBE = os.path.join(HERE, "link_probe.cpp")
SAMPLE = os.path.join(HERE, "..", "..", "samples", "query_bundle.cpp")
C_PROGRAM = os.path.join(HERE, "..", "runtime", "c_api_test.c")


def run(*command, expected=0, **options):
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if result.returncode != expected:
        sys.exit(f"{' '.join(command)}\nended with {result.returncode}\n{result.stdout}{result.stderr}")
    return " ".join((result.stdout + result.stderr).split())  # CMake wraps its messages


def configure(prefix, work, source, compiler, components, *defines, expected=0):
    return run("cmake", "-S", os.path.join(HERE, "consumer"), "-B", work, f"-DCMAKE_PREFIX_PATH={prefix}",
               f"-DCMAKE_CXX_COMPILER={compiler}", "-DCMAKE_BUILD_TYPE=Release", f"-DSOURCE={source}",
               f"-DCOMPONENTS={components}", "-DLANGUAGES=CXX", *defines, expected=expected)


def build_consumer(*arguments):
    configure(*arguments)
    run("cmake", "--build", arguments[1])
    return os.path.join(arguments[1], "consumer")


def check_prefix(prefix, work, compiler, bundle):
    """Both components, built against the installation at prefix."""
    link_probe_test.main(build_consumer(prefix, os.path.join(work, "runtime"), PROBE, compiler, "runtime",
                                        "-DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON"))
    c_program = build_consumer(prefix, os.path.join(work, "c"), C_PROGRAM, compiler, "runtime",
                               "-DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON", "-DLANGUAGES=C;CXX")
    link_probe_test.check_libraries(c_program)
    run(c_program)
    if bundle:
        sample = build_consumer(prefix, os.path.join(work, "io"), SAMPLE, compiler, "runtime;io", "-DLANGUAGES=C;CXX")
        answer = run(sample, bundle, input="0.3 0 0\n")
        assert "distance -0.100" in answer, f"{answer!r}: the point lies 0.1 m inside the ball"
        run(build_consumer(prefix, os.path.join(work, "c_io"), C_PROGRAM, compiler, "runtime;io", "-DLANGUAGES=C;CXX",
                           "-DCMAKE_C_FLAGS=-DSQMAP_TEST_LOAD"), bundle)
    else:
        text = configure(prefix, os.path.join(work, "io"), PROBE, compiler, "runtime;io", expected=1)
        assert "without its component io" in text, text


def names_folder(prefix, folders):
    """Package files that name a folder of this machine: such an installation cannot be moved."""
    for folder, _, names in os.walk(os.path.join(prefix, "lib")):
        for name in names:
            if name.endswith(".cmake"):
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    text = file.read()
                # Where a path begins: a folder of the package may end in the same words.
                found = (re.search(r"(?<![\w}/.-])" + re.escape(path), text) for path in folders)
                yield from (f"{name} names {match[0]}" for match in found if match)


def check_documents(prefix):
    """Each program's man page and completion scripts lie where man and the shells look, as the program writes them."""
    for program in ("sqbake", "sqinfo", "sqbench"):
        for kind, name in (("man", f"man/man1/{program}.1"), ("bash", f"bash-completion/completions/{program}"),
                           ("zsh", f"zsh/site-functions/_{program}"), ("fish", f"fish/vendor_completions.d/{program}.fish")):
            with open(os.path.join(prefix, "share", name), encoding="utf-8") as file:
                written = subprocess.run([os.path.join(prefix, "bin", program), "--generate", kind], capture_output=True,
                                         text=True, check=True).stdout
                assert file.read() == written and program in written, name
    bash = 'source "$0"; complete -p sqbake'
    assert "-F _sqbake" in run("bash", "-c", bash, os.path.join(prefix, "share/bash-completion/completions/sqbake"))


def main(build_dir, source_dir, compiler, bundle=None):
    with tempfile.TemporaryDirectory() as work:
        first, second = os.path.join(work, "first"), os.path.join(work, "moved", "away")
        run("cmake", "--install", build_dir, "--prefix", first)
        absolute = list(names_folder(first, (first, build_dir, source_dir, "/usr/lib/")))
        assert not absolute, absolute
        if bundle:
            for program in ("sqbake", "sqinfo"):
                run(os.path.join(first, "bin", program), "--version")
            check_documents(first)
        check_prefix(first, os.path.join(work, "a"), compiler, bundle)
        if bundle:
            text = configure(first, os.path.join(work, "no_c"), SAMPLE, compiler, "runtime;io", expected=1)
            assert "add C to project" in text, text
        os.makedirs(os.path.dirname(second))
        os.rename(first, second)
        check_prefix(second, os.path.join(work, "b"), compiler, bundle)
        link_probe_test.main(build_consumer("", os.path.join(work, "c"), PROBE, compiler, "runtime",
                                            f"-DSQMAP_SOURCE_DIR={source_dir}"))


if __name__ == "__main__":
    main(*sys.argv[1:])
