# SPDX-License-Identifier: Apache-2.0
"""sqbench: every suite runs, every answer is as close to the truth as its method states, and the results say so in the
form they promise. No test looks at a time.
"""
import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

from support import ROUGH, FolderTest, box, run, sphere, write_off

ROOT = Path(os.environ["SQMAP_SOURCE_DIR"])
SCHEMA = ROOT / "apps" / "sqbench" / "results.schema.json"
CHROMIUM = shutil.which("chromium")
# Draws each picture of the page and counts its pixels that are not of the commonest colour, by colour.
PAINT = """
<pre id="painted"></pre><script>
const figures = [...document.querySelectorAll("figure svg")];
Promise.all(figures.map(svg => new Promise((done, failed) => {
  const image = new Image();
  image.onerror = failed;
  image.onload = () => {
    const canvas = document.createElement("canvas");
    canvas.width = 480; canvas.height = 320;
    const pen = canvas.getContext("2d");
    pen.drawImage(image, 0, 0, 480, 320);
    const pixels = pen.getImageData(0, 0, 480, 320).data, count = new Map();
    for (let i = 0; i < pixels.length; i += 4) {
      const colour = pixels.slice(i, i + 4).join();
      count.set(colour, (count.get(colour) || 0) + 1);
    }
    const counts = [...count.values()].sort((a, b) => b - a);
    done({colours: counts.length, drawn: counts.slice(1).reduce((a, b) => a + b, 0)});
  };
  image.src = "data:image/svg+xml;charset=utf-8," +
              encodeURIComponent(new XMLSerializer().serializeToString(svg));
}))).then(all => { document.getElementById("painted").textContent = JSON.stringify(all); });
</script>"""
COMPARE = ROOT / "scripts" / "bench_compare"
TABLE = ROOT / "scripts" / "bench_table"
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


def without_later_spreads(results):
    """As results were when curves, builds and bakes had medians only, and no count of repetitions was kept."""
    older = json.loads(json.dumps(results))
    for spread in spreads_in(older):
        del spread["count"]
    for table, field in (("curves", "y_spread"), ("peers", "build_s_spread"), ("bake", "seconds_spread")):
        for row in older[table]:
            row.pop(field, None)
    return older


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


