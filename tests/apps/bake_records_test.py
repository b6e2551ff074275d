# SPDX-License-Identifier: Apache-2.0
"""The records of sqbake keep to apps/sqbake/bake.schema.json, and the cache gives the bytes of a bake."""
import json
import os
import pty
import re
import subprocess
import unittest
from pathlib import Path

import jsonschema

import support
from support import ROUGH, TIMEOUT_S, FolderTest, box, command, sphere, write_off

SOURCE = Path(os.environ["SQMAP_SOURCE_DIR"])


def read_schema(name):
    return json.loads((SOURCE / "apps/sqbake" / name).read_text(encoding="utf-8"))


def closed(schema):
    """The same, but for fields that it does not name: users shall pass over them, sqbake shall print none."""
    if isinstance(schema, list):
        return [closed(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    more = {"additionalProperties": False} if "properties" in schema and schema.get("type") == "object" else {}
    return {**{name: closed(value) for name, value in schema.items()}, **more}


def more_fields(json_value):
    if isinstance(json_value, list):
        return [more_fields(item) for item in json_value]
    if not isinstance(json_value, dict) or ("schema" not in json_value and set(json_value) & {"unit", "ok"}):
        return json_value  # settings and counts of outcomes: their names are no fields
    return {**{name: more_fields(value) for name, value in json_value.items()}, "added later": 1}


SCHEMA = read_schema("bake.schema.json")


def run(*arguments):
    return support.run(*arguments, errors="replace")  # a file name is any bytes, and messages name files


class Records(FolderTest):
    def setUp(self):
        super().setUp()
        jsonschema.Draft7Validator.check_schema(SCHEMA)
        self.validator = jsonschema.Draft7Validator(closed(SCHEMA))
        self.models = self.folder / "models"
        self.models.mkdir()
        write_off(self.models / "ball.off", sphere(1))
        write_off(self.models / "open.off", (box()[0], box()[1][2:]))
        (self.models / "broken.off").write_text("OFF\n1 1 0\n", encoding="ascii")
        write_off(self.models / os.fsdecode(b"caf\xe9.off"), box(9000, 9000, 9000))  # no UTF-8; suspiciously large
        self.out = self.folder / "out"

    def valid(self, text):
        record = json.loads(text)
        self.validator.validate(record)
        return record

    def test_every_kind_of_record_keeps_to_the_schema(self):
        options = (*ROUGH, "--repair", "none", "--out-dir", self.out)
        lines = run("sqbake", "bake", self.models, *options, "--format", "ndjson").stdout.splitlines()
        records = [self.valid(line) for line in lines]
        self.assertEqual([r.get("outcome", r["type"]) for r in records], ["ok", "failed", "ok", "degraded", "summary"])
        self.assertEqual([len(r["warnings"]) for r in records[:4]], [0, 0, 1, 0])
        self.assertEqual((records[4]["ok"], records[4]["degraded"], records[4]["failed"]), (2, 1, 1))
        self.valid(run("sqbake", "bake", self.models, *options, "--format", "json").stdout)
        late = run("sqbake", "bake", self.models, *options, "--format", "ndjson", "--timeout", "0.001s", "--fail-fast",
                   "-j1")
        self.assertEqual([self.valid(line).get("outcome") for line in late.stdout.splitlines()],
                         ["timeout"] + 3 * ["cancelled"] + [None])
        for dry in (["-n"], ["-n", "--explain"]):
            for line in run("sqbake", "bake", self.models, *options, *dry, "--format", "ndjson").stdout.splitlines():
                self.valid(line)
            self.valid(run("sqbake", "bake", self.models, *options, *dry, "--format", "json").stdout)

    def test_filled_holes_are_told_in_log_record_and_page(self):
        vertices, faces = sphere(1)
        holed = write_off(self.models / "holed.off", (vertices, faces[1:-1]))  # opposite triangles are gone
        options = (*ROUGH, "-o", self.folder / "a.h5", "--report", self.folder / "page.html", "--format", "ndjson")
        result = run("sqbake", "bake", holed, *options)
        self.assert_exit(result, 0)
        record = self.valid(result.stdout.splitlines()[0])
        self.assertEqual((record["outcome"], record["mesh"]["filled_holes"]), ("ok", 2))
        self.assertRegex(record["warnings"][0], "^2 holes .* filled")
        self.assertIn("warning: holed.off: 2 holes", result.stderr)
        self.assertIn("2 holes", (self.folder / "page.html").read_text(encoding="utf-8"))
        self.assertEqual(run("sqbake", "bake", self.models / "ball.off", *options).stderr, "")

    def test_the_schema_refuses_what_is_no_record(self):
        good = self.valid(run("sqbake", "bake", self.models / "ball.off", *ROUGH, "-o", self.folder / "a.h5", "--format",
                              "ndjson").stdout.splitlines()[0])
        for change in ({"outcome": "fine"}, {"outcome": "failed"}, {"parts": 0}, {"hash": "x"}, {"unknown": 1},
                       {"schema": "x"}, {"mesh": {}}, {"fits": []}, {"fits": [{"iterations": 1, "stop": "fine"}]}):
            with self.subTest(change=change), self.assertRaises(jsonschema.ValidationError):
                self.validator.validate({**good, **change})

    def test_the_cache_gives_the_bytes_of_a_bake_and_the_records_of_one(self):
        options = (*ROUGH, "--repair", "none", "--format", "ndjson", "--cache", self.folder / "cache", "--explain")
        cold = run("sqbake", "bake", self.models, *options, "--out-dir", self.folder / "cold")
        again = run("sqbake", "bake", self.models, *options, "--out-dir", self.folder / "cold")
        other = run("sqbake", "bake", self.models, *options, "--out-dir", self.folder / "other")
        for result in (cold, again, other):
            self.assertEqual(result.returncode, 1)
        cold, again, other = ([self.valid(line) for line in r.stdout.splitlines()] for r in (cold, again, other))
        self.assertEqual([r["cached"] for r in again], [True, False, True, True, 3])
        drop = ("cached", "seconds", "stages", "output", "error")
        self.assertEqual([("hash" in r) for r in cold[:4]], [True, False, True, True])
        for first, second, third in zip(cold[:4], again, other):
            bare = [{k: v for k, v in r.items() if k not in drop} for r in (first, second, third)]
            self.assertEqual(bare[0], bare[1])
            self.assertEqual(bare[0], bare[2])
        for bundle in (self.folder / "cold").iterdir():
            self.assertEqual((self.folder / "other" / bundle.name).read_bytes(), bundle.read_bytes())

    def test_the_table_says_which_bundles_came_from_the_cache(self):
        options = (*ROUGH, "--cache", self.folder / "cache")
        run("sqbake", "bake", self.models / "ball.off", *options, "-o", self.folder / "ball.h5")
        result = run("sqbake", "bake", self.models, *options, "--out-dir", self.out)
        ends = {line.split()[0]: line.split()[-1] for line in result.stdout.splitlines()}
        self.assertEqual(ends["ball.off"], "cached")
        self.assertRegex(ends["open.off"], r"^\d+\.\d\d$")
        self.assertIn("1 of them from the cache", result.stderr)

    def test_a_fallback_or_a_limit_is_never_kept(self):
        cache = ("--cache", self.folder / "cache", "--format", "ndjson")
        source = self.models / "ball.off"
        self.assert_exit(run("sqbake", "bake", source, "-o", self.folder / "a.h5", *cache, "--timeout", "0.001s"), 8)
        result = run("sqbake", "bake", source, *ROUGH, "-o", self.folder / "a.h5", *cache)
        self.assertFalse(json.loads(result.stdout.splitlines()[0])["cached"])


class Versions(unittest.TestCase):
    def test_what_this_version_once_printed_keeps_to_its_schema_and_so_does_what_has_more_fields(self):
        """A field that becomes required, goes or is renamed breaks one who wrote for this version: it needs another."""
        schemas = {schema["$id"]: schema for schema in map(read_schema, ("bake.schema.json", "tools.schema.json"))}
        lines = (SOURCE / "tests/apps/kept_records.ndjson").read_text(encoding="utf-8").splitlines()
        kinds = set()
        for line in map(json.loads, lines):
            schema = schemas[line["of"]]
            kinds.add(line["record"]["schema"])
            jsonschema.Draft7Validator(schema).validate(line["record"])
            jsonschema.Draft7Validator(schema).validate(more_fields(line["record"]))
        declared = set(re.findall(r'"const": "(sqmap[^"]*)"', json.dumps(list(schemas.values()))))
        self.assertEqual(kinds, declared, "a version without kept records, or kept records of another version")


class Tools(FolderTest):
    def test_what_the_other_commands_print_keeps_to_their_schema(self):
        schema = read_schema("tools.schema.json")
        self.assertEqual(schema["definitions"]["mesh"], SCHEMA["definitions"]["mesh"])
        jsonschema.Draft7Validator.check_schema(schema)
        validator = jsonschema.Draft7Validator(closed(schema))
        ball, cache = write_off(self.folder / "ball.off", sphere(0)), self.folder / "cache"
        write_off(self.folder / "open.off", (box()[0], box()[1][2:]))
        baked = run("sqbake", "bake", ball, *ROUGH, "-o", self.folder / "ball.h5", "--cache", cache, "--format", "ndjson")
        (self.folder / "records.ndjson").write_text(baked.stdout, encoding="utf-8")
        plan = run("sqbake", "plan", self.folder, "--out-dir", self.folder, "--shards", "2", "--format", "ndjson").stdout
        (self.folder / "plan.ndjson").write_text(plan, encoding="utf-8")
        merged = run("sqbake", "merge", self.folder / "records.ndjson", "--plan", self.folder / "plan.ndjson").stdout
        printed = [*plan.splitlines(), merged.splitlines()[-1],
                   run("sqbake", "check", self.folder / "open.off", "--format", "json", "--repair", "none").stdout,
                   run("sqbake", "config", "show", ball, "--max-parts", "3", "--format", "json").stdout,
                   *(run("sqbake", "cache", command, "--cache", cache, "--format", "json").stdout
                     for command in ("stats", "verify", "gc"))]
        records = [json.loads(text) for text in printed]
        self.assertEqual([(r["schema"], r.get("type")) for r in records],
                         2 * [("sqmap.plan/1", "plan")] + [("sqmap.merge/1", "summary"), ("sqmap.check/1", None),
                         ("sqmap.config/1", None), ("sqmap.cache/1", "stats"), ("sqmap.cache/1", "verify"),
                         ("sqmap.cache/1", "gc")])
        self.assertEqual(records[2]["missing"], [str(self.folder / "open.h5")])
        for record in records:
            validator.validate(record)
            for name in record.keys() - {"outcomes"}:
                for wrong in ({k: v for k, v in record.items() if k != name}, {**record, name: {"x": []}},
                              {**record, "unknown": 1}):
                    self.assertFalse(validator.is_valid(wrong), (record["schema"], name))


class Terminal(FolderTest):
    def on_terminal(self, environment, *arguments):
        """What a terminal sees of the messages."""
        master, slave = pty.openpty()
        plain = {k: v for k, v in os.environ.items() if k not in ("CI", "NO_COLOR", "TERM")}
        process = subprocess.Popen(command(*arguments), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=slave,
                                   env={**plain, **environment})
        os.close(slave)
        shown = b""
        try:
            while chunk := os.read(master, 65536):
                shown += chunk
        except OSError:
            pass  # how a terminal ends
        os.close(master)
        return process.wait(timeout=TIMEOUT_S), shown.decode("utf-8")

    def test_messages_are_coloured_on_a_terminal_unless_the_environment_objects(self):
        red = "\033[1;31merror:"
        for environment, options, is_coloured in (({"TERM": "xterm"}, (), True),
                                                  ({"TERM": "xterm", "NO_COLOR": "1"}, (), False),
                                                  ({"TERM": "xterm", "NO_COLOR": ""}, (), True),
                                                  ({"TERM": "dumb"}, (), False),
                                                  ({"TERM": "xterm", "NO_COLOR": "1"}, ("--color", "always"), True),
                                                  ({"TERM": "xterm"}, ("--color", "never"), False)):
            with self.subTest(environment=environment, options=options):
                code, shown = self.on_terminal(environment, "sqbake", "check", self.folder / "none.off", *options)
                self.assertEqual(code, 3)
                self.assertIn("error:", shown)
                self.assertEqual(red in shown, is_coloured, repr(shown))
                self.assertEqual("\033" in shown, is_coloured, repr(shown))

    def test_a_terminal_sees_count_rate_and_time_left(self):
        for name in "abcd":
            write_off(self.folder / f"{name}.off", sphere(3))
        code, shown = self.on_terminal({"TERM": "xterm"}, "sqbake", "bake", self.folder, *ROUGH, "--out-dir",
                                       self.folder / "out", "-j1")
        self.assertEqual(code, 0)
        self.assertRegex(shown, r"\[2/4\] \w\.off  \w+ \d+ %  [\d.]+/(?:s|min)  \d+:\d\d:\d\d left")
        last = re.split(r"\r\x1b\[K", shown)[-1]
        self.assertIn("4 of 4 baked", last)


if __name__ == "__main__":
    unittest.main()
