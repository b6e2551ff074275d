# SPDX-License-Identifier: Apache-2.0
"""sqinfo show, validate, query and diff."""
import json
import math
import unittest

from support import FolderTest, box, run, sphere, write_off

RADIUS_M = 2.0


class Bundle(FolderTest):
    """Tests of one baked sphere. A test that damages it works on its own copy, as every test has one."""

    content = None

    def setUp(self):
        super().setUp()
        if Bundle.content is None:
            Bundle.content = self.bake(sphere(4, RADIUS_M), "ball").read_bytes()
        self.bundle = self.folder / "ball.h5"
        self.bundle.write_bytes(Bundle.content)

    def query(self, text, *options):
        result = run("sqinfo", "query", self.bundle, "--points", "-", *options, input=text)
        self.assert_exit(result, 0)
        header, *lines = result.stdout.splitlines()
        self.assertEqual(header, "x,y,z,inside,signed_distance,nx,ny,nz,part,layer")
        return [dict(zip(header.split(","), line.split(","))) for line in lines]


class Certainty(Bundle):
    def test_is_told_of_a_conservative_bundle(self):
        self.bundle = self.bake(sphere(4, RADIUS_M), "sure", "--conservative", "on")
        text = "\n".join(f"{x},0,0" for x in (0.5, 0.98 * RADIUS_M, RADIUS_M, 3 * RADIUS_M, -1))
        result = run("sqinfo", "query", self.bundle, "--points", "-", "--certainty", input=text)
        self.assert_exit(result, 0)
        header, *lines = result.stdout.splitlines()
        self.assertEqual(header, "x,y,z,inside,signed_distance,nx,ny,nz,part,layer,certainty")
        self.assertEqual([line.split(",")[-1] for line in lines],
                         ["inside", "inside", "unsure", "outside", "inside"])
        shown = json.loads(run("sqinfo", "show", self.bundle, "--format", "json").stdout)
        self.assertGreater(shown["bounds"]["surely_inside_percent"], 85)
        self.assertLess(shown["bounds"]["tolerance_m"], 1e-5 * RADIUS_M)
        self.assertIn("surely inside", run("sqinfo", "show", self.bundle).stdout)
        self.assert_exit(run("sqinfo", "validate", self.bundle, "--level", "full"), 0)
        # Bounds are all that the option adds.
        plain = self.bake(sphere(4, RADIUS_M), "plain")
        self.assertNotIn("bounds", json.loads(run("sqinfo", "show", plain, "--format", "json").stdout))
        self.assertEqual(run("sqinfo", "query", plain, "--points", "-", input=text).stdout,
                         run("sqinfo", "query", self.bundle, "--points", "-", input=text).stdout)
        differ = run("sqinfo", "diff", self.bundle, plain)
        self.assert_exit(differ, 7)
        self.assertIn("bound", differ.stdout)
        self.assertNotIn("map", differ.stdout)

    def test_needs_bounds(self):
        result = run("sqinfo", "query", self.bundle, "--points", "-", "--certainty", input="0,0,0")
        self.assert_exit(result, 4)
        self.assertIn("--conservative on", result.stderr)
        self.assertEqual(result.stdout, "")

    def test_needs_a_closed_mesh(self):
        vertices, faces = sphere(2)
        mesh = write_off(self.folder / "open.off", (vertices, faces[1:]))
        result = run("sqbake", "bake", mesh, "-o", self.folder / "open.h5", "--conservative", "on",
                     "--repair", "safe")
        self.assert_exit(result, 4)
        self.assertIn("3 open edges", result.stderr)


