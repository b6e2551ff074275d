# SPDX-License-Identifier: Apache-2.0
"""Folders: one bad mesh does not stop the others, names are mirrored, records are complete, bytes repeat."""
import json
import os
import subprocess
import unittest

from support import NOBODY, ROUGH, FolderTest, box, run, sphere, write_off


class Folder(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        (self.models / "deep").mkdir(parents=True)
        write_off(self.models / "ball.off", sphere(2))
        write_off(self.models / "box with space.off", box(1, 2, 3))
        (self.models / "broken.off").write_text("OFF\n1 1 0\n", encoding="ascii")
        (self.models / "readme.txt").write_text("not a mesh", encoding="ascii")
        (self.models / ".hidden.off").write_text("not a mesh", encoding="ascii")
        write_off(self.models / "deep" / "box.off", box())
        self.out = self.folder / "out"

    def bundles(self):
        return sorted(str(p.relative_to(self.out)) for p in self.out.rglob("*") if p.is_file())

    def test_one_bad_mesh_does_not_stop_the_others(self):
        result = run("sqbake", "bake", self.models, *ROUGH, "--out-dir", self.out)
        self.assert_exit(result, 1)
        self.assertEqual(self.bundles(), ["ball.h5", "box with space.h5"])
        self.assertIn("broken.off", result.stderr)
        self.assertIn("2 of 3 baked, 1 failed", result.stderr)
        for row in ("ball.off", "box with space.off", "broken.off"):
            self.assertRegex(result.stdout, rf"(?m)^{row} ")

    def test_recursive_mirrors_the_folders(self):
        (self.models / "broken.off").unlink()
        self.assert_exit(run("sqbake", "bake", self.models, *ROUGH, "--recursive", "--out-dir", self.out), 0)
        self.assertEqual(self.bundles(), ["ball.h5", "box with space.h5", "deep/box.h5"])

    def test_every_asset_has_a_record_in_order_and_a_summary_ends_them(self):
        result = run("sqbake", "bake", self.models, *ROUGH, "--out-dir", self.out, "--format", "ndjson", "-j2")
        records = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual([(r["type"], r.get("outcome")) for r in records],
                         [("asset", "ok"), ("asset", "ok"), ("asset", "failed"), ("summary", None)])
        ball, box_record, broken, summary = records
        self.assertEqual(ball["input"], str(self.models / "ball.off"))
        self.assertEqual(ball["bytes"], (self.out / "ball.h5").stat().st_size)
        self.assertRegex(ball["hash"], "^[0-9a-f]{32}$")
        self.assertNotEqual(ball["hash"], box_record["hash"])
        again = run("sqbake", "bake", self.models / "ball.off", *ROUGH, "-o", self.folder / "other.h5", "--format", "ndjson")
        self.assertEqual(json.loads(again.stdout.splitlines()[0])["hash"], ball["hash"], "equal bytes, equal hash")
        self.assertIn(ball["stopped_by"], ("target", "parts", "bytes", "gain"))
        self.assertAlmostEqual(ball["r_max_m"], 2, places=5)
        self.assertGreater(len(ball["stages"]), 2)
        self.assertEqual(len(ball["fits"]), ball["parts"])
        for fit in ball["fits"]:
            self.assertGreater(fit["iterations"], 0)
            self.assertIn(fit["stop"], ("gain", "no-descent", "iterations"))
        self.assertEqual((broken["error"]["id"], broken["error"]["exit_code"]), ("invalid-mesh", 4))
        self.assertEqual((summary["ok"], summary["failed"]), (2, 1))
        whole = json.loads(run("sqbake", "bake", self.models, *ROUGH, "--out-dir", self.out, "--format", "json").stdout)
        self.assertEqual([a["outcome"] for a in whole["assets"]], ["ok", "ok", "failed"])

    def test_quiet_prints_errors_only(self):
        result = run("sqbake", "bake", self.models, *ROUGH, "--out-dir", self.out, "-q")
        self.assert_exit(result, 1)
        self.assertEqual(result.stdout, "")
        self.assertEqual(result.stderr.count("\n"), 1)

    def refuse(self, named, *arguments, **options):
        for dry in ((), ("-n",)):
            result = run("sqbake", "bake", *arguments, "--out-dir", self.out, *dry, **options)
            self.assert_exit(result, 3)
            self.assertIn(named, result.stderr)
            self.assertEqual((result.stdout, result.stderr.count("\n")), ("", 1))
            self.assertFalse(self.out.exists())

    def test_links_to_nothing_and_pipes_are_found_before_the_first_bake(self):
        os.mkfifo(self.models / "pipe.off")
        self.refuse("pipe.off: not a regular file", self.models)
        self.refuse("pipe.off", f"{self.models}/*.off")
        (self.models / "pipe.off").unlink()
        (self.models / "dangling.off").symlink_to("nowhere.off")
        self.refuse("dangling.off", self.models)

    @unittest.skipUnless(os.getuid() == 0, "needs root, to become somebody else")
    def test_what_may_not_be_read_is_found_before_the_first_bake(self):
        locked = self.models / "deep" / "locked"
        locked.mkdir()
        write_off(locked / "c.off", box())
        secret = write_off(self.models / "secret.obj", box())
        self.folder.chmod(0o777)
        locked.chmod(0)
        try:
            run("sqbake", "--version", **NOBODY).check_returncode()
        except (OSError, subprocess.CalledProcessError) as problem:
            self.skipTest(f"nobody may not start sqbake here: {problem}")
        self.refuse(f"{locked}: Permission denied", self.models, "--recursive", **NOBODY)
        self.refuse(f"{locked}: Permission denied", f"{self.models}/**/*.off", **NOBODY)
        secret.chmod(0)
        self.refuse(f"{secret}: Permission denied", self.models, **NOBODY)
        locked.chmod(0o755)
        secret.chmod(0o644)
        self.assert_exit(run("sqbake", "bake", self.models, "--recursive", "--out-dir", self.out, "-n", **NOBODY), 0)

    def test_a_folder_without_meshes_is_refused(self):
        result = run("sqbake", "bake", self.models / "deep" / "..", self.out.parent / "none", "--out-dir", self.out)
        self.assert_exit(result, 3)
        (self.folder / "empty").mkdir()
        result = run("sqbake", "bake", self.folder / "empty", "--out-dir", self.out)
        self.assert_exit(result, 4)
        self.assertIn("empty", result.stderr)
        self.assertFalse(self.out.exists())

    def test_progress_in_a_log_is_one_line_a_stage_and_only_on_request(self):
        mesh = self.models / "ball.off"
        plain = run("sqbake", "bake", mesh, *ROUGH, "-o", self.folder / "a.h5", "--progress", "always")
        self.assertRegex(plain.stderr, r"(?m)^sqbake: .*ball\.off: read$")
        self.assertNotIn("\r", plain.stderr)
        self.assertEqual(run("sqbake", "bake", mesh, *ROUGH, "-o", self.folder / "b.h5").stderr, "")

    def test_progress_of_a_folder_in_a_log_counts(self):
        (self.models / "broken.off").unlink()
        log = run("sqbake", "bake", self.models, *ROUGH, "--recursive", "--out-dir", self.out, "--progress", "always",
                  "-j1").stderr
        for done, name in enumerate(("ball.off", "box with space.off", "deep/box.off")):
            self.assertRegex(log, rf"(?m)^sqbake: \[{done}/3\] {name}: read$")

    def test_verbose_adds_the_time_of_each_stage(self):
        result = run("sqbake", "bake", self.models / "ball.off", *ROUGH, "-o", self.folder / "a.h5", "-v")
        self.assertRegex(result.stdout, r"(?m)^  read +\d+\.\d+ s$")
        self.assertRegex(result.stdout, r"(?m)^  write +\d+\.\d+ s$")


class Repeat(FolderTest):
    def test_same_bytes_for_every_run_and_number_of_threads(self):
        bar = self.folder / "in"
        bar.mkdir()
        vertices, faces = sphere(3)
        write_off(bar / "bar.off", ([(4 * x, y, z * (1 + x * x)) for x, y, z in vertices], faces))
        write_off(bar / "box.off", box(1, 2, 3))
        # -j5 for two meshes: both at once, with two or three threads each
        for name, *options in (("first", "-j1"), ("again", "-j1"), ("many", "-j5")):
            self.assert_exit(run("sqbake", "bake", bar, "--max-error", "0.2%", "--out-dir", self.folder / name, *options), 0)
        for name in ("again", "many"):
            for bundle in ("bar.h5", "box.h5"):
                self.assertEqual((self.folder / name / bundle).read_bytes(),
                                 (self.folder / "first" / bundle).read_bytes(), f"{name}/{bundle}")

    def test_an_unchanged_bundle_keeps_its_time(self):
        bundle = self.bake(box(), "mesh", *ROUGH)
        os.utime(bundle, (1000000000, 1000000000))
        self.bake(box(), "mesh", *ROUGH)
        self.assertEqual(bundle.stat().st_mtime, 1000000000)


class Limits(FolderTest):
    def record(self, *options):
        vertices, faces = sphere(3)
        bent = [(3 * x, y + x * x, z) for x, y, z in vertices]
        source = write_off(self.folder / "bent.off", (bent, faces))
        result = run("sqbake", "bake", source, "-o", self.folder / "bent.h5", "--format", "ndjson", *options)
        self.assert_exit(result, 0)
        return json.loads(result.stdout.splitlines()[0])

    def test_max_parts_is_kept(self):
        self.assertEqual(self.record("--max-parts", "1", "--max-error", "0.02%")["parts"], 1)
        self.assertLessEqual(self.record("--max-parts", "3", "--max-error", "0.02%")["parts"], 3)

    def test_a_tighter_budget_gives_fewer_bytes(self):
        options = ("--max-parts", "2", "--max-error", "0.02%")
        self.assertLess(self.record("--max-bytes", "4K", *options)["bytes"],
                        self.record("--max-bytes", "200K", *options)["bytes"])

    def test_an_error_target_in_metres_is_a_share_of_the_largest_vertex_distance(self):
        vertices, faces = sphere(3)  # R_max is 2 cm, the diagonal of the box around it 3.5 cm
        source = write_off(self.folder / "ball.off", ([(x, y, abs(z) ** 0.5 * z) for x, y, z in vertices], faces))
        shown = {}
        for target in ("0.02mm", "0.1%", "0.0577%"):
            bundle = self.folder / f"{target}.h5"
            self.assert_exit(run("sqbake", "bake", source, "-o", bundle, "--unit", "cm", "--max-error", target), 0)
            shown[target] = json.loads(run("sqinfo", "show", bundle, "--format", "json").stdout)
        self.assertAlmostEqual(shown["0.02mm"]["r_max_m"], 0.02, places=6)
        self.assertEqual(shown["0.02mm"]["provenance"]["options"]["max_error_m"], 2e-5)
        self.assertEqual(shown["0.1%"]["provenance"]["options"]["max_error_m"], 0)
        self.assertEqual(shown["0.02mm"]["parts"], shown["0.1%"]["parts"])
        self.assertEqual(shown["0.02mm"]["errors"], shown["0.1%"]["errors"])
        self.assertNotEqual(shown["0.02mm"]["errors"], shown["0.0577%"]["errors"])  # what the diagonal would give

    def test_units_and_axes_scale_and_turn(self):
        vertices, faces = sphere(2)  # its axes end at vertices
        source = write_off(self.folder / "egg.off", ([(x / 2, y, 3 * z) for x, y, z in vertices], faces))
        sizes = {}
        for up in "xyz":
            bundle = self.folder / f"{up}.h5"
            self.assert_exit(run("sqbake", "bake", source, "-o", bundle, "--unit", "cm", "--up", up, *ROUGH), 0)
            sizes[up] = json.loads(run("sqinfo", "show", bundle, "--format", "json").stdout)
        for shown in sizes.values():
            self.assertAlmostEqual(shown["r_max_m"], 0.06, delta=0.001)
        heights = {"x": 1, "y": 2, "z": 6}  # what stands upright then
        for up, height in heights.items():
            points = "".join(f"0,0,{0.01 * height * s}\n" for s in (0.44, 0.53))
            answer = run("sqinfo", "query", self.folder / f"{up}.h5", "--points", "-", input=points)
            self.assertEqual([line.split(",")[3] for line in answer.stdout.splitlines()[1:]], ["1", "0"], up)


if __name__ == "__main__":
    unittest.main()
