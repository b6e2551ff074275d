# SPDX-License-Identifier: Apache-2.0
"""sqbench: every suite runs, every answer is as close to the truth as its method states, and bad input is refused. No
test looks at a time.
"""
import json
import unittest

from bench_support import SCHEMA, TIMED_FIGURES, SmokeRun, spreads_in, violations
from support import ROUGH, FolderTest, box, run, sphere, write_off



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
