# SPDX-License-Identifier: Apache-2.0
"""Several machines: shards cover the run once, a merge tells what is missing, and the result is that of one machine.

Slurm itself is played by a stand-in for sbatch that runs the tasks one after the other; tests/slurm has the real one.
"""
import json
import os
import subprocess
import unittest
from pathlib import Path

from support import BIN, FolderTest, ROUGH, TIMEOUT_S, run, sphere, write_off

SLURM = Path(os.environ["SQMAP_SOURCE_DIR"]) / "scripts" / "slurm"

# sbatch [--parsable] [--array=1-N] [--dependency=...] [--output=FILE] SCRIPT
STAND_IN = """#!/bin/sh
array='' out=/dev/null
for argument; do
  case $argument in
    --array=1-*) array=${argument#--array=1-} ;;
    --output=*) out=${argument#--output=} ;;
  esac
  script=$argument
done
if [ -z "$array" ]; then sh "$script" > "$out" 2>&1; echo "merge ended with $?"; exit 0; fi
export SLURM_ARRAY_TASK_COUNT=$array SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_STEP=1 SLURM_ARRAY_TASK_ID=1
while [ "$SLURM_ARRAY_TASK_ID" -le "$array" ]; do
  [ "$SLURM_ARRAY_TASK_ID" = "$LOST_TASK" ] || sh "$script" > /dev/null 2>&1
  SLURM_ARRAY_TASK_ID=$((SLURM_ARRAY_TASK_ID + 1))
done
echo 17
"""


