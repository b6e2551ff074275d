# SPDX-License-Identifier: Apache-2.0
"""Help, versions and command lines that say nothing a program could do."""
import re
import unittest

from support import run

COMMANDS = {"sqbake": ["bake", "check", "config", "cache", "report", "plan", "merge"],
            "sqinfo": ["show", "validate", "query", "export", "diff"], "sqbench": ["run", "draw"]}


class Help(unittest.TestCase):
    def test_every_command_has_examples_before_its_options(self):
        for program, names in COMMANDS.items():
            for arguments in [[], *([name] for name in names)]:
                with self.subTest(program=program, arguments=arguments):
                    result = run(program, *arguments, "--help")
                    self.assertEqual(result.returncode, 0, result.stderr)
                    self.assertEqual(result.stderr, "")
                    self.assertLess(result.stdout.index("Examples:"), result.stdout.index("Options:"))
                    self.assertIn(f"  {program} {' '.join(arguments)}", result.stdout)

    def test_options_are_shown_as_they_are_typed(self):
        text = run("sqbake", "bake", "--help").stdout
        self.assertRegex(text, r"(?m)^  --no-cache +Bake all")
        self.assertNotRegex(text, r"[{}]")

    def test_prints_the_table_of_exit_codes(self):
        table = re.findall(r"^ +(\d+)  \S", run("sqbake", "--help").stdout.split("Exit codes:")[1], re.MULTILINE)
        self.assertEqual([int(code) for code in table], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 130, 141, 143])

    def test_top_help_names_every_command(self):
        for program, names in COMMANDS.items():
            text = run(program, "--help").stdout
            for name in names:
                self.assertRegex(text, rf"(?m)^  {name}\s+\S")
            listed = text.split("Subcommands:\n")[1].split("\n\n")[0].rstrip().splitlines()
            self.assertEqual(len(listed), len(names), "one line a command")

    def test_version_names_program_and_bundle_format(self):
        for program in COMMANDS:
            result = run(program, "--version")
            self.assertEqual(result.returncode, 0)
            self.assertRegex(result.stdout, rf"^{program} \d+\.\d+\.\d+ \(bundle format \d+\.\d+\)\n$")


class Usage(unittest.TestCase):
    CASES = [
        (("sqbake",), "subcommand"),
        (("sqbake", "bkae", "x.off"), "`bkae`"),
        (("sqbake", "bake"), "INPUT"),
        (("sqbake", "bake", "x.off", "--quality", "9"), "draft, standard, fine"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--colourful"), "--colourful"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--unit", "parsec"), "`parsec`"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--max-error", "-1%"), "`-1%`"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--max-error", "1 acre"), "`1 acre`"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--max-bytes", "12X"), "`12X`"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--max-parts", "0"), "--max-parts = 0"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--repair", "some"), "--repair"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--timeout", "soon"), "`soon`"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "--memory", "4M"), "16M"),
        (("sqbake", "bake", "x.off", "-o", "x.h5", "-q", "-v"), "--quiet"),
        (("sqbake", "check"), "INPUT"),
        (("sqbake", "config"), "subcommand"),
        (("sqbake", "config", "show"), "MESH"),
        (("sqbake", "config", "show", "x.off", "--quality", "best"), "`best`"),
        (("sqbake", "cache"), "subcommand"),
        (("sqbake", "cache", "gc", "--max-size", "lots"), "`lots`"),
        (("sqbake", "report", "-"), "--output"),
        (("sqbake", "plan"), "--out-dir"),
        (("sqbake", "bake", "x.off", "-o", "a.h5", "-o", "b.h5"), "--output: given 2 times, may be given once"),
        (("sqbake", "bake", "x.off", "--unit", "m", "--unit", "m", "--unit", "m"), "given 3 times"),
        (("sqbake", "merge"), "RECORDS"),
        (("sqinfo", "show"), "BUNDLE"),
        (("sqinfo", "query", "x.h5"), "--points"),
        (("sqinfo", "query", "x.h5", "--points", "-", "--layer", "4"), "--layer"),
        (("sqinfo", "validate", "x.h5", "--level", "deep"), "--level"),
        (("sqinfo", "export", "x.h5"), "--glb"),
        (("sqinfo", "diff", "x.h5"), "SECOND"),
        (("sqinfo", "diff", "x.h5", "y.h5", "--tolerance", "-1"), "--tolerance"),
    ]

    def test_a_wrong_command_line_exits_2_and_names_what_is_wrong(self):
        for arguments, named in self.CASES:
            with self.subTest(arguments=arguments):
                result = run(*arguments)
                self.assertEqual(result.returncode, 2, result.stderr)
                self.assertEqual(result.stdout, "")
                self.assertTrue(result.stderr.startswith(f"{arguments[0]}: error: "), result.stderr)
                self.assertIn(named, result.stderr)
                self.assertEqual(result.stderr.count("\n"), 1, result.stderr)


if __name__ == "__main__":
    unittest.main()
