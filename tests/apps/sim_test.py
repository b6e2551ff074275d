# SPDX-License-Identifier: Apache-2.0
"""sqsim: scenes of a baked ball, with forces known from mechanics; scene files that are wrong; what it writes."""
import csv
import json
import os
import re
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from support import BIN, ROUGH, TIMEOUT_S, FolderTest, run, sphere

SOURCE = Path(os.environ["SQMAP_SOURCE_DIR"])
MESHES = Path(os.environ["SQMAP_MESH_DIR"])
SCENES = SOURCE / "samples" / "scenes"
SCHEMA = json.loads((SCENES / "scene.schema.json").read_text(encoding="utf-8"))
RADIUS_M = 0.5


def scene(**changes):
    """A point that is let down on the ball from above and held 2 cm below its top."""
    content = {"schema": "sqmap.scene/1", "rate_hz": 1000, "seconds": 3, "query": {"layer": 3},
               "objects": [{"bundle": "ball.h5"}],
               "probe": {"points_m": [[0, 0, 0]],
                         "keyframes": [{"time_s": 0, "position_m": [0, 0, RADIUS_M + 0.05]},
                                       {"time_s": 1, "position_m": [0, 0, RADIUS_M - 0.02]}],
                         "coupling": {"mass_kg": 0.1, "stiffness_n_per_m": 500, "damping_n_s_per_m": 10}},
               "effects": {"reaction": {"stiffness_n_per_m": 500}}}
    content.update(changes)
    return {key: value for key, value in content.items() if value is not None}


class Simulation(FolderTest):
    def simulate(self, content, *options):
        path = self.folder / "scene.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        return run("sqsim", path, "--fast", *options)

    def rows(self, content, *options):
        self.bake(sphere(3, RADIUS_M), "ball", *ROUGH)
        self.result = self.simulate(content, "-o", self.folder / "out", *options)
        self.assert_exit(self.result, 0)
        with open(self.folder / "out" / "trace.csv", encoding="ascii", newline="") as file:
            return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]

    def test_two_equal_springs_share_the_way(self):
        rows = self.rows(scene())
        self.assertEqual(len(rows), 3000)
        last = rows[-1]
        self.assertAlmostEqual(last["z_m"], RADIUS_M - 0.01, delta=2e-3)
        self.assertAlmostEqual(last["force_z_n"], 5, delta=1)
        # At rest the force on the probe is that of the coupling, whatever the map's error.
        self.assertAlmostEqual(last["force_z_n"], 500 * (last["z_m"] - (RADIUS_M - 0.02)), delta=0.02)
        self.assertEqual((last["contacts"], last["layer"]), (1, 3))
        self.assertEqual((rows[0]["contacts"], rows[0]["force_z_n"]), (0, 0))
        self.assertRegex(self.result.stdout, r"median [\d.]+ us, 99.9 % [\d.]+ us, worst [\d.]+ us")
        self.assertRegex(self.result.stdout, r"missed deadlines: \d+ \(\d+ by frames ")
        processor = re.search(r"of the processor alone: median ([\d.]+) us.*worst ([\d.]+) us; in contact: ",
                              self.result.stdout)
        self.assertLess(0, float(processor[1]))
        self.assertLessEqual(float(processor[1]), float(processor[2]))
        self.assertRegex(self.result.stdout, r"force jumps > 10 %: \d+ of \d+ steps")

    def test_writes_a_plot_and_a_picture(self):
        self.rows(scene(seconds=0.1))
        self.assertEqual([name for name in self.files() if name.startswith("out/")],
                         ["out/last_frame.glb", "out/trace.csv", "out/trace.svg"])
        root = ElementTree.parse(self.folder / "out" / "trace.svg").getroot()
        self.assertEqual(len(root.findall("{http://www.w3.org/2000/svg}polyline")), 3)
        glb = (self.folder / "out" / "last_frame.glb").read_bytes()
        self.assertEqual(struct.unpack_from("<4sII", glb), (b"glTF", 2, len(glb)))

    def test_the_option_for_time_and_rate_replace_the_scenes(self):
        rows = self.rows(scene(), "--rate", 500, "--seconds", 0.2)
        self.assertEqual(len(rows), 100)
        self.assertAlmostEqual(rows[1]["time_s"], 0.002)

    def test_the_first_layer_needs_no_effect_and_says_inside(self):
        content = scene(query={"layer": 1}, effects=None)
        del content["probe"]["coupling"]
        rows = self.rows(content)
        self.assertEqual((rows[0]["contacts"], rows[-1]["contacts"], rows[-1]["layer"]), (0, 1, 1))
        self.assertEqual(rows[-1]["force_z_n"], 0)

    def test_a_budget_decides_the_layer_and_is_kept(self):
        # A point in one superquadric is a block, and 2, 4 or 9 units by layer.
        for budget, spent, layer in [(10, 10, 3), (9, 5, 2), (5, 5, 2), (4, 3, 1), (0, 3, 1)]:
            with self.subTest(budget=budget):
                content = scene(budget={"units": budget})
                del content["probe"]["coupling"]
                last = self.rows(content)[-1]
                self.assertEqual((last["contacts"], last["layer"], last["work_units"]), (1, layer, spent))
                self.assertEqual(last["force_z_n"] > 0, layer > 1)
                self.assertIn(f"budget of {budget} units: ", self.result.stdout)

    def test_a_budget_of_time_is_learned_and_runs_may_be_repeated(self):
        rows = self.rows(scene(budget={"microseconds": 500}), "--runs", 3)
        self.assertEqual((rows[-1]["layer"], rows[-1]["work_units"]), (3, 10))
        self.assertRegex(self.result.stdout, r"each frame's shortest time in 3 runs: median [\d.]+ us, ")

    def test_waits_for_the_time_of_each_frame(self):
        self.bake(sphere(3, RADIUS_M), "ball", *ROUGH)
        path = self.folder / "scene.json"
        path.write_text(json.dumps(scene(rate_hz=100)), encoding="utf-8")
        before = os.times().elapsed
        self.assert_exit(run("sqsim", path, "--seconds", 0.5), 0)
        self.assertGreater(os.times().elapsed - before, 0.48)

    def test_a_cloth_at_rest_presses_with_its_weight(self):
        rows = self.rows(scene(probe=None, effects=None, rate_hz=240, seconds=3,
                               cloth={"centre_m": [0, 0, RADIUS_M + 0.02], "edge_m": 0.6, "nodes_along_edge": 25,
                                      "mass_kg": 0.2, "thickness_m": 0.01, "friction": 1}))
        mean = sum(row["force_z_n"] for row in rows[-240:]) / 240
        self.assertAlmostEqual(mean, 0.2 * 9.81, delta=0.1 * 0.2 * 9.81)
        self.assertGreater(rows[-1]["contacts"], 20)

    def test_a_cloth_on_a_slope_stays_within_the_cone_of_friction_and_slides_beyond(self):
        # About 20 degrees, where friction of 1 holds up to 45, one of 0.1 up to 6.
        for friction, way_m in [(1, (-1e-3, 1e-3)), (0.1, (0.05, 1))]:
            with self.subTest(friction=friction):
                rows = self.rows(scene(probe=None, effects=None, rate_hz=120, seconds=0.5,
                                       cloth={"centre_m": [0.17, 0, RADIUS_M], "edge_m": 0.2, "nodes_along_edge": 11,
                                              "mass_kg": 0.05, "thickness_m": 0, "friction": friction}))
                self.assertGreater(rows[40]["contacts"], 20)
                slid_m = rows[40]["x_m"] - rows[20]["x_m"]
                self.assertGreater(slid_m, way_m[0])
                self.assertLess(slid_m, way_m[1])