class Smoke(SmokeRun):
    """What the run found."""

    def test_results_fit_the_schema_that_is_shipped(self):
        schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
        self.assertEqual(list(violations(self.results, schema, schema)), [])
        broken = json.loads(json.dumps(self.results))
        broken["frames"][0]["us"]["median"] = "fast"
        del broken["machine"]["cpu"]
        self.assertEqual(len(list(violations(broken, schema, schema))), 2)

    def test_every_suite_has_rows_for_every_object(self):
        for table in ("peers", "works", "frames", "accuracy", "bake", "force", "budgets", "effects", "checks"):
            with self.subTest(table=table):
                self.assertLessEqual({"ball", "brick"}, {row["model"] for row in self.results[table]})
        self.assertEqual({row["work"] for row in self.results["frames"]},
                         {"touching", "far", "grasp", "costume", "scene"})
        self.assertEqual({row["shell_percent"] for row in self.results["accuracy"]}, {0.5, 3.0})
        sized = {(row["model"], row["peer"]) for row in self.results["peers"] if row["bytes"] > 0 and row["build_s"] > 0}
        for table in ("frames", "accuracy"):
            self.assertLessEqual({(row["model"], row["peer"]) for row in self.results[table] if row.get("work") != "scene"},
                                 sized, table)

    def test_every_peer_answers_within_the_error_it_states(self):
        self.assertTrue(all(check["holds"] for check in self.results["checks"]))
        checked = {check["peer"] for check in self.results["checks"]}
        self.assertLessEqual({row["peer"] for row in self.results["accuracy"]}, checked)
        self.assertLessEqual({"fcl-obb-all-contacts", "fcl-kdop18-all-contacts", "fcl-kdop18-first-contact",
                              "bullet-gimpact-all-contacts"}, checked)

    def test_checks_of_means_and_pairs_fail_for_wrong_answers(self):
        # The run itself swaps the sides of each peer's answers, and takes pairs of another pose: both must break.
        broken = {check["peer"]: check for check in self.results["checks"]
                  if check["claim"].startswith(("answers with the sides swapped break", "pairs of another pose break"))}
        for peer in ("bullet-hacd-16", "paper-100x200-layer2", "paper-25x50-layer3", "sqmap-layer3",
                     "bullet-gimpact-all-contacts"):
            self.assertGreater(broken[peer]["found"], broken[peer]["allowed"], peer)
        claims = [check["claim"] for check in self.results["checks"]]
        for claim, count in (("how far the mesh reaches out of what stands for it, percent of R_max", 2),
                             ("mean error against what stands for the mesh, percent of R_max", 2),
                             ("crossing pairs that are not told, touching, percent", 2),
                             ("pairs of another pose break it: crossing pairs that are not told, touching, percent", 2),
                             ("told pairs that are not near each other, touching, percent", 2)):
            self.assertEqual(claims.count(claim), count, claim)

    def test_every_method_of_the_scene_finds_what_the_exact_meshes_of_all_objects_say(self):
        scene = {row["peer"]: row for row in self.rows("frames", work="scene")}
        self.assertEqual(scene.keys(), {"sqmap-layer2", "sqmap-layer3", "grid-int16-128-simd-culled", "bricks-8bit-128-simd",
                                        "fcl-obb-all-contacts"})
        work = self.rows("works", work="scene")[0]
        self.assertTrue(work["model"].startswith("2 objects"))
        self.assertGreater(work["contacts_mean"], 0)
        for layer in (2, 3):
            self.assertGreaterEqual(scene[f"sqmap-layer{layer}"]["answers_mean"], 0.95 * work["contacts_mean"])
        for field in ("grid-int16-128-simd-culled", "bricks-8bit-128-simd"):
            self.assertAlmostEqual(scene[field]["answers_mean"], work["near_mean"], delta=1 + 0.02 * work["near_mean"],
                                   msg=field)
        self.assertGreater(scene["fcl-obb-all-contacts"]["answers_mean"], 0)
        claims = [check["claim"] for check in self.rows("checks", model=work["model"])]
        missed = "points inside an object of the scene that are missed, percent"
        self.assertEqual(sorted(claims), 2 * [missed] + 2 * ["the touched object left out breaks it: " + missed])

    def test_sheet_of_the_costume_drapes_and_trees_that_are_refitted_or_rebuilt_agree(self):
        for model in ("ball", "brick"):
            work = self.rows("works", model=model, work="costume")[0]
            self.assertGreater(work["contacts_mean"], 20)
            self.assertLessEqual(work["deepest_percent"], 0.5 + 1e-3)
            frame = {row["peer"]: row["answers_mean"] for row in self.rows("frames", model=model, work="costume")}
            self.assertEqual(frame["fcl-obb-all-contacts"], frame["fcl-obb-rebuilt-all-contacts"])
            for field in ("grid-int16-128-simd", "grid-int16-128-simd-culled", "bricks-8bit-128-simd"):
                self.assertAlmostEqual(frame[field], work["near_mean"], delta=1 + 0.03 * work["near_mean"], msg=field)
            self.assertGreaterEqual(frame["sqmap-layer3"], 0.95 * work["contacts_mean"])

    def test_every_effect_is_timed_beside_the_reaction(self):
        effects = {row["variant"] for row in self.rows("effects", model="ball")}
        self.assertLessEqual({f"scene, layer 3: {name}" for name in
                              ("contacts", "reaction", "reaction, friction", "reaction, smoothing",
                               "reaction, tracking", "reaction, texture", "reaction, torque",
                               "reaction, impact_zones", "reaction, force_limit", "reaction, slew_limit")}, effects)
        self.assertIn("Scene.UnusedEffectsRunNoInstruction", self.files["index.html"])

    def test_in_small_steps_a_tracked_force_jumps_no_more_than_its_bound(self):
        for model in ("ball", "brick"):
            row = self.rows("force", model=model, peer="sqmap-layer3-tracked, small steps")[0]
            plain = self.rows("force", model=model, peer="sqmap-layer3, small steps")[0]
            self.assertGreater(row["steps"], 300)
            # k (3 |step| + 1e-4 R_max) of a mean force of k 0.005 R_max, at steps of up to 1e-4 R_max.
            self.assertLess(row["worst_jump_percent"], 100 * (3e-4 + 1e-4) / 0.005 + 0.1)
            self.assertLessEqual(row["jumps_percent"], plain["jumps_percent"])

    def test_grids_answer_every_point_of_the_shells(self):
        for row in self.rows("accuracy"):
            if "128" in row["peer"] and not row["peer"].startswith("adf"):
                self.assertGreater(row["answered_inside_percent"], 99.9, row)
                self.assertGreater(row["answered_outside_percent"], 98, row)

    def test_error_of_a_grid_falls_with_its_spacing_and_that_of_exact_peers_is_none(self):
        for family in ("grid-float-{}-simd", "grid-int16-{}-simd", "bricks-8bit-{}-simd"):
            coarse, fine = (self.rows("accuracy", model="brick", shell_percent=3.0, peer=family.format(n))[0]
                            for n in (32, 128))
            self.assertLess(fine["mean_error_percent"], 0.5 * coarse["mean_error_percent"])
            self.assertLess(fine["normal_mean_deg"], coarse["normal_mean_deg"])
        for peer in ("embree-closest", "cgal-closest"):
            for row in self.rows("accuracy", peer=peer):
                self.assertLess(row["max_error_percent"], 1e-4)
                self.assertEqual(row["wrong_side_percent"], 0)
                self.assertLess(row["normal_mean_deg"], 0.5)

    def test_octree_of_a_smaller_bound_is_larger_and_closer_to_the_grid_it_was_made_from(self):
        for model in ("ball", "brick"):
            rows = [self.rows("accuracy", model=model, shell_percent=3.0, peer=f"adf-float-128-{bound}")[0]
                    for bound in (0.4, 0.05)]
            sizes = [self.rows("peers", model=model, peer=row["peer"])[0]["bytes"] for row in rows]
            grid = self.rows("accuracy", model=model, shell_percent=3.0, peer="grid-float-128-simd")[0]
            self.assertLess(sizes[0], sizes[1])
            self.assertLess(rows[1]["mean_error_percent"], rows[0]["mean_error_percent"])
            for row, bound in zip(rows, (0.4, 0.05)):
                self.assertLess(row["mean_error_percent"] - grid["mean_error_percent"], bound)
                self.assertGreater(row["answered_inside_percent"], 99.9)
                # Points within the bound of the rim of the band may be told to lie beyond it.
                self.assertGreater(row["answered_outside_percent"], 98 - 100 * bound / 3)
        self.assertLess(sizes[0], 0.25 * self.rows("peers", model="brick", peer="grid-float-128-simd")[0]["bytes"])

    def test_feet_are_right_on_a_sphere_and_in_a_box_few_are_wrong_but_more_of_the_papers_search(self):
        for row in self.rows("accuracy", peer="sqmap-layer2"):
            self.assertLessEqual(row["wrong_feet_percent"], {"ball": 0, "brick": 2}[row["model"]])
        ours, paper = (self.rows("accuracy", model="brick", peer=peer, shell_percent=3.0)[0]["wrong_feet_percent"]
                       for peer in ("sqmap-layer2", "paper-100x200-layer2"))
        self.assertGreater(paper, 2 * ours)
        coarse, fine = (self.rows("accuracy", model="ball", peer=f"paper-{n}x{2 * n}-layer2", shell_percent=3.0)[0]
                        for n in (50, 100))
        self.assertLess(fine["wrong_feet_percent"], 3)
        # The printed query measures to nodes, 1.6 % of R_max apart at the most.
        self.assertLess(fine["mean_error_percent"], 0.4)
        self.assertGreater(coarse["mean_error_percent"], fine["mean_error_percent"])
        for row in self.rows("accuracy", peer="embree-closest"):
            self.assertIsNone(row["wrong_feet_percent"])

    def test_first_contact_ends_a_frame_with_one(self):
        for tree in ("obb", "kdop18"):
            for work, expected in (("touching", 1), ("far", 0)):
                for row in self.rows("frames", peer=f"fcl-{tree}-first-contact", work=work):
                    self.assertEqual(row["answers_mean"], expected, row)
        for row in self.probe_frames("fcl-obb-all-contacts"):
            twin = self.rows("frames", peer="fcl-kdop18-all-contacts", model=row["model"], work=row["work"])[0]
            self.assertAlmostEqual(twin["answers_mean"], row["answers_mean"], delta=0.02 * row["answers_mean"])

    def test_scalar_vector_and_culled_grids_give_the_same_answers(self):
        for nodes in (64, 128):
            for row in self.probe_frames(f"grid-int16-{nodes}-simd"):
                for other in (f"grid-int16-{nodes}-simd-culled", f"grid-float-{nodes}-simd", f"grid-float-{nodes}-scalar"):
                    twin = self.rows("frames", peer=other, model=row["model"], work=row["work"])[0]
                    # Codes of 16 bits round: points on the rim of the band may fall to either side.
                    self.assertAlmostEqual(twin["answers_mean"], row["answers_mean"],
                                           delta=0 if "culled" in other else 1 + 0.01 * row["answers_mean"])

    def test_leaving_out_blocks_of_points_leaves_out_no_answer(self):
        for row in self.probe_frames("grid-float-128-simd"):
            if row["work"] == "grasp":
                self.assertGreater(row["answers_mean"], 10)
            for other, share in (("nanovdb-float-128", 0), ("openvdb-float-128", 0), ("nanovdb-8bit-128", 0.01),
                                 ("bricks-8bit-128-simd", 0.01)):  # codes of 8 bits round at the rim of the band
                twin = self.rows("frames", peer=other, model=row["model"], work=row["work"])[0]
                self.assertAlmostEqual(twin["answers_mean"], row["answers_mean"],
                                       delta=share * row["answers_mean"] + 0.5 * (share > 0), msg=other)
        for exact in ("embree-closest", "cgal-closest"):
            for row in self.rows("frames", peer=exact, work="touching"):
                work = self.rows("works", model=row["model"], work="touching")[0]
                self.assertAlmostEqual(row["answers_mean"], work["near_mean"], delta=0.5, msg=exact)

    def test_versions_of_the_rivals_are_told(self):
        for library in ("Bullet", "CGAL", "Embree", "FCL", "Highway", "NanoVDB", "OpenVDB"):
            self.assertRegex(self.results["machine"]["libraries"], library + r" \d+\.\d+")

    def test_poses_do_what_their_names_say(self):
        for row in self.results["works"]:
            with self.subTest(model=row["model"], work=row["work"]):
                self.assertEqual(row["contacts_mean"] > 0, row["work"] != "far")
                self.assertLess(row["deepest_percent"], 3)
                if row["work"] == "far":
                    self.assertEqual(row["near_mean"], 0)
                    self.assertGreater(row["nearest_percent"], 3)
                    self.assertLess(row["nearest_percent"], 7)  # no method can tell from the bounds alone
        for row in self.rows("frames", work="far"):
            if row["peer"] != "sqmap-layer1":  # all it knows are superquadrics
                self.assertEqual(row["answers_mean"], 0, row)
        for row in self.rows("frames", peer="embree-closest"):
            work = self.rows("works", model=row["model"], work=row["work"])[0]
            self.assertAlmostEqual(row["answers_mean"], work["near_mean"], delta=0.5)

    def test_every_time_has_ordered_quartiles_and_says_of_how_many_repetitions(self):
        for table, fields in (("frames", ("us", "ratio")), ("accuracy", ("ns",)), ("budgets", ("us",)), ("effects", ("us",))):
            for row in self.results[table]:
                for field in fields:
                    self.assertEqual(row[field]["count"], 3, row)
        for spread in spreads_in(self.results):
            self.assertTrue(0 < spread["lower"] <= spread["median"] <= spread["upper"], spread)

    def test_builds_and_bakes_are_repeated_and_say_how_often(self):
        for table, field in (("peers", "build_s"), ("bake", "seconds")):
            spreads = [row[f"{field}_spread"] for row in self.results[table]]
            self.assertEqual([spread["median"] for spread in spreads], [row[field] for row in self.results[table]])
            self.assertLessEqual({spread["count"] for spread in spreads}, {1, 2, 3})
            self.assertTrue(any(spread["lower"] < spread["upper"] for spread in spreads))
        # On any machine a tree of twelve triangles is short enough for all three.
        self.assertEqual(self.rows("peers", model="brick", peer="cgal-closest")[0]["build_s_spread"]["count"], 3)
        self.assertRegex(self.files["index.html"], r"Seconds of builds and bakes are medians of [\dto ]+ repetitions")

    def test_builds_count_what_they_share_with_others(self):
        build_s = {row["peer"]: row["build_s"] for row in self.rows("peers", model="ball")}
        field_s = self.rows("bake", model="ball", method="exact-field-128")[0]["seconds"]
        for peer in ("grid-int16-128-simd", "bricks-8bit-128-simd", "nanovdb-8bit-128", "openvdb-float-128",
                     "adf-float-128-0.4", "voxmap-pointshell-128"):
            self.assertGreater(build_s[peer], 0.5 * field_s, peer)  # alone they take a tenth of that

    def test_every_point_of_a_curve_of_times_has_a_spread_and_no_other(self):
        timed = {row["figure"] for row in self.results["curves"] if "y_spread" in row}
        self.assertEqual(timed, TIMED_FIGURES)
        for row in self.results["curves"]:
            if row["figure"] not in timed:
                continue
            self.assertEqual([spread["median"] for spread in row["y_spread"]], row["y"])
            counts = {spread["count"] for spread in row["y_spread"]}
            self.assertLessEqual(counts, {1, 2, 3} if row["figure"] == "objects-build" else {3}, row["curve"])
        # Repetitions of a time are never all the same.
        self.assertTrue(any(spread["lower"] < spread["upper"] for spread in spreads_in(self.rows("curves", figure="14a"))))

    def test_reference_has_ratio_one(self):
        for row in self.results["frames"]:
            if row["peer"] == "grid-int16-128-simd-culled":
                self.assertEqual(row["ratio"], {"median": 1, "lower": 1, "upper": 1, "count": 3})

    def test_force_over_facets_turns_less_when_shaded_and_least_on_the_map(self):
        for model in ("ball", "brick"):
            row = {row["peer"]: row for row in self.rows("force", model=model)}
            self.assertEqual(len({r["steps"] for r in row.values()}), 1)
            self.assertGreater(row["mesh-normals"]["steps"], 100)
        ball = {row["peer"]: row for row in self.rows("force", model="ball")}
        # 5120 facets, about 2.5 degrees from one to the next.
        self.assertGreater(ball["mesh-normals"]["worst_jump_percent"], 2)
        for steady in ("mesh-shaded", "sqmap-layer3", "sqmap-layer3-smoothed", "sqmap-layer3-tracked"):
            self.assertLess(ball[steady]["worst_jump_percent"], 0.8 * ball["mesh-normals"]["worst_jump_percent"], steady)
            self.assertEqual(ball[steady]["unanswered_percent"], 0, steady)

    def test_budgets_are_kept_and_the_finest_setting_is_the_one_before_they_are_not(self):
        for row in self.results["budgets"]:
            self.assertLessEqual(row["bytes"], row["budget_bytes"], row)
            self.assertGreater(row["answered_percent"], 50, row)
        grid = self.rows("budgets", model="ball", family="grid-int16-simd-culled")[0]
        nodes = int(grid["peer"].split("-")[2])  # the ball's box is a cube
        self.assertLess(2 * nodes ** 3, grid["budget_bytes"])
        self.assertGreater(2 * (nodes + 1) ** 3 + 200, grid["budget_bytes"])
        self.assertLessEqual({"sqmap-layer2", "sqmap-layer3", "bricks-8bit-simd", "paper-layer2"},
                             {row["family"] for row in self.rows("budgets", model="brick")})

    def test_voxels_tell_all_points_inside_and_few_more(self):
        for row in self.rows("frames", peer="voxmap-pointshell-128"):
            work = self.rows("works", model=row["model"], work=row["work"])[0]
            self.assertGreaterEqual(row["answers_mean"], work["contacts_mean"], row)
            self.assertLessEqual(row["answers_mean"], work["near_mean"] + work["contacts_mean"], row)
        size = self.rows("peers", model="ball", peer="voxmap-pointshell-128")[0]["bytes"]
        self.assertLess(size, 128 ** 3 / 4)  # what two bits a voxel would take without the tree

    def test_curves_are_as_long_in_x_as_in_y_and_every_figure_has_some(self):
        figures = {}
        for row in self.results["curves"]:
            self.assertEqual(len(row["x"]), len(row["y"]), row["figure"])
            self.assertGreater(len(row["x"]), 1)
            figures.setdefault(row["figure"], {})[row["curve"]] = row
        self.assertEqual(figures.keys(), {"13a", "13b", "13b-small", "14a", "14b", "14c", "objects", "objects-build",
                                          "probes"})
        pressed = figures["14b"]["sqmap-layer3"]["x"]
        self.assertEqual(pressed, sorted(pressed))
        self.assertEqual(pressed[0], 0)
        self.assertGreater(pressed[-1], 50)
        # A subdivision of the paper's layer 3 brings it closer to the surface.
        errors = figures["14c"]["paper's query, 25 x 50"]["x"]
        self.assertLess(errors[1], errors[0])
        self.assertEqual(figures["objects"]["sqmap-layer3"]["x"], [1280, 5120])
        self.assertEqual(figures["probes"]["sqmap-layer3"]["x"], [100, 1000])

    def test_memory_is_that_of_the_arrays(self):
        peer = {row["peer"]: row for row in self.rows("peers", model="ball")}
        nodes = 128 ** 3  # the ball's box is a cube
        self.assertAlmostEqual(peer["grid-float-128-simd"]["bytes"], 4 * nodes, delta=1000)
        self.assertAlmostEqual(peer["grid-int16-128-simd"]["bytes"], 2 * nodes, delta=1000)
        self.assertLess(peer["bricks-8bit-128-simd"]["bytes"], nodes)
        elephant = {row["method"]: row["bytes"] for row in self.rows("memory", model="Elephant", is_paper=True)}
        # The paper's maps: a float a node, and what a row and a column share.
        coarse, fine = (peer[f"paper-{n}x{2 * n}-layer2"]["bytes"] for n in (50, 100))
        self.assertAlmostEqual(fine / coarse, 4, delta=0.5)
        self.assertEqual(elephant, {"DF": 417e6, "ADF": 68e6, "SQ": 5.1e6})

    def test_every_picture_draws_its_values_and_stands_on_the_page(self):
        pictures = {name: text for name, text in self.files.items() if name.endswith(".svg")}
        self.assertGreaterEqual(len(pictures), 15)
        self.assertLessEqual({f"fig{name}.svg" for name in ("04", "10", "11-touching", "11-grasp", "11-costume", "12-first",
                                                            "12-all", "13a", "13b", "13b-small", "14a", "14b",
                                                            "14c")}, pictures.keys())
        for name, text in pictures.items():
            with self.subTest(name=name):
                ET.fromstring(text)
                shapes = re.findall(r"<(?:rect|circle)[^>]*(?:width|r)=\"([\d.]+)\"", text)
                points = re.findall(r"[ML][\d.]+ [\d.]+", text)
                images = re.findall(r"<image [^>]*href=\"data:image/png;base64,([\w+/]{100,})", text)
                self.assertGreater(len([s for s in shapes if float(s) > 0]) + len(points) + 5 * len(images), 5)
                self.assertNotRegex(re.sub(r"base64,[\w+/=]+", "", text), r"(?i)\bnan\b")
                self.assertNotIn("no values", text)
                self.assertIn(text, self.files["index.html"])

    def test_quartiles_of_a_curve_are_a_band_around_its_line(self):
        for figure in TIMED_FIGURES:
            text = self.files[f"fig{figure}.svg" if figure[0] == "1" else f"{figure}.svg"]
            bands = re.findall(r"<polygon points=\"([^\"]*)\"", text)
            self.assertEqual(len(bands), len(self.rows("curves", figure=figure)), figure)
            self.assertIn("band: quartiles", text)
        row = self.rows("curves", figure="objects")[0]
        band = re.search(r"<polygon points=\"([^\"]*)\"", self.files["objects.svg"]).group(1).split()
        line = re.findall(r"[ML]([\d.]+) ([\d.]+)", re.search(r"<path d=\"[^\"]*\"", self.files["objects.svg"]).group())
        self.assertEqual(len(band), 2 * len(row["x"]))
        for (x, y), low, high in zip(line, band, reversed(band)):
            self.assertEqual((x, x), (low.split(",")[0], high.split(",")[0]))
            self.assertTrue(float(low.split(",")[1]) >= float(y) >= float(high.split(",")[1]))  # y is downwards
        self.assertNotIn("<polygon", self.files["fig13a.svg"])

    def test_quartiles_of_a_time_are_a_line_through_its_disc(self):
        for name, count in (("time-ball-3.svg", len(self.rows("accuracy", model="ball", shell_percent=3.0))),
                            ("bake.svg", len([row for row in self.results["bake"] if row["method"] == "sqmap"])),
                            ("size-ball-3.svg", 0)):
            self.assertEqual(self.files[name].count("<line class=\"quartiles\""), count, name)
            self.assertEqual("line through a disc: quartiles" in self.files[name], count > 0, name)
        low, high = re.search(r"class=\"quartiles\".*? y1=\"([\d.]+)\" y2=\"([\d.]+)\"", self.files["bake.svg"]).groups()
        middle = re.search(r"cy=\"([\d.]+)\"", self.files["bake.svg"]).group(1)
        self.assertTrue(float(low) >= float(middle) >= float(high))  # y is downwards

    def test_page_stands_alone_and_says_in_words_where_sqmap_loses(self):
        page = self.files["index.html"]
        self.assertNotRegex(page, r"<script|src=|href=\"(?!data:)")
        self.assertIn("Near contact (+-0.5 % shell)", page)
        for words in ("The paper's query as printed", "Fig. 11a, touching: layers 1, 2 and 3 cost",
                      "Fig. 11b, costume: layers 1, 2 and 3 cost", "Fig. 13b in steps of about 0.005 %",
                      "Around the surface (+-3 % shell)", "are in none of its means", "of the points it answers",
                      "Table 1, all models", "Fig. 14c: the paper prints errors of 0.4 to 0.5 %", "32 KB an object: "):
            self.assertIn(words, page)
        for work in ("touching", "far", "grasp", "costume", "scene"):
            self.assertRegex(page, rf"Frames, {work}, against the fastest rival of each model \([\w-]+ on \d.*?\): layer 2 "
                                   r"takes [\d.]+ times as long and wins on \d of [12]; layer 3 takes [\d.]+ times")

    @unittest.skipUnless(CHROMIUM, "no Chromium here")
    def test_chromium_shows_the_page_without_an_error_and_every_figure_with_something_on_it(self):
        def dom_of(page, name):
            path = self.folder / name
            path.write_text(page, encoding="utf-8")
            done = subprocess.run(
                [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={self.folder}/profile",
                 "--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom", path.as_uri()],
                capture_output=True, text=True, timeout=120, check=True)
            return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]

        page = self.files["index.html"]
        self.assertEqual(dom_of(page, "page.html")[1], [])
        # What the check would see of an error, and of a blank figure.
        self.assertEqual(len(dom_of("<script>console.error('no')</script>", "broken.html")[1]), 1)
        blank = '<figure><svg xmlns="http://www.w3.org/2000/svg" width="10" height="10"></svg></figure>'
        dom, errors = dom_of(page.replace("</body>", blank + PAINT + "</body>"), "painted.html")
        self.assertEqual(errors, [])
        painted = json.loads(re.search(r'<pre id="painted">(.*?)</pre>', dom).group(1))
        self.assertEqual(len(painted), page.count("<figure>") + 1)
        self.assertEqual(painted.pop()["drawn"], 0)
        for figure in painted:
            self.assertGreater(figure["drawn"], 500)
            self.assertGreater(figure["colours"], 3)

    def test_csv_holds_the_numbers_of_the_json(self):
        table = list(csv.DictReader(self.files["results.csv"].splitlines()))
        rows = {(r["table"], r["model"], r["work"], r["peer"], r["quantity"]): r["value"] for r in table}
        row = self.rows("frames", model="ball", work="grasp", peer="cgal-closest")[0]
        self.assertEqual(float(rows["frames", "ball", "grasp", "cgal-closest", "us.median"]), row["us"]["median"])
        self.assertEqual(len({r["table"] for r in table}), 12)
        self.assertEqual(len(rows), len(table), "two numbers go by one name")
        budget = self.rows("budgets", model="brick", family="sqmap-layer3")[0]
        self.assertEqual(float(rows["budgets", "brick", "32768 bytes", "sqmap-layer3", "us.median"]),
                         budget["us"]["median"])
        curve = self.rows("curves", figure="probes", curve="sqmap-layer3")[0]
        self.assertEqual(float(rows["curves", curve["model"], "probes", "sqmap-layer3", "y_spread.1.upper"]),
                         curve["y_spread"][1]["upper"])

    def compare(self, *files):
        return subprocess.run([sys.executable, "-B", COMPARE, *files], capture_output=True, text=True, check=False)

    def test_compare_finds_a_slower_frame_and_only_that(self):
        before, after = self.folder / "a.json", self.folder / "b.json"
        steady = json.loads(self.files["results.json"])
        us = steady["frames"][0]["us"]  # as measured, its spread may be wider than what is added below
        us["lower"] = us["upper"] = us["median"]
        before.write_text(json.dumps(steady), encoding="utf-8")
        slower = json.loads(json.dumps(steady))
        for key in ("median", "lower", "upper"):
            slower["frames"][0]["us"][key] *= 10
        after.write_text(json.dumps(slower), encoding="utf-8")

        same, worse, better = self.compare(before, before), self.compare(before, after), self.compare(after, before)
        self.assertEqual((same.returncode, worse.returncode, better.returncode), (0, 1, 0))
        self.assertEqual(worse.stdout.count(" slower"), 1)
        self.assertIn("10.000", worse.stdout)
        self.assertEqual(better.stdout.count(" faster"), 1)
        self.assertEqual(self.compare(before, COMPARE).returncode, 4)
        slower = json.loads(json.dumps(steady))
        slower["budgets"][0]["mean_error_percent"] *= 2
        after.write_text(json.dumps(slower), encoding="utf-8")
        less_accurate = self.compare(before, after)
        self.assertEqual(less_accurate.returncode, 1)
        self.assertEqual(less_accurate.stdout.count(" worse"), 1)

    def test_compare_marks_curves_builds_and_bakes_only_where_their_spreads_part(self):
        before, after = self.folder / "a.json", self.folder / "b.json"
        steady = json.loads(self.files["results.json"])
        for spread in spreads_in(steady):
            spread["lower"], spread["upper"] = 0.8 * spread["median"], 1.25 * spread["median"]
        before.write_text(json.dumps(steady), encoding="utf-8")

        def marks(spreads_of, factor, count=3):
            changed = json.loads(json.dumps(steady))
            for spread in spreads_of(changed):
                spread.update({part: factor * spread[part] for part in ("lower", "median", "upper")}, count=count)
            after.write_text(json.dumps(changed), encoding="utf-8")
            done = self.compare(before, after)
            self.assertEqual(done.returncode, int(" slower" in done.stdout), done.stderr)
            return done.stdout.count(" slower"), done.stdout.count(" faster")

        def curve(figure):
            return lambda results: next(row for row in results["curves"] if row["figure"] == figure)["y_spread"]

        def build(results):
            return [results["peers"][0]["build_s_spread"]]

        for spreads_of in (curve("14a"), curve("objects-build"), build, lambda results: [results["bake"][0]["seconds_spread"]]):
            self.assertEqual([marks(spreads_of, factor) for factor in (1.5, 1.6, 1 / 1.6)], [(0, 0), (1, 0), (0, 1)])
        self.assertEqual([marks(curve("14c"), factor) for factor in (1.6, 1 / 1.6)], [(0, 1), (1, 0)])  # a rate
        self.assertEqual(marks(build, 10, count=1), (0, 0))  # timed once


