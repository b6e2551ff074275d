# SPDX-License-Identifier: Apache-2.0
"""What sqbench and its scripts make of results: figures, the page, tables and comparisons. No test looks at a time."""
import csv
import json
import math
import re
import shutil
import subprocess
import sys
import unittest
import xml.etree.ElementTree as ET

from bench_support import ROOT, SCHEMA, TIMED_FIGURES, SmokeRun, spreads_in, violations
from support import run

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


def without_later_spreads(results):
    """As results were when curves, builds and bakes had medians only, and no count of repetitions was kept."""
    older = json.loads(json.dumps(results))
    for spread in spreads_in(older):
        del spread["count"]
    for table, field in (("curves", "y_spread"), ("peers", "build_s_spread"), ("bake", "seconds_spread")):
        for row in older[table]:
            row.pop(field, None)
    return older


class Report(SmokeRun):
    """What the run wrote down."""

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


if __name__ == "__main__":
    unittest.main()