class ShippedScenes(unittest.TestCase):
    """The scenes as README runs them, in a tree like that of a build, with rough bakes of the samples."""

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="sqmap-")
        cls.addClassCleanup(holder.cleanup)
        cls.folder = Path(holder.name)
        (cls.folder / "build").mkdir()
        for link, target in [("samples", SOURCE / "samples"), ("build/bin", BIN), ("build/meshes", MESHES)]:
            (cls.folder / link).symlink_to(target)
        names = ("elephant", "camel", "hand", "lion", "dino", "armadillo")
        result = run("sqbake", "bake", *(MESHES / f"{name}.off" for name in names), "--out-dir",
                     cls.folder / "build" / "bundles", *ROUGH)
        if result.returncode != 0:
            raise AssertionError(result.stderr)

    def rows(self, name, *options):
        line = re.search(r"`(build/bin/sqsim samples/scenes/object_recognition[.]json [^`]*)`",
                         (SOURCE / "README.md").read_text(encoding="utf-8"))[1]
        words = line.replace("object_recognition", name).replace("DIR", "out").split() + ["--fast", *options]
        result = subprocess.run(words, cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                timeout=TIMEOUT_S, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(sorted(path.name for path in (self.folder / "out").iterdir()),
                         ["last_frame.glb", "trace.csv", "trace.svg"])
        with open(self.folder / "out" / "trace.csv", encoding="ascii", newline="") as file:
            return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]

    def test_readmes_line_lets_the_hand_touch(self):
        rows = self.rows("object_recognition", "--seconds", "8", "--rate", "500")
        self.assertEqual(len(rows), 4000)
        self.assertGreater(max(row["contacts"] for row in rows), 10)

    def test_the_hand_feels_every_object(self):
        rows = self.rows("object_recognition", "--rate", "500")
        content = json.loads((SCENES / "object_recognition.json").read_text(encoding="utf-8"))
        for item in content["objects"]:
            near = [row for row in rows if abs(row["x_m"] - item["position_m"][0]) < 0.5]
            self.assertGreater(sum(row["contacts"] > 0 for row in near), 200, item["name"])
        self.assertGreater(rows[-1]["contacts"], 0)  # for the picture

    def test_readmes_line_lets_the_cloth_touch(self):
        rows = self.rows("costume_designer", "--seconds", "0.4")
        self.assertEqual(len(rows), 48)
        self.assertGreater(rows[-1]["contacts"], 10)

    def test_the_cloth_stays_on_its_figure(self):
        rows = self.rows("costume_designer")
        self.assertGreater(min(row["contacts"] for row in rows[240:]), 100)
        self.assertLess(abs(rows[-1]["z_m"] - rows[240]["z_m"]), 0.01)