class Draw(SmokeRun):
    """sqbench draw, on the results of the smoke run."""

    def drawn(self, results, *pictures):
        source, out = self.folder / "kept", self.folder / "drawn"
        source.mkdir(exist_ok=True)
        (source / "bench.json").write_text(results if isinstance(results, str) else json.dumps(results), encoding="utf-8")
        for name in pictures:
            (source / name).write_text(self.files[name], encoding="utf-8")
        shutil.rmtree(out, ignore_errors=True)
        done = run("sqbench", "draw", source / "bench.json", "-o", out)
        files = {path.name: path.read_text(encoding="utf-8") for path in out.iterdir()} if out.exists() else {}
        return done, files

    def page_of(self, results):
        done, files = self.drawn(results)
        self.assert_exit(done, 0)
        return files["index.html"]

    def test_files_are_those_of_the_run(self):
        done, files = self.drawn(self.files["results.json"], "fig04.svg", "fig10.svg")
        self.assert_exit(done, 0)
        self.assertEqual(files, {name: text for name, text in self.files.items() if name != "results.json"})

    def test_pictures_of_objects_that_are_missing_are_left_out_and_named(self):
        done, files = self.drawn(self.files["results.json"])
        self.assert_exit(done, 0)
        self.assertIn("fig04.svg: left out", done.stderr)
        self.assertEqual(self.files.keys() - files.keys(), {"results.json", "fig04.svg", "fig10.svg"})

    def test_what_is_no_result_is_refused(self):
        lacking = json.loads(self.files["results.json"])
        del lacking["frames"][0]["us"]["median"]
        for results, words in (("words", "no JSON"), ({"schema": "other"}, "sqmap.bench/1"), ({**lacking}, "median"),
                               ({**self.results, "models": 3}, "schema")):
            refused, files = self.drawn(results)
            self.assert_exit(refused, 4)
            self.assertIn(words, refused.stderr)
            self.assertEqual(files, {})

    def test_results_of_before_all_times_had_spreads_are_drawn_without_them(self):
        older = without_later_spreads(self.results)
        done, files = self.drawn(older)
        self.assert_exit(done, 0)
        self.assertNotIn("<polygon", files["index.html"])
        self.assertNotIn("Points of the curves of times", files["index.html"])
        self.assertNotRegex(files["results.csv"], r"\.count,|_spread")
        self.assertNotIn("Seconds of builds and bakes", files["index.html"])
        self.assertNotIn("quartiles", files["bake.svg"])
        self.assertEqual(files["fig14b.svg"].count("<path"), self.files["fig14b.svg"].count("<path"))

    def test_words_on_curves_follow_their_spreads(self):
        results = json.loads(self.files["results.json"])
        for row in results["curves"]:
            for index, spread in enumerate(row.get("y_spread", ())):
                width = 0.3 if index == 0 else 0.1
                spread["lower"], spread["upper"] = spread["median"], (1 + width) * spread["median"]
        words = re.search(r"Points of the curves of times are medians of [\dto ]+ repetitions\..*?</p>", self.page_of(results))
        self.assertIn("14a 10 and 30, ", words.group())

    def test_words_on_frames_follow_the_times(self):
        for factor, layer_3 in ((1e-6, "wins on 2 of 2"), (1e6, "wins on 0 of 2")):
            results = json.loads(self.files["results.json"])
            for row in results["frames"]:
                if row["peer"] == "sqmap-layer3":
                    row["us"]["median"] *= factor
            words = re.search(r"Frames, grasp, .*?\(geometric mean\)", self.page_of(results)).group()
            self.assertIn(layer_3, words.split("; layer 3")[1])

    def test_fastest_rival_is_named_whatever_it_is(self):
        results = json.loads(self.files["results.json"])
        for row in results["frames"]:
            if row["peer"] == "cgal-closest" and row["model"] == "ball":
                row["us"]["median"] = 1e-6
        self.assertRegex(self.page_of(results), r"Frames, far, against the fastest rival of each model \(.*?cgal-closest on 1")

    def test_target_is_told_to_hold_or_not_by_the_budgets(self):
        for error, frame, words in ((1e-9, 1, "It holds at all that were run."), (1, 1e-9, "It holds at all that were run."),
                                    (1e9, 1e9, "It does not hold at 32 KB.")):
            results = json.loads(self.files["results.json"])
            for row in results["budgets"]:
                if row["family"] == "sqmap-layer3":
                    row["mean_error_percent"] *= error
                    row["us"]["median"] *= frame
            self.assertIn(words, self.page_of(results))
        results["budgets"] = [row for row in results["budgets"] if row["model"] == "ball" or
                              not row["family"].startswith("sqmap")]
        page = self.page_of(results)
        self.assertIn("It does not hold at 32 KB.", page)
        self.assertIn("sqmap fits for 1 of 2 models only", page)

    def test_words_on_normals_name_the_three_closest_rivals_and_count_all(self):
        results = json.loads(self.files["results.json"])
        rivals = [row["peer"] for row in self.rows("accuracy", model="ball", shell_percent=3.0)
                  if not row["peer"].startswith("sqmap")]
        closest = sorted(rivals[:4])
        for row in results["accuracy"]:
            row["normal_mean_deg"] = 10 if row["peer"] == "sqmap-layer3" else 11
            if row["peer"] in closest:
                row["normal_mean_deg"] = 1 + closest.index(row["peer"])
        words = re.search(r"In the \+-3 % shell.*?Its normals (.*?)</p>", self.page_of(results)).group(1)
        self.assertEqual(words, f"are off by 10 degrees in the mean; those of 4 settings of rivals are closer, most of all "
                                f"{closest[0]} by 9, {closest[1]} by 8, {closest[2]} by 7 degrees.")
        for row in results["accuracy"]:
            row["normal_mean_deg"] = 10
        self.assertEqual(self.page_of(results).count("no rival's are closer"), 2)

    def test_trees_that_took_no_part_are_not_beaten(self):
        page = self.page_of(self.results)
        costume = re.search(r"Fig. 11b, costume: .*?</p>", page).group()
        self.assertNotIn("kdop", costume)
        self.assertIn("fcl-obb-rebuilt-all-contacts", costume)


