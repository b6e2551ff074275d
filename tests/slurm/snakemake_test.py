# SPDX-License-Identifier: Apache-2.0
"""scripts/slurm/Snakefile, run by the real snakemake: here, and as jobs of a real Slurm cluster.

Started by scripts/check slurm. Needs root, and the packages of the group slurm in scripts/packages.txt.
"""
import json
import os
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "apps"))
# pylint: disable=wrong-import-position
from cluster import Cluster, enter_namespaces
from support import BIN, ROUGH, FolderTest, box, run, sphere, write_off

SNAKEFILE = Path(__file__).resolve().parents[2] / "scripts" / "slurm" / "Snakefile"
SHARDS = 2
TIMEOUT_S = 1800


class Snakemake(FolderTest):
    def setUp(self):
        super().setUp()
        self.models, self.out = self.folder / "my models", self.folder / "farm"
        (self.models / "below").mkdir(parents=True)
        write_off(self.models / "large.off", sphere(2))
        write_off(self.models / "below" / "small.off", box())
        write_off(self.models / "other.off", box(1, 2, 3))

    def snakemake(self, *options, environment=None, cores=("--cores", "2"), sqbake=BIN / "sqbake"):
        return subprocess.run(["snakemake", "--snakefile", SNAKEFILE, "--nocolor", *cores, *options, "--config",
                               f"sqbake={sqbake}", f"input={self.models}", f"out_dir={self.out}", f"shards={SHARDS}",
                               f"options={' '.join(ROUGH)}"], cwd=self.folder, capture_output=True, text=True,
                              timeout=TIMEOUT_S, check=False,
                              env={**(environment or os.environ), "HOME": str(self.folder)})

    def records(self):
        lines = (self.out / "records" / "all.ndjson").read_text(encoding="utf-8").splitlines()
        return {Path(r["input"]).name: r for r in map(json.loads, lines) if r["type"] == "asset"}

    def assert_whole(self, result):
        self.assert_exit(result, 0)
        serial = self.folder / "serial"
        self.assert_exit(run("sqbake", "bake", self.models, "--recursive", "--out-dir", serial, "--cache",
                             self.folder / "serial_cache", *ROUGH), 0)
        bundles = lambda folder: {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*.h5")}
        self.assertEqual(bundles(self.out), bundles(serial))

    def test_gives_what_one_run_gives_and_bakes_again_what_changed(self):
        self.assert_whole(self.snakemake())
        self.assertIn("<table", (self.out / "records" / "report.html").read_text(encoding="utf-8"))
        again = self.snakemake()
        self.assert_exit(again, 0)
        self.assertIn("Nothing to be done", again.stdout + again.stderr)

        write_off(self.models / "below" / "small.off", box(2, 1, 1))
        changed = self.snakemake()
        self.assert_whole(changed)
        self.assertEqual((changed.stdout + changed.stderr).count("\nrule shard:"), 1, "the other shard stays")
        records = self.records()
        self.assertEqual([records[name]["cached"] for name in ("small.off", "other.off")], [False, True], "of one shard")

    def test_a_mesh_that_fails_is_named_and_costs_no_other(self):
        (self.models / "bad.off").write_text("OFF\n3 0 0\n", encoding="ascii")
        failed = self.snakemake()
        self.assertEqual(failed.returncode, 1)
        self.assertRegex(failed.stderr, r"bad\.off: failed: ")
        self.assertEqual({name: record["outcome"] for name, record in self.records().items()},
                         {"bad.off": "failed", "large.off": "ok", "other.off": "ok", "small.off": "ok"})
        write_off(self.models / "bad.off", box(1, 1, 4))
        self.assert_whole(self.snakemake())

    def test_a_shard_that_is_killed_is_baked_by_the_next_run(self):
        # Ends like a baker that the system kills for want of memory, but only in the bake of the first shard.
        trap = self.folder / "sqbake"
        trap.write_text(f'#!/bin/sh\ncase "$*" in *"--shard 1/"*) kill -9 $$ ;; esac\nexec "{BIN}/sqbake" "$@"\n',
                        encoding="ascii")
        trap.chmod(0o755)
        self.assertEqual(self.snakemake("--keep-going", sqbake=trap).returncode, 1)
        self.assertFalse((self.out / "records" / "shard-1.ndjson").exists())
        self.assert_whole(self.snakemake())

    def test_its_jobs_run_on_a_cluster(self):
        cluster = self.enterContext(Cluster())
        submit = "sbatch --parsable --job-name={rule} --cpus-per-task={threads} --output=/dev/null"
        self.assert_whole(self.snakemake("--cluster", submit, environment=cluster.environment,
                                         cores=("--jobs", "4", "--local-cores", "1")))
        shards = cluster.jobs("shard")
        self.assertEqual([job["JobState"] for job in shards], ["COMPLETED"] * SHARDS)
        self.assertEqual({job["NodeList"] for job in shards}, {"node1", "node2"})


if __name__ == "__main__":
    enter_namespaces()
    unittest.main()