class Show(Bundle):
    def test_tells_the_sphere_from_its_bundle(self):
        shown = json.loads(run("sqinfo", "show", self.bundle, "--format", "json").stdout)
        self.assertEqual(shown["schema"], "sqmap.show/1")
        self.assertEqual(shown["file_bytes"], self.bundle.stat().st_size)
        self.assertEqual(shown["mesh"]["faces"], 5120)
        self.assertEqual(shown["provenance"]["source_name"], "ball.off")
        self.assertAlmostEqual(shown["r_max_m"], 2 * RADIUS_M, places=6)
        (part,) = shown["parts"]
        for axis_m in part["semi_axes_m"]:
            self.assertAlmostEqual(axis_m, RADIUS_M, delta=0.02 * RADIUS_M)
        self.assertAlmostEqual(part["superquadric_volume_m3"], 4 / 3 * math.pi * RADIUS_M ** 3, delta=0.5)
        self.assertEqual(part["map"]["misses"], 0)
        self.assertEqual(part["map"]["hits"], part["map"]["rows"] * part["map"]["cols"])
        stored = sum(d["stored_bytes"] for d in shown["datasets"])
        self.assertTrue(0 < stored < shown["file_bytes"])
        self.assertTrue(any(row["layer"] == 3 for row in shown["errors"]))

    def test_text_has_a_row_for_each_part_and_dataset(self):
        text = run("sqinfo", "show", self.bundle).stdout
        self.assertRegex(text, r"(?m)^   0 +0 whole ")
        self.assertIn("/maps/code", text)
        self.assertIn("ball.off", text)

    def test_what_is_no_bundle_is_refused_by_every_command(self):
        foreign = write_off(self.folder / "mesh.h5", box())
        for name, code in ((foreign, 4), (self.folder / "none.h5", 3), (self.folder, 3)):
            for arguments in (("show", name), ("validate", name), ("query", name, "--points", "-"),
                              ("export", name, "--seg", self.folder / "x.seg"), ("diff", self.bundle, name)):
                with self.subTest(arguments=arguments):
                    result = run("sqinfo", *arguments)
                    self.assert_exit(result, code)
                    self.assertIn(str(name), result.stderr)
                    self.assertEqual(result.stdout, "")