class Table(SmokeRun):
    """scripts/bench_table, on the results of the smoke run."""

    def table(self, results, *arguments):
        path = self.folder / "bench.json"
        path.write_text(results if isinstance(results, str) else json.dumps(results), encoding="utf-8")
        return subprocess.run([sys.executable, "-B", TABLE, path, *arguments], capture_output=True, text=True, check=False)

    def test_cells_are_means_over_the_models(self):
        made = self.table(self.results)
        self.assertEqual(made.returncode, 0, made.stderr)
        lines = {line.split(" | ")[0].strip("| "): line.strip("| ").split(" | ") for line in made.stdout.splitlines()}
        cells = lines["**sqmap**, layer 3"]
        touching, far = (math.sqrt(math.prod(row["us"]["median"] for row in self.rows("frames", work=work, peer="sqmap-layer3")))
                         for work in ("touching", "far"))
        wrong = [row["wrong_side_percent"] for row in self.rows("accuracy", peer="sqmap-layer3", shell_percent=3.0)]
        self.assertAlmostEqual(float(cells[2]), touching, delta=0.006 * touching)
        self.assertAlmostEqual(float(cells[4]), far, delta=0.006 * far)
        self.assertAlmostEqual(float(cells[6].split()[0]), sum(wrong) / 2, delta=0.01)
        self.assertEqual(lines["closest triangle (Embree)"][6], "0")
        self.assertEqual(lines["OBB tree, all pairs (FCL)"][5:], ["-", "-", "-"])
        self.assertIn(self.results["command"], made.stdout)

    def test_another_time_changes_its_line_alone(self):
        changed = json.loads(self.files["results.json"])
        for row in changed["frames"]:
            if row["peer"] == "sqmap-layer3" and row["work"] == "grasp":
                row["us"]["median"] *= 3
        before, after = (self.table(results).stdout.splitlines() for results in (self.results, changed))
        differing = [line for line, other in zip(before, after) if line != other]
        self.assertEqual(len(differing), 1)
        self.assertIn("layer 3", differing[0])

    def test_update_replaces_what_stands_between_the_marks(self):
        page = self.folder / "page.md"
        page.write_text("before\n<!-- bench_table -->\nold\n<!-- /bench_table -->\nafter\n", encoding="utf-8")
        self.assertEqual(self.table(self.results, "--update", page).returncode, 0)
        shown = self.table(self.results).stdout
        self.assertEqual(page.read_text(encoding="utf-8"),
                         f"before\n<!-- bench_table -->\n{shown}<!-- /bench_table -->\nafter\n")

    def test_files_that_cannot_be_used_are_refused_and_left_alone(self):
        page = self.folder / "page.md"
        page.write_text("no marks", encoding="utf-8")
        for results, words in (("words", "no JSON"), ({"schema": "other"}, "sqmap.bench/1"),
                               ({**self.results, "frames": []}, "run sqbench with all suites"),
                               (self.results, "<!-- bench_table -->")):
            refused = self.table(results, "--update", page)
            self.assertEqual(refused.returncode, 4)
            self.assertIn(words, refused.stderr)
        self.assertEqual(page.read_text(encoding="utf-8"), "no marks")