class Shards(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        (self.models / "below").mkdir(parents=True)
        for k in range(5):
            write_off(self.models / ("below" if k % 2 else "") / f"m{k}.off", sphere(1 + k % 2, 1 + k))

    def bundles(self, folder):
        return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*.h5")}

    def bake(self, out, *options, **more):
        result = run("sqbake", "bake", self.models, "--recursive", "--out-dir", self.folder / out, "--no-cache",
                     "--format", "ndjson", *ROUGH, *options, **more)
        self.assert_exit(result, 0)
        return [r["input"] for r in map(json.loads, result.stdout.splitlines()) if r["type"] == "asset"]

    def test_shards_cover_every_mesh_once_and_are_those_of_the_plan(self):
        plan = run("sqbake", "plan", self.models, "--recursive", "--out-dir", self.folder / "a", "--shards", "3",
                   "--format", "ndjson")
        planned = {}
        for record in map(json.loads, plan.stdout.splitlines()):
            planned.setdefault(record["shard"], []).append(record["input"])
        shards = [self.bake("a", "--shard", f"{k}/3") for k in (1, 2, 3)]
        self.assertEqual(shards, [planned[k] for k in (1, 2, 3)])
        everything = sorted(str(p) for p in self.models.rglob("*.off"))
        self.assertEqual(sorted(sum(shards, [])), everything)
        self.assertEqual(self.bake("b"), [str(p) for p in sorted(Path(e) for e in everything)])
        self.assertEqual(self.bundles(self.folder / "a"), self.bundles(self.folder / "b"))

    def test_what_meshes_took_decides_the_shards_and_not_their_size(self):
        where = (self.models, "--recursive", "--out-dir", self.folder / "a")
        shown = run("sqbake", "bake", *where, *ROUGH, "--format", "ndjson", "--cache", self.folder / "cache").stdout
        slow = str(self.models / "m0.off")  # of the smallest files
        records = self.folder / "records.ndjson"
        records.write_text("".join(json.dumps({**r, "seconds": 1000.0 if r.get("input") == slow else 1.0}) + "\n"
                                   for r in map(json.loads, shown.splitlines())), encoding="utf-8")
        plan = run("sqbake", "plan", *where, "--shards", "2", "--costs", records, "--format", "ndjson").stdout
        shards = {1: [], 2: []}
        for asset in map(json.loads, plan.splitlines()):
            shards[asset["shard"]].append(asset["input"])
        self.assertEqual(shards[1], [slow])
        for k in (1, 2):
            self.assertEqual(self.bake("b", "--shard", f"{k}/2", "--costs", records), shards[k])
        alone = run("sqbake", "bake", *where, "--costs", records)
        self.assert_exit(alone, 2)
        self.assertIn("--shard", alone.stderr)
        missing = run("sqbake", "plan", *where, "--costs", self.folder / "none")
        self.assert_exit(missing, 3)
        again = run("sqbake", "bake", *where, *ROUGH, "--format", "ndjson", "--cache", self.folder / "cache").stdout
        records.write_text(again, encoding="utf-8")  # nothing was baked, so it tells nothing
        result = run("sqbake", "plan", *where, "--costs", records)
        self.assert_exit(result, 0)
        self.assertIn("tells of no bake", result.stderr)

    def test_score_shards_ranks_costs_and_adds_up_the_shards(self):
        flat, meshes = self.folder / "flat", {}
        flat.mkdir()
        for subdivisions in range(4):
            name = f"s{subdivisions}.off"
            meshes[name] = write_off(flat / name, sphere(subdivisions)).stat().st_size
        for exchange, correlation in ((False, "1.00"), (True, "-1.00")):
            seconds = dict(zip(sorted(meshes, key=meshes.get, reverse=exchange), (1, 2, 3, 10)))
            times = self.folder / "times.tsv"
            times.write_text("".join(f"{s}\t{name}\n" for name, s in seconds.items()), encoding="utf-8")
            result = subprocess.run([SLURM.parent / "score_shards", flat, "--times", times, "--bin", BIN, "--", "--up", "y"],
                                    capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(f"4 meshes, 16.0 processor s, the slowest 10.0 s; rank correlation of cost and seconds "
                          f"{correlation}", result.stdout)
            two, three = (line.split() for line in result.stdout.splitlines()[2:4])
            self.assertEqual((two[0], two[-1]), ("2", "1.25"), "10 s in one shard, 6 s in the other: 10 over 8")
            self.assertEqual((three[0], three[-1]), ("3", "1.88"))

    def test_a_shard_that_is_none_is_refused_before_anything_is_written(self):
        for shard in ("0/3", "4/3", "x", "auto"):
            result = run("sqbake", "bake", self.models, "--recursive", "--out-dir", self.folder / "out", "--shard", shard)
            self.assert_exit(result, 2)
        self.assertFalse((self.folder / "out").exists())

    def test_a_task_of_an_array_bakes_its_share_of_what_was_searched_for_and_says_so(self):
        array = {**os.environ, "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_ARRAY_TASK_MIN": "1", "SLURM_ARRAY_TASK_STEP": "1"}
        shards = [self.bake("a", env={**array, "SLURM_ARRAY_TASK_ID": str(k)}) for k in (1, 2, 3)]
        self.assertEqual(shards, [self.bake("b", "--shard", f"{k}/3") for k in (1, 2, 3)])
        array["SLURM_ARRAY_TASK_ID"] = "2"
        self.assertEqual(len(self.bake("c", "--shard", "1/1", env=array)), 5)
        named = [self.models / "m0.off", self.models / "m2.off"]
        for inputs in (named[:1], named):  # who names a mesh has dealt the meshes out
            result = run("sqbake", "bake", *inputs, "--out-dir", self.folder / "d", "-n", env=array)
            self.assertEqual((len(result.stdout.splitlines()), result.stderr), (len(inputs), ""))
        (self.folder / "list").write_text("\n".join(map(str, self.models.rglob("*.off"))), encoding="utf-8")
        result = run("sqbake", "bake", f"@{self.folder}/list", "--out-dir", self.folder / "d", "-n", "-q", env=array)
        self.assertEqual(len(result.stdout.splitlines()), len(shards[1]))
        self.assertRegex(result.stderr, rf"bakes --shard 2/3, {len(shards[1])} of 5 meshes; --shard 1/1 bakes all")
        array["SLURM_ARRAY_TASK_ID"] = "9"  # --array=1,5,9
        self.assert_exit(run("sqbake", "bake", self.models, "--out-dir", self.folder / "d", "-n", env=array), 2)

    def merge(self, *arguments):
        result = run("sqbake", "merge", *arguments, cwd=self.folder)
        return result.returncode, result.stderr, result.stdout

    def test_a_merge_of_nothing_or_of_a_run_that_was_cut_short_is_not_complete(self):
        whole = run("sqbake", "bake", self.models, "--out-dir", self.folder / "out", "--format", "ndjson", *ROUGH).stdout
        lines = whole.splitlines(keepends=True)
        for name, text, code, named in (("whole", whole, 0, ""), ("empty", "", 4, "no record of an asset in empty"),
                                        ("summary", lines[-1], 4, "no record of an asset"),
                                        ("cut", "".join(lines[:-1]), 1, "cut: has no summary"),
                                        ("torn", whole[:-9], 1, "torn: has no summary")):
            with self.subTest(name):
                (self.folder / name).write_text(text, encoding="utf-8")
                answer = self.merge(name)
                self.assertEqual(answer[0], code, answer)
                self.assertIn(named, answer[1])
        self.assertEqual(json.loads(self.merge("cut")[2].splitlines()[-1])["unfinished"], ["cut"])
        plan = run("sqbake", "plan", self.models, "--out-dir", self.folder / "out", "--format", "ndjson").stdout
        (self.folder / "plan").write_text(plan, encoding="utf-8")
        self.assertEqual(self.merge("cut", "--plan", "plan")[:2], (0, ""), "the plan tells that all is there")
        self.assertEqual(self.merge("whole", "--plan", "empty")[0], 4)

    def test_names_that_differ_in_bytes_that_are_no_utf8_stay_apart(self):
        models, options = self.folder / "few", ("--out-dir", self.folder / "out", "--format", "ndjson")
        models.mkdir()
        for number, name in enumerate((b"n\xfe.off", b"n\xff.off", b"n\xef\xbf\xbd.off", "n\u65e5\U0001d11e.off".encode())):
            write_off(models / os.fsdecode(name), sphere(0, 1 + number))
        bake = run("sqbake", "bake", models, *options, *ROUGH)
        plan = run("sqbake", "plan", models, *options, "--shards", "2").stdout
        (self.folder / "records").write_text(bake.stdout, encoding="utf-8")
        (self.folder / "plan").write_text(plan, encoding="utf-8")
        code, messages, merged = self.merge("records", "records", "--plan", "plan")
        self.assertEqual((code, messages), (0, ""))
        *assets, summary = map(json.loads, merged.splitlines())
        names = {os.path.basename(asset["input"]) for asset in assets}
        self.assertEqual((len(assets), summary["duplicates"]), (4, 4))
        self.assertLessEqual({"n\ufffd.off", "n\u65e5\U0001d11e.off"}, names, "what is UTF-8 stays as it is")
        dealt = run("sqbake", "plan", models, *options, "--costs", self.folder / "records").stderr
        self.assertNotIn("tells of no bake", dealt)
        (models / "a\nb.off").write_bytes((models / os.fsdecode(b"n\xff.off")).read_bytes())
        shown = run("sqbake", "plan", models, *options[:2], "--shard", "1/1", errors="replace").stdout
        self.assertEqual(len(shown.splitlines()), 5, shown)

    def test_a_merge_finds_two_runs_that_gave_different_bytes_by_their_hashes_alone(self):
        mesh = self.models / "m0.off"
        options = ("-o", self.folder / "m.h5", "--format", "ndjson", *ROUGH)
        record, summary = run("sqbake", "bake", mesh, *options).stdout.splitlines(keepends=True)
        same = {**json.loads(record), "seconds": 7.0}
        other = {**json.loads(record), "hash": same["hash"][::-1]}
        (self.folder / "first").write_text(record + summary, encoding="utf-8")
        for name, second, code in (("same", same, 0), ("other", other, 1)):
            (self.folder / name).write_text(json.dumps(second) + "\n" + summary, encoding="utf-8")
            answer = self.merge("first", name)
            self.assertEqual(answer[0], code, answer)
            self.assertEqual("two runs made different bundles" in answer[1], name == "other")

    def test_a_merge_names_what_failed_and_counts_what_was_stopped(self):
        (self.models / "a.off").write_text("OFF\n", encoding="ascii")
        run_ = run("sqbake", "bake", self.models, "--recursive", "--out-dir", self.folder / "out", "--format", "ndjson",
                   "--fail-fast", "-j1")
        (self.folder / "records").write_text(run_.stdout, encoding="utf-8")
        code, messages, _ = self.merge("records")
        self.assertEqual((code, len(messages.splitlines())), (1, 3), messages)
        self.assertRegex(messages, r"a\.off: failed: .*\n.*m1\.off: cancelled: .*\n.* 4 more were cancelled")

    def test_a_plan_finds_what_a_bake_with_the_same_options_would_refuse(self):
        plan = ("plan", self.models, "--recursive", "--out-dir", self.folder / "out")
        self.assert_exit(run("sqbake", *plan, "--quality", "fine", "--timeout", "5m"), 0)
        self.assert_exit(run("sqbake", *plan, "--max-parts", "0"), 2)

    def submit(self, lost_task="", shards=3, what=None, options=()):
        fake = self.folder / "bin"
        fake.mkdir(exist_ok=True)
        (fake / "sbatch").write_text(STAND_IN, encoding="ascii")
        (fake / "sbatch").chmod(0o755)
        environment = {**os.environ, "PATH": f"{fake}:{BIN}:{os.environ['PATH']}", "LOST_TASK": lost_task,
                       "SLURM_CPUS_PER_TASK": "2"}
        result = subprocess.run([SLURM / "submit", *(what or [self.models]), self.folder / "farm", str(shards), *ROUGH,
                                 *options], env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assert_exit(result, 0)
        return result.stdout.strip()

    def test_the_slurm_scripts_give_what_one_machine_gives_even_after_a_lost_task(self):
        self.bake("serial")
        self.assertEqual(self.submit(lost_task="2"), "merge ended with 1")
        records = self.folder / "farm" / "records"
        missing = json.loads((records / "all.ndjson").read_text(encoding="utf-8").splitlines()[-1])["missing"]
        self.assertTrue(missing)
        self.assertIn("no record", (records / "merge.log").read_text(encoding="utf-8"))

        self.assertEqual(self.submit(), "merge ended with 0")
        self.assertEqual(self.bundles(self.folder / "farm"), self.bundles(self.folder / "serial"))
        assets = [json.loads(line) for line in (records / "all.ndjson").read_text(encoding="utf-8").splitlines()][:-1]
        self.assertEqual({a["output"] for a in assets if not a["cached"]}, set(missing),
                         "the second run bakes what the first did not")
        self.assertIn("<table", (records / "report.html").read_text(encoding="utf-8"))

    def test_the_slurm_scripts_take_manifests_and_options_that_name_the_bundles(self):
        manifest = self.models / "props, and more.toml"
        manifest.write_text('[[asset]]\ninput = "m0.off"\n[[asset]]\ninput = "below/m1.off"\n', encoding="ascii")
        self.assertEqual(self.submit(what=["--manifest", manifest], options=["--keep-extension"]), "merge ended with 0")
        self.assertEqual(sorted(self.bundles(self.folder / "farm")), ["below/m1.off.h5", "m0.off.h5"])
        records = self.folder / "farm" / "records"
        before = {path.name: path.read_bytes() for path in records.iterdir()}
        for options in (["--max-parts", "0"], ["--quality", "fein"]):
            with self.assertRaises(AssertionError):
                self.submit(options=options)
        self.assertEqual({path.name: path.read_bytes() for path in records.iterdir()}, before, "nothing was submitted")

    def test_submit_refuses_costs_beside_those_it_keeps(self):
        for option in (["--costs", "old.ndjson"], ["--costs=old.ndjson"]):
            with self.assertRaisesRegex(AssertionError, "--costs: submit keeps"):
                self.submit(options=option)
        self.assertFalse((self.folder / "farm").exists())

    def test_an_earlier_run_in_more_shards_does_not_speak_for_this_one(self):
        self.assertEqual(self.submit(shards=4), "merge ended with 0")
        write_off(self.models / "m0.off", sphere(1, 9))
        self.assertEqual(self.submit(shards=2), "merge ended with 0")
        records = self.folder / "farm" / "records"
        self.assertEqual(sorted(p.name for p in records.glob("shard-*.ndjson")), ["shard-1.ndjson", "shard-2.ndjson"])
        slow = str(self.models / "m0.off")
        told = [json.loads(line) for line in (records / "all.ndjson").read_text(encoding="utf-8").splitlines()]
        for record in told:
            if record.get("input") == slow:
                record["seconds"] = 1000.0
        (records / "all.ndjson").write_text("".join(json.dumps(r, separators=(",", ":")) + "\n" for r in told), "utf-8")
        self.assertEqual(self.submit(shards=3, lost_task="3"), "merge ended with 1")
        plan = [json.loads(line) for line in (records / "plan.ndjson").read_text(encoding="utf-8").splitlines()]
        self.assertEqual([asset["input"] for asset in plan if asset["shard"] == 1], [slow], "it takes longest by far")
        self.assertTrue(json.loads((records / "all.ndjson").read_text(encoding="utf-8").splitlines()[-1])["missing"])


if __name__ == "__main__":
    unittest.main()
