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

    def test_a_shard_that_is_none_is_refused_before_anything_is_written(self):
        for shard in ("0/3", "4/3", "x", "auto"):
            result = run("sqbake", "bake", self.models, "--recursive", "--out-dir", self.folder / "out", "--shard", shard)
            self.assert_exit(result, 2)
        self.assertFalse((self.folder / "out").exists())

    def submit(self, lost_task="", shards=3):
        fake = self.folder / "bin"
        fake.mkdir(exist_ok=True)
        (fake / "sbatch").write_text(STAND_IN, encoding="ascii")
        (fake / "sbatch").chmod(0o755)
        environment = {**os.environ, "PATH": f"{fake}:{BIN}:{os.environ['PATH']}", "LOST_TASK": lost_task,
                       "SLURM_CPUS_PER_TASK": "2"}
        result = subprocess.run([SLURM / "submit", self.models, self.folder / "farm", str(shards), *ROUGH], env=environment,
                                capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
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

    def test_an_earlier_run_in_more_shards_does_not_speak_for_this_one(self):
        self.assertEqual(self.submit(shards=4), "merge ended with 0")
        write_off(self.models / "m0.off", sphere(1, 9))
        self.assertEqual(self.submit(shards=2), "merge ended with 0")
        records = self.folder / "farm" / "records"
        self.assertEqual(sorted(p.name for p in records.glob("shard-*.ndjson")), ["shard-1.ndjson", "shard-2.ndjson"])
        self.assertEqual(self.submit(shards=3, lost_task="3"), "merge ended with 1")
        self.assertTrue(json.loads((records / "all.ndjson").read_text(encoding="utf-8").splitlines()[-1])["missing"])


if __name__ == "__main__":
    unittest.main()