class Validate(Bundle):
    def test_a_fresh_bundle_is_valid(self):
        for level in ("quick", "full"):
            result = run("sqinfo", "validate", self.bundle, "--level", level)
            self.assert_exit(result, 0)
            self.assertEqual(result.stdout, f"{self.bundle}: valid\n")

    def test_any_changed_byte_is_found(self):
        content = self.bundle.read_bytes()
        for place in range(0, len(content), len(content) // 20):
            damaged = bytearray(content)
            damaged[place] ^= 0x10
            self.bundle.write_bytes(damaged)
            result = run("sqinfo", "validate", self.bundle, "--format", "json")
            self.assertIn(result.returncode, (4, 6), f"byte {place}: {result.stderr}")
            if result.returncode == 4:
                report = json.loads(result.stdout)
                self.assertFalse(report["valid"])
                self.assertEqual(len(report["findings"]), 1)


class Query(Bundle):
    def test_distance_and_normal_are_those_of_the_sphere(self):
        directions = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (0.6, 0.8, 0), (2 / 7, -3 / 7, 6 / 7)]
        points = [tuple(x * RADIUS_M * share for x in d) for d in directions for share in (0.9, 0.97)]
        for layer in ("auto", "2", "3"):
            answers = self.query("".join(f"{x},{y},{z}\n" for x, y, z in points), "--layer", layer)
            self.assertEqual(len(answers), len(points))
            for point, answer in zip(points, answers):
                distance_m = math.hypot(*point) - RADIUS_M
                self.assertEqual(answer["inside"], "1")
                self.assertAlmostEqual(float(answer["signed_distance"]), distance_m, delta=0.01 * RADIUS_M)
                cosine = sum(p * float(answer[n]) for p, n in zip(point, ("nx", "ny", "nz"))) / math.hypot(*point)
                self.assertGreater(cosine, 0.99)
                self.assertEqual(answer["part"], "0")
                self.assertIn(answer["layer"], ("2", "3") if layer == "auto" else (layer,))

    def test_far_away_is_outside_with_neither_distance_nor_part(self):
        (answer,) = self.query("100,0,0\n")
        self.assertEqual((answer["inside"], answer["signed_distance"], answer["part"], answer["nx"]),
                         ("0", "outside", "", ""))

    def test_layer_1_knows_inside_but_no_distance(self):
        inside, outside = self.query("0,0,0\n0,0,2.5\n", "--layer", "1")
        self.assertEqual((inside["inside"], inside["signed_distance"], inside["part"]), ("1", "", "0"))
        self.assertEqual((outside["inside"], outside["signed_distance"]), ("0", "outside"))

    def test_header_blank_lines_blanks_and_crlf_are_read(self):
        answers = self.query("x,y,z\r\n\r\n 0 , 0,+1e0 \r\n0,0,1.5")
        self.assertEqual([a["z"] for a in answers], ["1", "1.5"])

    def test_no_points_give_a_header_only(self):
        self.assertEqual(self.query(""), [])

    def test_a_malformed_line_is_named_and_nothing_is_printed(self):
        for text, line in (("0,0,0\n1,2\n", 2), ("x,y,z\n0,0,0\n\n1,2,3,4\n", 4), ("0,0,0\na,b,c\n", 2),
                           ("0,0,nan\n", 1), ("0,0,inf\n", 1), ("0,0,1e99\n", 1), ("1;2;3\n", 1), ("0,0,0 0\n", 1)):
            with self.subTest(text=text):
                result = run("sqinfo", "query", self.bundle, "--points", "-", input=text)
                self.assert_exit(result, 4)
                self.assertIn(f"line {line}:", result.stderr)
                self.assertEqual(result.stdout, "")

    def test_a_missing_points_file_is_a_file_error(self):
        result = run("sqinfo", "query", self.bundle, "--points", self.folder / "none.csv")
        self.assert_exit(result, 3)
        self.assertIn("none.csv", result.stderr)

    def test_results_that_cannot_be_printed_are_an_error(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            result = run("sqinfo", "show", self.bundle, stdout=full, stderr=-1)
            self.assertEqual(result.returncode, 3)


class Diff(Bundle):
    def test_a_bundle_equals_its_copy(self):
        copy = self.folder / "copy.h5"
        copy.write_bytes(self.bundle.read_bytes())
        result = run("sqinfo", "diff", self.bundle, copy)
        self.assert_exit(result, 0)
        self.assertEqual(result.stdout, "")

    def test_another_object_differs(self):
        other = self.bake(box(1, 2, 3), "box")
        result = run("sqinfo", "diff", self.bundle, other, "--tolerance", "0.01")
        self.assert_exit(result, 7)
        self.assertIn("R_max_m: ", result.stdout)

    def test_a_name_alone_differs_in_provenance_only(self):
        other = self.bake(sphere(4, RADIUS_M), "globe")
        result = run("sqinfo", "diff", self.bundle, other)
        self.assert_exit(result, 7)
        self.assertEqual(result.stdout, "provenance source name: ball.off -> globe.off\n")
        self.assert_exit(run("sqinfo", "diff", self.bundle, other, "--ignore-provenance"), 0)

    def test_tolerance_decides_on_a_small_change_of_size(self):
        other = self.bake(sphere(4, RADIUS_M * 1.000001), "ball2")
        report = json.loads(run("sqinfo", "diff", self.bundle, other, "--ignore-provenance", "--format", "json").stdout)
        self.assertFalse(report["equal"])
        self.assertTrue(any(d["where"] == "R_max_m" for d in report["differences"]))
        result = run("sqinfo", "diff", self.bundle, other, "--ignore-provenance", "--tolerance", "1e-7")
        self.assert_exit(result, 7)
        self.assertRegex(result.stdout, r"(?m)^R_max_m: ")
        result = run("sqinfo", "diff", self.bundle, other, "--ignore-provenance", "--tolerance", "1")
        self.assertNotIn("R_max_m", result.stdout)


if __name__ == "__main__":
    unittest.main()