class SceneFiles(FolderTest):
    def error(self, content):
        path = self.folder / "scene.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        result = run("sqsim", path)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(str(self.folder), result.stderr)
        return result.returncode, result.stderr

    def test_an_unknown_key_is_an_error_that_names_the_nearest(self):
        for content, key, nearest in [
                (scene(efects={}), "scene.efects", '"effects"'),
                (scene(effects={"fricton": {}}), "scene.effects.fricton", '"friction"'),
                (scene(effects={"reaction": {"stifness_n_per_m": 1}}), "scene.effects.reaction.stifness_n_per_m",
                 '"stiffness_n_per_m"'),
                (scene(objects=[{"bundel": "ball.h5", "bundle": "ball.h5"}]), "scene.objects[0].bundel", '"bundle"')]:
            with self.subTest(key=key):
                code, message = self.error(content)
                self.assertEqual(code, 4)
                self.assertIn(key, message)
                self.assertIn(nearest, message)

    def test_a_wrong_value_is_an_error_that_names_its_place_and_range(self):
        for content, named in [
                ("{", "JSON"), ("[]", "must be an object"), (scene(schema="sqmap.scene/2"), "sqmap.scene/1"),
                (scene(rate_hz=-1), "[1, 100000]"), (scene(objects=[]), "scene.objects"),
                (scene(budget={}), "microseconds or units"), (scene(budget={"units": -1}), "scene.budget.units"),
                (scene(probe=None), "probe or cloth"), (scene(query={"layer": 4}), "scene.query.layer"),
                (scene(effects={"texture": {"amplitude_m": "much"}}), "scene.effects.texture.amplitude_m"),
                (scene(objects=[{"bundle": "ball.h5", "orientation_wxyz": [0, 0, 0, 0]}]), "orientation_wxyz")]:
            with self.subTest(named=named):
                code, message = self.error(content)
                self.assertEqual(code, 4)
                self.assertIn(named, message)

    def test_what_an_effect_needs_must_be_named(self):
        self.bake(sphere(2, RADIUS_M), "ball", *ROUGH)
        code, message = self.error(scene(effects={"friction": {}}))
        self.assertEqual(code, 4)
        self.assertIn('"reaction"', message)

    def test_a_missing_bundle_is_a_missing_file(self):
        code, message = self.error(scene())
        self.assertEqual(code, 3)
        self.assertIn("ball.h5", message)

    def test_shipped_scenes_keep_to_the_schema(self):
        for name in ("object_recognition", "costume_designer"):
            with self.subTest(name=name):
                self.check(json.loads((SCENES / f"{name}.json").read_text(encoding="utf-8")), SCHEMA, name)
                result = run("sqsim", SCENES / f"{name}.json")  # past the scene file, no bundle beside it
                self.assertIn(".h5", result.stderr)

    def check(self, value, schema, where):
        if schema.get("type") == "object":
            self.assertLessEqual(set(value), set(schema["properties"]), where)
            self.assertLessEqual(set(schema.get("required", ())), set(value), where)
            for key, item in value.items():
                self.check(item, schema["properties"][key], f"{where}.{key}")
        elif schema.get("type") == "array":
            for item in value:
                self.check(item, schema["items"], where)
        elif schema.get("type") in ("number", "integer"):
            self.assertGreaterEqual(value, schema.get("minimum", value), where)
            self.assertLessEqual(value, schema.get("maximum", value), where)

    def test_the_schema_knows_every_effect_and_the_ranges_of_the_program(self):
        effects = SCHEMA["properties"]["effects"]["properties"]
        for name, effect in effects.items():
            for key, rule in effect["properties"].items():
                with self.subTest(effect=name, parameter=key):
                    for value, code in [(rule["minimum"], 3), (rule["maximum"], 3), (rule["default"], 3),
                                        (rule["minimum"] - 1, 4), (rule["maximum"] * 2 + 1, 4)]:
                        found, message = self.outcome(name, key, value)
                        self.assertEqual(found, code, message)

    def outcome(self, name, key, value):
        path = self.folder / "scene.json"
        path.write_text(json.dumps(scene(effects={name: {key: value}, **({"reaction": {}} if name != "reaction" else {})})),
                        encoding="utf-8")
        result = run("sqsim", path)  # 3: the file is right, its bundle is not there
        return result.returncode, result.stderr


class CommandLine(unittest.TestCase):
    def test_help_has_examples_before_options_and_the_exit_codes(self):
        result = run("sqsim", "--help")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertLess(result.stdout.index("Examples:"), result.stdout.index("Options:"))
        self.assertIn("Exit codes:", result.stdout)

    def test_a_wrong_command_line_exits_2(self):
        for arguments in [(), ("x.json", "--rate", "0"), ("x.json", "--colour")]:
            result = run("sqsim", *arguments)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertTrue(result.stderr.startswith("sqsim: error: "), result.stderr)


if __name__ == "__main__":
    unittest.main()
