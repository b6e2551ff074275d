# SPDX-License-Identifier: Apache-2.0
"""What the tests of sqbench share: one smoke run, and the schema its results fit."""
import json
import os
from pathlib import Path

from support import ROUGH, FolderTest, box, run, sphere, write_off

ROOT = Path(os.environ["SQMAP_SOURCE_DIR"])
SCHEMA = ROOT / "apps" / "sqbench" / "results.schema.json"
TIMED_FIGURES = {"14a", "14b", "14c", "objects", "objects-build", "probes"}
TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


def is_a(value, name):
    if name in ("number", "integer"):
        return isinstance(value, (int, float) if name == "number" else int) and not isinstance(value, bool)
    return isinstance(value, TYPES[name])


def violations(value, schema, root, where="$"):
    """What breaks the schema; of JSON Schema as much as results.schema.json uses."""
    if "$ref" in schema:
        schema = {**root["$defs"][schema["$ref"].rsplit("/", 1)[1]], **schema}
    if "const" in schema and value != schema["const"]:
        yield f"{where}: {value!r}, must be {schema['const']!r}"
    if "enum" in schema and value not in schema["enum"]:
        yield f"{where}: {value!r}, must be one of {schema['enum']}"
    names = schema.get("type", [])
    names = [names] if isinstance(names, str) else names
    if names and not any(is_a(value, name) for name in names):
        yield f"{where}: {value!r}, must be {names}"
        return
    if "minimum" in schema and value < schema["minimum"]:
        yield f"{where}: {value!r}, must be at least {schema['minimum']}"
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from violations(item, schema["items"], root, f"{where}[{index}]")
    if isinstance(value, dict):
        for name in set(schema["required"]) - value.keys():
            yield f"{where}: no {name}"
        for name, item in value.items():
            if name in schema["properties"]:
                yield from violations(item, schema["properties"][name], root, f"{where}.{name}")
            else:
                yield f"{where}: {name} is not in the schema"


def spreads_in(value):
    """All medians with their quartiles, however deep."""
    if isinstance(value, dict) and "median" in value:
        yield value
    elif isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from spreads_in(item)


class SmokeRun(FolderTest):
    """One smoke run over a sphere and a box, baked here; the probe is a sphere."""

    results = None
    files = None

    def setUp(self):
        super().setUp()
        if SmokeRun.results is not None:
            return
        out = self.folder / "out"
        meshes = []
        for name, mesh in (("ball", sphere(3, 1.0)), ("brick", box(2, 1, 1))):
            self.bake(mesh, name, *ROUGH)
            meshes.append(self.folder / f"{name}.off")
        probe = write_off(self.folder / "probe.off", sphere(3, 0.3))
        done = run("sqbench", "run", "all", "--smoke", "--meshes", *meshes, "--bundles", self.folder, "--probe", probe,
                   "-o", out)
        self.assert_exit(done, 0)
        SmokeRun.files = {path.name: path.read_text(encoding="utf-8") for path in out.iterdir()}
        SmokeRun.results = json.loads(SmokeRun.files["results.json"])

    def rows(self, table, **wanted):
        return [row for row in self.results[table] if all(row[key] == value for key, value in wanted.items())]

    def probe_frames(self, peer):
        """Those of one object and the probe, in which all methods take part."""
        return [row for row in self.rows("frames", peer=peer) if row["work"] in ("touching", "far", "grasp")]
