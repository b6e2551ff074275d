# SPDX-License-Identifier: Apache-2.0
"""`sqbake report`: one page, whole, true to its records, and pictures that show what the bundles hold."""
import base64
import json
import math
import re
import struct
import subprocess
import unittest
import zlib
from html.parser import HTMLParser

from support import NOBODY, FolderTest, ROUGH, box, run, sphere, write_off

VOID = {"meta", "img", "input", "br"}


class Page(HTMLParser):
    """Tables by id, pictures, links; notes whether every element is closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tables, self.images, self.references, self.problems, self.tags = [], {}, [], [], [], []
        self.table = self.cell = None
        self.feed(text)
        self.problems += [f"<{tag}> stays open" for tag in self.open]

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.tags.append(tag)
        self.references += [v for k, v in attrs.items() if k in ("src", "href", "data", "action")]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.table = self.tables.setdefault(attrs.get("id"), [])
        elif tag == "tr":
            self.table.append([])
        elif tag in ("td", "th"):
            self.cell = ""
        elif tag == "img":
            self.images.append((attrs["alt"], base64.b64decode(attrs["src"].split("base64,")[1])))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.problems.append(f"</{tag}> closes nothing")
        if tag in ("td", "th"):
            self.table[-1].append(self.cell)
            self.cell = None

    def handle_data(self, data):
        if self.cell is not None:
            self.cell += data


def rgba_rows(png):
    """Rows of (red, green, blue, alpha) of an 8-bit RGBA picture."""
    place, data = 8, b""
    while place < len(png):
        size, kind = struct.unpack(">I4s", png[place:place + 8])
        body = png[place + 8:place + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert (depth, color) == (8, 6), "an RGBA picture"
        elif kind == b"IDAT":
            data += body
        place += 12 + size
    raw, stride, rows, above = zlib.decompress(data), 4 * width, [], bytearray(4 * width)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = line[i - 4] if i >= 4 else 0, above[i], above[i - 4] if i >= 4 else 0
            paeth = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, paeth[2])[kind]) & 255
        rows.append([tuple(line[4 * x:4 * x + 4]) for x in range(width)])
        above = line
    return rows


def covered(rows, first, last):
    """Pixels, in fractions by opacity."""
    return sum(pixel[3] / 255 for row in rows for pixel in row[first:last])


class Report(FolderTest):
    def records(self, *meshes):
        for name, mesh in meshes:
            self.bake(mesh, name, *ROUGH)
        result = run("sqbake", "bake", *(self.folder / f"{name}.off" for name, _ in meshes), "--out-dir",
                     self.folder / "out", "--format", "ndjson", *ROUGH)
        self.assert_exit(result, 0)
        return [json.loads(line) for line in result.stdout.splitlines()]

    def page(self, records, *options):
        file = self.folder / "records.ndjson"
        file.write_text("".join(json.dumps(r) + "\n" for r in records), encoding="utf-8")
        result = run("sqbake", "report", file, "-o", self.folder / "page.html", *options)
        self.assert_exit(result, 0)
        return (self.folder / "page.html").read_text(encoding="utf-8")

    @staticmethod
    def record(name, outcome="ok", **more):
        record = {"schema": "sqmap.bake/3", "type": "asset", "input": name, "output": name + ".h5", "outcome": outcome,
                  "seconds": 1.0, "cached": False, "degradations": [], "warnings": []}
        return {**record, **more}

    def test_the_page_is_whole_and_needs_no_other_file(self):
        text = self.page(self.records(("ball", sphere(2)), ("box", box())))
        page = Page(text)
        self.assertEqual(page.problems, [])
        self.assertTrue(page.references)
        self.assertEqual([r for r in page.references if not r.startswith("data:")], [])
        self.assertNotRegex(text, r"https?://|@import|url\(")
        self.assertEqual(len(page.images), 2)

    def test_a_bake_writes_the_page_of_its_records_also_where_a_mesh_fails(self):
        models, page = self.folder / "models", self.folder / "page.html"
        models.mkdir()
        write_off(models / "ball.off", sphere(2))
        (models / "broken.off").write_text("OFF\n1 1 0\n", encoding="ascii")
        result = run("sqbake", "bake", models, *ROUGH, "--out-dir", self.folder / "out", "--report", page, "--format",
                     "ndjson")
        self.assert_exit(result, 1)
        again = run("sqbake", "report", "-", "-o", "-", "--title", f"sqbake bake {models}", input=result.stdout)
        self.assertEqual(page.read_text(encoding="utf-8"), again.stdout)
        self.assertEqual([row[:2] for row in Page(again.stdout).tables["all"][1:]],
                         [[str(models / "ball.off"), "ok"], [str(models / "broken.off"), "failed"]])
        self.assertEqual(len(Page(again.stdout).images), 1)

    def test_a_bake_refuses_a_report_it_could_not_write_before_it_begins(self):
        source = write_off(self.folder / "ball.off", sphere(1))
        for name, code, named in (("ball.off", 2, ".html"), ("none/page.html", 3, "no folder")):
            result = run("sqbake", "bake", source, *ROUGH, "-o", self.folder / "a.h5", "--report", self.folder / name)
            self.assert_exit(result, code)
            self.assertIn(named, result.stderr)
        self.assertEqual(self.files(), ["ball.off"])

    def test_a_folder_that_may_not_be_written_is_found_before_the_first_bake(self):
        source, kept, out = write_off(self.folder / "ball.off", sphere(1)), self.folder / "kept", self.folder / "out"
        for folder, mode in ((self.folder, 0o755), (kept, 0o755), (out, 0o777)):
            folder.mkdir(exist_ok=True)
            folder.chmod(mode)
        try:
            run("sqbake", "--version", **NOBODY).check_returncode()
        except (OSError, subprocess.CalledProcessError) as problem:
            self.skipTest(f"nobody may not start sqbake here: {problem}")
        for side in (("--report", kept / "page.html"), ("--depfile", kept / "a.d")):
            result = run("sqbake", "bake", source, *ROUGH, "-o", out / "a.h5", *side, **NOBODY)
            self.assert_exit(result, 3)
            self.assertIn(f"{kept}: Permission denied", result.stderr)
        self.assertEqual(list(out.iterdir()), [])
        self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", out / "a.h5", "--depfile", "/dev/null", **NOBODY), 0)

    def test_neither_a_page_nor_a_merge_takes_the_place_of_its_input_or_of_a_foreign_file(self):
        line = json.dumps(self.record("a.off", parts=1)) + "\n"
        for name in ("x.ndjson", "x.html", "notes.txt", "plan.ndjson"):
            (self.folder / name).write_text(line, encoding="ascii")
        (self.folder / "link.html").symlink_to("x.ndjson")
        before = {name: (self.folder / name).read_bytes() for name in self.files()}
        cases = [(("report", "x.ndjson", "-o", "x.ndjson"), 2, "an input"),
                 (("report", "x.html", "-o", "./x.html"), 2, "an input"),
                 (("report", "x.ndjson", "-o", "link.html"), 2, "an input"),
                 (("report", "x.ndjson", "-o", "notes.txt"), 2, ".html"),
                 (("report", "x.ndjson", "-o", "none/x.html"), 3, "no folder"),
                 (("merge", "x.ndjson", "-o", "x.ndjson"), 2, "an input"),
                 (("merge", "x.ndjson", "--plan", "plan.ndjson", "-o", "plan.ndjson"), 2, "an input"),
                 (("merge", "x.ndjson", "--report", "notes.txt"), 2, ".html"),
                 (("merge", "x.html", "--report", "x.html"), 2, "an input"),
                 (("merge", "x.ndjson", "-o", "new.html", "--report", "new.html"), 2, "the output"),
                 (("report", "x.ndjson", "-o", "x.html"), 3, "is not a page of sqbake"),
                 (("merge", "x.ndjson", "--report", "x.html"), 3, "is not a page of sqbake"),
                 (("merge", "x.ndjson", "-o", "plan.ndjson"), 3, "is not what a merge wrote"),
                 (("merge", "x.ndjson", "-o", "notes.txt"), 3, "is not what a merge wrote"),
                 (("merge", "x.ndjson", "-o", "none/x.ndjson"), 3, "no folder")]
        for arguments, code, named in cases:
            with self.subTest(arguments=arguments):
                result = run("sqbake", *arguments, cwd=self.folder)
                self.assert_exit(result, code)
                self.assertEqual(result.stdout, "")
                self.assertIn(named, result.stderr)
                self.assertEqual({name: (self.folder / name).read_bytes() for name in self.files()}, before)

    def test_a_merge_replaces_what_a_merge_wrote_an_empty_file_and_with_force_any(self):
        line = json.dumps(self.record("a.off", parts=1)) + "\n"
        summary = json.dumps({"schema": "sqmap.bake/3", "type": "summary"}) + "\n"
        (self.folder / "x.ndjson").write_text(line + summary, encoding="ascii")
        (self.folder / "all.ndjson").touch()
        merge = ("merge", "x.ndjson", "-o", "all.ndjson", "--report", "page.html")
        for more in ((), (), ("--force",)):
            self.assert_exit(run("sqbake", *merge, *more, cwd=self.folder), 0)
            self.assertIn(line.strip()[1:20], (self.folder / "all.ndjson").read_text(encoding="utf-8"))
            if more:
                continue
            self.assert_exit(run("sqbake", "report", "x.ndjson", "-o", "page.html", cwd=self.folder), 0)
        for name in ("all.ndjson", "page.html"):
            (self.folder / name).write_text(line, encoding="ascii")
            self.assert_exit(run("sqbake", *merge, cwd=self.folder), 3)
            self.assert_exit(run("sqbake", *merge, "--force", cwd=self.folder), 0)

    def test_names_from_strangers_stay_text(self):
        name = "<script>alert(1)</script>\"'&.off"
        error = {"status": 9, "id": "bake-failed", "exit_code": 5, "finding": "<b>&", "remedy": "</table>"}
        page = Page(self.page([self.record(name, "failed", error=error)]))
        self.assertEqual(page.problems, [])
        self.assertEqual(page.tags.count("script"), 1)
        self.assertEqual(page.tables["failures"][1], [name, "failed", "<b>&", "</table>"])

    def test_counts_every_outcome(self):
        outcomes = ["ok"] * 3 + ["degraded"] + ["failed"] * 2 + ["timeout", "memory", "crashed", "cancelled"]
        page = Page(self.page([self.record(f"{i}.off", outcome) for i, outcome in enumerate(outcomes)]))
        counted = {row[0]: int(row[1]) for row in page.tables["outcomes"][1:]}
        self.assertEqual(counted, {outcome: outcomes.count(outcome) for outcome in outcomes})
        self.assertEqual(len(page.tables["all"]), 1 + len(outcomes))
        self.assertEqual([row[0] for row in page.tables["failures"][1:]], [f"{i}.off" for i in range(3, 10)])

    def test_ranks_errors_and_times_and_leaves_out_what_has_none(self):
        errors = [0.3, None, 0.9, 0.1]
        records = [self.record(f"{i}.off", parts=1, bytes=1, r_max_m=2.0, depth_mean_percent=e, seconds=4.0 - i,
                               cached=i == 0) for i, e in enumerate(errors)]
        page = Page(self.page(records))
        self.assertEqual([row[0] for row in page.tables["worst"][1:]], ["2.off", "0.off", "3.off"])
        self.assertAlmostEqual(float(page.tables["worst"][1][2]), 0.9 / 100 * 2.0 * 1000)
        self.assertEqual([row[0] for row in page.tables["slowest"][1:]], ["1.off", "2.off", "3.off"])

    def test_pictures_show_the_size_of_what_the_map_holds(self):
        # A ball of radius 1 in a picture of the sphere around its superquadric, which a margin of 4 % surrounds.
        records = self.records(("ball", sphere(4)))
        rows = rgba_rows(Page(self.page(records)).images[0][1])
        side = len(rows)
        self.assertEqual({len(row) for row in rows}, {2 * side})
        shape, surface = covered(rows, 0, side), covered(rows, side, 2 * side)
        show = run("sqinfo", "show", records[0]["output"], "--format", "json")
        radius = json.loads(show.stdout)["sphere"]["radius_m"]
        self.assertAlmostEqual(surface / (math.pi * (side / 2 / 1.04 / radius) ** 2), 1, delta=0.02)
        self.assertGreaterEqual(shape, surface, "the superquadric encloses the mesh")

    def test_parts_have_colours_of_their_own(self):
        vertices, faces = sphere(2)
        two = vertices + [(x + 5, y, z) for x, y, z in vertices]
        faces2 = faces + [tuple(i + len(vertices) for i in f) for f in faces]
        records = self.records(("two", (two, faces2)), ("one", sphere(2)))
        hues = []
        for _, png in sorted(Page(self.page(records)).images):
            pixels = {max(range(3), key=p.__getitem__) for row in rgba_rows(png) for p in row if p[3] == 255}
            hues.append(len(pixels))
        self.assertEqual([record["parts"] for record in records[:2]], [2, 1])
        self.assertEqual(sorted(hues), [1, 2])

    def test_draws_no_more_than_asked_for_and_does_without_bundles(self):
        records = self.records(("ball", sphere(2)), ("box", box()))
        self.assertEqual(len(Page(self.page(records, "--pictures", "1")).images), 1)
        (self.folder / "out" / "box.h5").write_bytes(b"damaged")
        self.assertEqual(len(Page(self.page(records)).images), 1)

    def test_the_same_records_give_the_same_page(self):
        records = self.records(("ball", sphere(2)))
        self.assertEqual(self.page(records), self.page(records))

    def test_leaves_out_a_record_that_is_cut_off_and_says_so(self):
        lines = "".join(json.dumps(self.record(f"{i}.off")) + "\n" for i in range(3))
        result = run("sqbake", "report", "-", "-o", "-", input=lines[:-20])
        self.assert_exit(result, 0)
        self.assertEqual(len(Page(result.stdout).tables["all"]), 3)
        self.assertIn("cut off", result.stderr)

    def test_what_is_no_record_is_refused_with_its_line(self):
        lines = json.dumps(self.record("a.off")) + "\n\n{\"schema\": \"other/1\"}\n"
        result = run("sqbake", "report", "-", "-o", self.folder / "page.html", input=lines)
        self.assert_exit(result, 4)
        self.assertRegex(result.stderr, r"-:3: ")
        self.assertEqual(self.files(), [])


if __name__ == "__main__":
    unittest.main()