class ReadmeTable(unittest.TestCase):
    """The numbers of the README are those of the results in the repository."""

    RESULTS = ROOT / "results" / "bench.json"

    def test_readme_holds_the_table_of_the_results(self):
        made = subprocess.run([sys.executable, "-B", TABLE, self.RESULTS], capture_output=True, text=True, check=True)
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        shown = readme.split("<!-- bench_table -->\n")[1].split("<!-- /bench_table -->")[0]
        self.assertEqual(shown, made.stdout)

    def test_results_are_a_whole_run_over_six_models_and_fit_the_schema(self):
        results = json.loads(self.RESULTS.read_text(encoding="utf-8"))
        schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
        self.assertEqual(list(violations(results, schema, schema)), [])
        self.assertEqual(len(results["models"]), 6)
        self.assertFalse(results["smoke"])
        self.assertTrue(all(check["holds"] for check in results["checks"]))
        self.assertTrue(all(results[table] for table in schema["properties"]
                            if schema["properties"][table].get("type") == "array"))


class Refusals(FolderTest):
    def test_bundle_of_another_mesh_is_refused(self):
        self.bake(sphere(2), "ball", *ROUGH)
        mesh = write_off(self.folder / "ball.off", box())
        result = run("sqbench", "run", "memory", "--smoke", "--meshes", mesh, "--bundles", self.folder, "--probe", mesh,
                     "-o", self.folder / "out")
        self.assert_exit(result, 2)
        self.assertIn("hashes", result.stderr)
        self.assertFalse((self.folder / "out").exists())

    def test_missing_files_and_unknown_suites_are_refused(self):
        mesh = write_off(self.folder / "ball.off", sphere(1))
        for arguments, code, words in (
                (("speed",), 2, "speed"),
                (("memory", "--meshes", self.folder / "none.off", "--probe", mesh), 3, "none"),
                (("memory", "--meshes", mesh, "--probe", self.folder / "none.off"), 3, "none.off"),
                (("memory", "--meshes", mesh, "--probe", mesh, "--bundles", self.folder), 3, "ball.h5")):
            with self.subTest(arguments=arguments):
                result = run("sqbench", "run", *arguments, "-o", self.folder / "out")
                self.assert_exit(result, code)
                self.assertIn(words, result.stderr)


if __name__ == "__main__":
    unittest.main()
