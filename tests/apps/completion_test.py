# SPDX-License-Identifier: Apache-2.0
"""Man pages and completion scripts, made by the programs, say what --help says."""
import re
import shutil
import subprocess
import unittest

from support import FolderTest, run

PROGRAMS = {"sqbake": ["bake", "check", "cache stats", "cache verify", "cache gc", "config show", "report", "plan", "merge"],
            "sqinfo": ["show", "validate", "query", "export", "diff"]}


def long_options(program, names):
    text = run(program, *names.split(), "--help").stdout.split("Options:")[1]
    return set(re.findall(r"^ +(?:-\w,)?(--[a-z][a-z0-9-]*)", text, re.MULTILINE))


class Documents(FolderTest):
    def document(self, program, kind):
        result = run(program, "--generate", kind)
        self.assert_exit(result, 0)
        path = self.folder / f"{program}.{kind}"
        path.write_text(result.stdout, encoding="utf-8")
        return path

    def complete(self, program, line):
        """What bash offers at the end of a line."""
        script = ('source "$1"; COMP_WORDS=($2); [[ $2 == *" " ]] && COMP_WORDS+=(""); '
                  'COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _' + program + ' 2>/dev/null; printf "%s\\n" "${COMPREPLY[@]}"')
        result = subprocess.run(["bash", "-c", script, "bash", str(self.document(program, "bash")), line],
                                capture_output=True, text=True, check=False, cwd=self.folder)
        self.assertEqual(result.stderr, "")
        return set(result.stdout.split())

    def test_bash_offers_the_commands_then_their_options(self):
        for program, commands in PROGRAMS.items():
            self.assertLessEqual({name.split()[0] for name in commands}, self.complete(program, program + " "))
            for names in commands:
                with self.subTest(program=program, command=names):
                    options = long_options(program, names)
                    self.assertIn("--help", options)
                    self.assertLessEqual(options, self.complete(program, f"{program} {names} --"))
        self.assertEqual(self.complete("sqbake", "sqbake cache "), {"stats", "verify", "gc", "-h", "--help", "--cache",
                                                                    "--format", "--color"})
        self.assertEqual(self.complete("sqbake", "sqbake bake --max-e"), {"--max-error"})
        self.assertNotIn("--max-error", self.complete("sqbake", "sqbake check --"))

    def test_bash_offers_files_where_a_file_is_due(self):
        (self.folder / "hand.off").touch()
        for line in ("sqbake bake h", "sqbake bake x.off --depfile h", "sqinfo show h"):
            self.assertEqual(self.complete(line.split()[0], line), {"hand.off"}, line)
        self.assertEqual(self.complete("sqbake", "sqbake bake x.off --max-parts h"), set())

    def test_words_are_offered_where_one_of_a_few_is_due(self):
        (self.folder / "fine.off").touch()
        words = {"sqbake bake x.off --quality ": {"draft", "standard", "fine"},
                 "sqbake bake x.off --quality f": {"fine"}, "sqbake bake x.off --taper ": {"on", "off"},
                 "sqbake bake x.off --bend ": {"on", "off"},
                 "sqbake cache stats --format ": {"text", "json"}, "sqinfo query x.h5 --layer ": {"auto", "1", "2", "3"},
                 "sqinfo show --color a": {"auto", "always"}}
        for line, expected in words.items():
            self.assertEqual(self.complete(line.split()[0], line), expected, line)
            option = line.split()[-1 if line.endswith(" ") else -2]
            for kind in ("fish", "zsh"):
                lines = [each for each in self.document(line.split()[0], kind).read_text(encoding="utf-8").splitlines()
                         if re.search(rf"{option.strip('-')}\b", each)]
                self.assertTrue(any(expected <= set(re.findall(r"\w+", each)) for each in lines), f"{line} {kind}")

    def test_man_pages_have_every_option_and_every_exit_code(self):
        for program, commands in PROGRAMS.items():
            page = self.document(program, "man").read_text(encoding="utf-8").replace("\\-", "-")
            for names in commands:
                section = page.split(f'.SH "{program} {names}"')[1].split("\n.SH")[0]
                for option in long_options(program, names):
                    self.assertRegex(section, rf"(?m)^\\fB(-\w, )?{option}\\fR", f"{program} {names}")
            self.assertRegex(page, r'(?sm)\.SH "EXIT STATUS".*^ +130 ')

    def test_other_tools_accept_the_documents(self):
        checks = {"bash": ["bash", "-n"], "zsh": ["zsh", "-n"], "fish": ["fish", "--no-execute"],
                  "man": ["mandoc", "-T", "lint", "-W", "error"]}
        for kind, command in checks.items():
            for program in PROGRAMS if shutil.which(command[0]) else ():
                result = subprocess.run([*command, str(self.document(program, kind))], capture_output=True, text=True,
                                        check=False)
                self.assertEqual((result.returncode, result.stdout + result.stderr), (0, ""), f"{program} {kind}")

    def test_fish_and_zsh_scripts_name_every_option(self):
        for program, commands in PROGRAMS.items():
            fish = self.document(program, "fish").read_text(encoding="utf-8")
            zsh = self.document(program, "zsh").read_text(encoding="utf-8")
            for names in commands:
                function = zsh.split(f"_{program}_{names.replace(' ', '_')}() {{")[1].split("\n}\n")[0]
                seen = "; and ".join(f"__fish_seen_subcommand_from {name}" for name in names.split())
                lines = [line for line in fish.splitlines() if f"-n '{seen}'" in line]
                for option in long_options(program, names):
                    self.assertIn(f"'{option}[", function)
                    self.assertTrue(any(f" -l {option[2:]} " in line for line in lines), f"{names} {option}")

    def test_another_kind_is_refused(self):
        result = run("sqbake", "--generate", "powershell")
        self.assert_exit(result, 2)
        self.assertIn("bash", result.stderr)


if __name__ == "__main__":
    unittest.main()
