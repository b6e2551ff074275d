# SPDX-License-Identifier: Apache-2.0
"""Which meshes are named, where their bundles go and which settings hold: folders, patterns, lists, manifests, project
files and sidecars. All by `--dry-run` and `config show`, but where bytes are the point."""
import json
import re
import unittest

from support import ROUGH, FolderTest, box, run, sphere, write_off


class Inputs(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        for name in ("a.off", "deep/b.off", "deep/er/c.off", "deep/d.obj", "deep/.hidden/e.off"):
            path = self.models / name
            path.parent.mkdir(parents=True, exist_ok=True)
            write_off(path, box())
        (self.models / "deep" / "notes.txt").write_text("not a mesh", encoding="ascii")
        self.out = self.folder / "out"

    def plan(self, *arguments, code=0, **options):
        result = run("sqbake", "bake", *arguments, "--out-dir", self.out, "-n", "--format", "ndjson", **options)
        self.assert_exit(result, code)
        self.assertFalse(self.out.exists())
        return [json.loads(line) for line in result.stdout.splitlines()]

    def pairs(self, *arguments, **options):
        return [(p["input"].removeprefix(f"{self.models}/"), p["output"].removeprefix(f"{self.out}/"))
                for p in self.plan(*arguments, **options)]

    def refuse(self, code, named, *arguments, **options):
        before = self.files()
        result = run("sqbake", "bake", *arguments, "--out-dir", self.out, **options)
        self.assert_exit(result, code)
        for text in [named] if isinstance(named, str) else named:
            self.assertIn(text, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertEqual(self.files(), before)

    def test_a_pattern_mirrors_the_folders_below_its_fixed_start(self):
        self.assertEqual(self.pairs(f"{self.models}/**/*.off"),
                         [("a.off", "a.h5"), ("deep/b.off", "deep/b.h5"), ("deep/er/c.off", "deep/er/c.h5")])
        self.assertEqual(self.pairs(f"{self.models}/deep/*"), [("deep/b.off", "b.h5"), ("deep/d.obj", "d.h5")])
        self.assertEqual(self.pairs(f"{self.models}/**/[!ab].o?[fj]"),
                         [("deep/d.obj", "deep/d.h5"), ("deep/er/c.off", "deep/er/c.h5")])
        self.assertEqual(self.pairs("d*/**/c.off", cwd=self.models), [("deep/er/c.off", "deep/er/c.h5")])

    def test_a_pattern_that_nothing_matches_is_refused(self):
        self.refuse(3, "*.stl", f"{self.models}/**/*.stl")
        self.refuse(3, "nowhere", f"{self.models}/nowhere/*.off")

    def test_a_broken_pattern_is_refused(self):
        self.refuse(3, ["no such file", "without `]`"], f"{self.models}/[ab.off")
        self.refuse(3, "whole name", f"{self.models}/**.off")
        write_off(self.models / "[ab.off", box())
        self.assertEqual(self.pairs(self.models / "[ab.off"), [("[ab.off", "[ab.h5")])
        self.assertEqual(self.pairs(f"{self.models}/[[]*.off"), [("[ab.off", "[ab.h5")])

    def test_a_list_names_one_input_a_line(self):
        (self.folder / "list.txt").write_text("models/deep/b.off\r\n\nmodels/deep/er\nmodels/*.off\n", encoding="ascii")
        expected = [("models/deep/b.off", "models/deep/b.h5"), ("models/deep/er/c.off", "c.h5"),
                    ("models/a.off", "a.h5")]
        self.assertEqual(self.pairs("@list.txt", cwd=self.folder), expected)
        self.assertEqual(self.pairs("@-", cwd=self.folder, input="models/deep/b.off\n"), expected[:1])
        beside = self.models / "beside.txt"
        beside.write_text("deep/b.off\n", encoding="ascii")
        self.assertEqual(self.pairs(f"@@{beside}"), [("deep/b.off", "deep/b.h5")])

    def test_a_list_with_a_missing_file_is_refused_with_its_line(self):
        (self.folder / "list.txt").write_text("models/a.off\nmodels/none.off\n", encoding="ascii")
        self.refuse(3, ["list.txt:2", "none.off"], "@list.txt", cwd=self.folder)

    def test_a_manifest_names_inputs_outputs_and_settings(self):
        manifest = self.models / "props.toml"
        manifest.write_text('[default]\nunit = "mm"\n[[asset]]\ninput = "a.off"\noutput = "left/hand.h5"\n'
                            '[[asset]]\ninput = "deep/b.off"\nunit = 2\nmax-parts = 3\n', encoding="ascii")
        plan = self.plan("--manifest", manifest)
        self.assertEqual([p["output"] for p in plan], [f"{self.out}/left/hand.h5", f"{self.out}/deep/b.h5"])
        self.assertEqual([p["settings"]["unit"]["value"] for p in plan], ["mm", "2"])
        self.assertEqual([p["settings"]["max-parts"]["value"] for p in plan], ["24", "3"])
        manifest.write_text('[[asset]]\ninput = "a.off"\noutput = "../x.h5"\n', encoding="ascii")
        self.refuse(2, ["props.toml:3", "../x.h5"], "--manifest", manifest)
        manifest.write_text('[[asset]]\ninput = "none.off"\n', encoding="ascii")
        self.refuse(3, ["props.toml", "none.off"], "--manifest", manifest)
        for name, code, finding in (("deep", 3, "is a folder"), ("deep/notes.txt", 4, "mesh extension")):
            manifest.write_text(f'[[asset]]\ninput = "a.off"\n[[asset]]\ninput = "{name}"\n', encoding="ascii")
            for dry in ((), ("-n",)):
                self.refuse(code, ["props.toml", name, finding], "--manifest", manifest, *dry)

    def test_two_meshes_for_one_bundle_are_refused_before_work(self):
        write_off(self.models / "deep" / "d.off", box())
        self.refuse(2, ["d.obj", "d.off"], self.models, "--recursive")

    def test_a_mesh_that_is_named_twice_is_told_as_that(self):
        (self.models / "link").symlink_to("deep")
        for arguments, named in ((("a.off", "./a.off"), "also as ./a.off; name it once"),
                                 (("deep/b.off", "deep/b.off"), "deep/b.off is named twice, for one bundle; name it"),
                                 (("deep/b.off", "link/b.off"), "also as link/b.off; name it once")):
            self.refuse(2, named, *arguments, cwd=self.models)

    def test_limits_need_isolation(self):
        for limit in (("--timeout", "5s"), ("--memory", "1G")):
            self.refuse(2, ["--no-isolation", limit[0]], self.models / "a.off", "--no-isolation", *limit)
        for free in ((), ("--timeout", "none")):
            self.plan(self.models / "a.off", "--no-isolation", *free)

    def test_errors_name_the_option_as_it_is_spelt(self):
        for option, value in (("--max-parts", "0"), ("--max-error", "101%"), ("--max-error", "1000000000000000m"),
                              ("--max-bytes", "12")):
            with self.subTest(option=option):
                self.refuse(2, [option, "must be"], self.models / "a.off", option, value)
                self.assertNotIn("_", run("sqbake", "bake", "a.off", "-o", "a.h5", option, value).stderr)

    def test_a_dry_run_refuses_an_output_that_a_run_would(self):
        source = self.models / "a.off"
        for arguments in (("-o", self.folder / "none" / "x.h5"), ("-o", source / "x.h5"), ("--out-dir", source),
                          ("--out-dir", source / "deeper")):
            for dry in ((), ("-n",)):
                with self.subTest(arguments=arguments, dry=dry):
                    self.assert_exit(run("sqbake", "bake", source, *arguments, *dry), 3)

    def test_a_dry_run_writes_nothing_and_says_what_would_be(self):
        result = run("sqbake", "bake", self.models / "a.off", "-o", self.folder / "a.h5", "-n", "--max-parts", "3")
        self.assert_exit(result, 0)
        self.assertEqual(result.stdout, f"{self.models}/a.off -> {self.folder}/a.h5 max-parts=3\n")
        self.assertFalse((self.folder / "a.h5").exists())


class Settings(FolderTest):
    def setUp(self):
        super().setUp()
        self.mesh = self.folder / "props" / "chair.off"
        self.mesh.parent.mkdir()
        write_off(self.mesh, box())

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="ascii")
        return self.folder / name

    def shown(self, *options, mesh=None):
        result = run("sqbake", "config", "show", mesh or self.mesh, *options, "--format", "json")
        self.assert_exit(result, 0)
        return {name: (s["value"], s["source"]) for name, s in json.loads(result.stdout)["settings"].items()}

    def test_each_source_overrides_the_one_before(self):
        self.assertEqual(self.shown()["max-parts"], ("24", "built in"))
        project = self.write("sqbake.toml", "[default]\nmax-parts = 1\n")
        self.assertEqual(self.shown()["max-parts"], ("1", f"{project}:2"))
        manifest = self.write("manifest.toml", '[default]\nmax-parts = 2\n[[asset]]\ninput = "props/chair.off"\n')
        self.assertEqual(self.shown("--manifest", manifest)["max-parts"], ("2", f"{manifest}:2"))
        self.write("sqbake.toml", '[default]\nmax-parts = 1\n[[rule]]\nmatch = "props/**"\nmax-parts = 3\n')
        self.assertEqual(self.shown("--manifest", manifest)["max-parts"], ("3", f"{project}:5 (rule `props/**`)"))
        self.write("manifest.toml", '[default]\nmax-parts = 2\n[[asset]]\ninput = "props/chair.off"\nmax-parts = 4\n')
        self.assertEqual(self.shown("--manifest", manifest)["max-parts"], ("4", f"{manifest}:5"))
        sidecar = self.write("props/chair.sqbake.toml", "max-parts = 5\n")
        self.assertEqual(self.shown("--manifest", manifest)["max-parts"], ("5", f"{sidecar}:1"))
        self.assertEqual(self.shown("--manifest", manifest, "--max-parts", "6")["max-parts"], ("6", "command line"))
        self.assertEqual(self.shown("--no-config")["max-parts"], ("24", "built in"))

    def test_a_quality_sets_the_limits_that_are_not_given_beside_it(self):
        limits = ("max-error", "max-parts", "max-bytes")
        plain = self.shown()
        for name, expected in (("draft", ("0.2%", "12", "64K")), ("standard", ("0.05%", "24", "128K")),
                               ("fine", ("0.025%", "48", "256K"))):
            shown = self.shown("--quality", name)
            self.assertEqual(shown["quality"], (name, "command line"))
            self.assertEqual([shown[limit] for limit in limits],
                             [(value, f"command line (quality {name})") for value in expected])
            if name == "standard":
                self.assertEqual([shown[limit][0] for limit in limits], [plain[limit][0] for limit in limits])
        for options in (("--quality", "fine", "--max-parts", "5"), ("--max-parts", "5", "--quality", "fine")):
            shown = self.shown(*options)
            self.assertEqual((shown["max-parts"], shown["max-error"][0]), (("5", "command line"), "0.025%"))

    def test_a_quality_replaces_the_limits_of_weaker_sources_only(self):
        project = self.write("sqbake.toml", '[default]\nmax-parts = 7\nquality = "draft"\n'
                                            '[[rule]]\nmatch = "props/*"\nmax-bytes = "90K"\n')
        shown = self.shown()
        self.assertEqual((shown["max-parts"], shown["max-error"], shown["max-bytes"][0]),
                         (("7", f"{project}:2"), ("0.2%", f"{project}:3 (quality draft)"), "90K"))
        shown = self.shown("--quality", "fine", "--max-error", "3%")
        self.assertEqual([shown[name][0] for name in ("max-error", "max-parts", "max-bytes")], ["3%", "48", "256K"])

    def test_rules_match_below_their_file_and_the_last_one_wins(self):
        self.write("sqbake.toml", '[[rule]]\nmatch = "*.off"\nup = "x"\nunit = "mm"\n'
                                  '[[rule]]\nmatch = "props/c*.off"\nup = "y"\n[[rule]]\nmatch = "other/**"\nup = "z"\n')
        shown = self.shown()
        self.assertEqual((shown["up"][0], shown["unit"][0]), ("y", "mm"))
        self.assertEqual(self.shown(mesh=self.folder / "props" / "table.off")["up"][0], "x")
        self.assertEqual(self.shown(mesh=self.folder / "props" / "table.obj")["up"][0], "z")

    def test_the_nearest_project_file_holds_and_another_can_be_named(self):
        self.write("sqbake.toml", "[default]\nmax-parts = 1\n")
        self.write("props/sqbake.toml", "[default]\nmax-parts = 2\n")
        self.assertEqual(self.shown()["max-parts"][0], "2")
        self.assertEqual(self.shown("--config", self.folder / "sqbake.toml")["max-parts"][0], "1")

    def test_wrong_files_are_refused_with_line_and_suggestion_before_any_bake(self):
        write_off(self.folder / "props" / "a.off", box())  # comes first
        cases = [("sqbake.toml", '[default]\nunits = "mm"\n', ["sqbake.toml:2", "`units`", "did you mean `unit`?"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "*"\nmax_parts = 3\n', [":3", "did you mean `max-parts`?"]),
                 ("sqbake.toml", "unit = 1\n", [":1", "unknown key `unit`", "[default]"]),
                 ("sqbake.toml", "[default]\nup = \"w\"\n", [":2", "`w`", "x, y, z"]),
                 ("sqbake.toml", "[default]\nup = [1]\n", [":2", "up"]),
                 ("sqbake.toml", "[default]\nconservative = true\n", [":2", "conservative: `true`, must be one of off, on"]),
                 ("sqbake.toml", '[default]\nquality = "good"\n', [":2", "`good`", "draft, standard, fine"]),
                 ("sqbake.toml", "[default\n", ["sqbake.toml:1"]),
                 ("sqbake.toml", "[[rule]]\nunit = 1\n", [":1", "match"]),
                 ("sqbake.toml", '[[rule]]\nunit = 1\nmatch = "props/[ab.off"\n', [":3", "`props/[ab.off`", "without `]`"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "[z-a]*"\n', [":2", "wrong order"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "props**/*.off"\n', [":2", "whole name"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "../*.off"\n', [":2", "`..`"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "props/"\n', [":2", "`**`"]),
                 ("sqbake.toml", '[[rule]]\nmatch = "./"\n', [":2", "names nothing"]),
                 ("sqbake.toml", "[default]\nmax-parts = 0\n", [":2", "--max-parts = 0"]),
                 ("props/chair.sqbake.toml", "max-err = 1\n", ["chair.sqbake.toml:1", "did you mean `max-error`?"])]
        for name, text, named in cases:
            with self.subTest(text=text):
                path = self.write(name, text)
                result = run("sqbake", "bake", self.folder / "props", "--out-dir", self.folder / "out")
                self.assert_exit(result, 2)
                for part in named:
                    self.assertIn(part, result.stderr)
                self.assertFalse((self.folder / "out").exists())
                self.assert_exit(run("sqbake", "config", "show", self.mesh), 2)
                path.unlink()

    def test_two_sidecars_are_refused(self):
        self.write("props/chair.sqbake.toml", "max-parts = 1\n")
        self.write("props/chair.off.sqbake.toml", "max-parts = 1\n")
        self.assertIn("two sidecars", run("sqbake", "config", "show", self.mesh).stderr)

    def test_a_sidecar_bakes_the_bytes_of_the_same_options_on_the_command_line(self):
        given, beside, plain = (self.folder / f"{name}.h5" for name in ("given", "beside", "plain"))
        self.assert_exit(run("sqbake", "bake", self.mesh, *ROUGH, "-o", given, "--unit", "cm", "--up", "y"), 0)
        self.assert_exit(run("sqbake", "bake", self.mesh, *ROUGH, "-o", plain), 0)
        self.write("props/chair.sqbake.toml", 'unit = "cm"\nup = "y"\nmax-error = "1%"\n')
        self.assert_exit(run("sqbake", "bake", self.mesh, "-o", beside), 0)
        self.assertEqual(beside.read_bytes(), given.read_bytes())
        self.assertNotEqual(beside.read_bytes(), plain.read_bytes())

    def test_a_quality_bakes_the_bytes_of_the_limits_it_stands_for(self):
        write_off(self.mesh, sphere(2))
        bundles = {}
        for name, options in (("draft", ("--quality", "draft")), ("plain", ()),
                              ("limits", [word for limit in ("max-error", "max-parts", "max-bytes")
                                          for word in (f"--{limit}", self.shown("--quality", "draft")[limit][0])])):
            self.assert_exit(run("sqbake", "bake", self.mesh, *options, "-o", self.folder / f"{name}.h5"), 0)
            bundles[name] = (self.folder / f"{name}.h5").read_bytes()
        self.assertEqual(bundles["draft"], bundles["limits"])
        self.assertNotEqual(bundles["draft"], bundles["plain"])

    def test_config_show_prints_every_setting_with_its_source(self):
        text = run("sqbake", "config", "show", self.mesh, "--timeout", "5m").stdout
        for name in ("unit", "up", "repair", "quality", "max-error", "max-parts", "max-bytes", "conservative", "taper", "bend",
                     "memory", "fallback"):
            self.assertRegex(text, rf"(?m)^  {name} +\S+ +built in$")
        self.assertRegex(text, r"(?m)^  timeout +5m +command line$")
        columns = {re.match(r"  \S+ +", line).end() for line in text.splitlines()[1:]}
        self.assertEqual(len(columns), 1, "the values stand below each other")


class Spelling(unittest.TestCase):
    def test_a_mistyped_option_or_command_is_answered_with_the_right_one(self):
        for arguments, meant in ((("bake", "x.off", "--max-eror", "1%"), "`--max-error`"),
                                 (("bake", "x.off", "--timout=3"), "`--timeout`"),
                                 (("config", "show", "x.off", "--no-cofnig"), "`--no-config`"),
                                 (("--versoin",), "`--version`"),
                                 (("report", "x.ndjson", "--outptu", "x.html"), "`--output`"),
                                 (("bake", "x.off", "--up", "Z"), "`z`"),
                                 (("help",), "`--help`"),
                                 (("version",), "`--version`"),
                                 (("bkae", "x.off"), "`bake`")):
            with self.subTest(arguments=arguments):
                result = run("sqbake", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertIn(f"did you mean {meant}?", result.stderr)
        self.assertNotIn("did you mean", run("sqbake", "bake", "x.off", "--colourful-fireworks").stderr)
        self.assertNotIn("did you mean", run("sqbake", "bake", "x.off", "--up", "w").stderr)

    def refuse(self, arguments, message):
        with self.subTest(arguments=arguments):
            result = run("sqbake", *arguments)
            self.assertEqual((result.returncode, result.stdout), (2, ""))
            self.assertIn(message, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1)

    def test_a_mistyped_command_of_a_command_is_answered_with_the_right_one(self):
        self.refuse(("cache", "stat"), "unknown command `cache stat`; did you mean `stats`?")
        self.refuse(("cache", "--format", "json", "verfiy"), "unknown command `cache verfiy`; did you mean `verify`?")
        self.refuse(("config", "shw", "x.off"), "unknown command `config shw`; did you mean `show`?")
        self.refuse(("cache", "fireworks"), "the commands are stats, verify, gc")
        self.refuse(("cache",), "see `sqbake cache --help`")

    def test_a_value_is_one_of_the_words_and_nothing_else(self):
        formats = "must be one of text, json, ndjson"
        for arguments, message in ((("bake", "x.off", "--format", "yaml"), f"--format: `yaml`, {formats}"),
                                   (("bake", "x.off", "--format", "1"), f"--format: `1`, {formats}"),
                                   (("bake", "x.off", "--format", "jsn"), "did you mean `json`?"),
                                   (("bake", "x.off", "--progress", "2"), "must be one of auto, always, never"),
                                   (("bake", "x.off", "--color", "blue"), "--color: `blue`, must be one of auto, always"),
                                   (("check", "x.off", "--color", "1"), "must be one of auto, always, never"),
                                   (("check", "x.off", "--format", "yaml"), "`yaml`, must be one of text, json"),
                                   (("config", "show", "x.off", "--format", "yaml"), "must be one of text, json"),
                                   (("cache", "stats", "--format", "yaml"), "must be one of text, json"),
                                   (("plan", "x.off", "--out-dir", "o", "--format", "json"), "must be one of text, ndjson"),
                                   (("bake", "x.off", "--quality", "drft"), "did you mean `draft`?")):
            self.refuse(arguments, message)


if __name__ == "__main__":
    unittest.main()
