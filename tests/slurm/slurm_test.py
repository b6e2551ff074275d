# SPDX-License-Identifier: Apache-2.0
"""scripts/slurm on a real Slurm cluster: whatever befalls the tasks, the bundles are in the end those of one machine.

Started by scripts/check slurm. Needs root, and the packages of the group slurm in scripts/packages.txt.
"""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "apps"))
# pylint: disable=wrong-import-position
from cluster import JOB_TIMEOUT_S, Cluster, enter_namespaces, processes, wait_until
from support import BIN, ROUGH, FolderTest, box, run, sphere, write_off

SLURM = Path(__file__).resolve().parents[2] / "scripts" / "slurm"
SHARDS = 4
# In each shard one mesh of each: records come in the order of the names, so the large one is the last.
SMALL, MEDIUM, LARGE = "a_box", "b_ball", "z_ball"


def write_models(folder):
    (folder / "below").mkdir(parents=True)
    for k in range(SHARDS):
        below = folder / "below" if k % 2 else folder
        write_off(below / f"{SMALL}{k}.off", box(1, 1 + k, 2))
        write_off(below / f"{MEDIUM}{k}.off", sphere(2, 1 + k))
        write_off(below / f"{LARGE}{k}.off", sphere(3, 1 + k))


def bundles(folder):
    """Bundles by name; those in the cache are named by their contents and have no such ending."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.h5")}


def records_in(file):
    """Of a file that may be growing: the last line counts when it has its end."""
    lines = file.read_text(encoding="utf-8").split("\n")[:-1] if file.exists() else []
    return [record for record in map(json.loads, lines) if record["type"] == "asset"]


class SlurmTest(FolderTest):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="sqmap-slurm-")
        cls.addClassCleanup(holder.cleanup)
        common = Path(holder.name)
        cls.cluster = cls.enterClassContext(Cluster())
        cls.models = common / "models"
        write_models(cls.models)
        result = run("sqbake", "bake", cls.models, "--recursive", "--out-dir", common / "serial", "--no-cache", "-j1",
                     *ROUGH)
        assert result.returncode == 0, result.stderr
        cls.serial = bundles(common / "serial")
        assert len(cls.serial) == 3 * SHARDS

    def setUp(self):
        super().setUp()
        self.out = self.folder / "farm"
        self.records = self.out / "records"
        self.addCleanup(self.cluster.cancel_all)  # what a test that failed has left running

    def submit(self):
        """Number of the merge job."""
        environment = {**self.cluster.environment, "SQBAKE": str(BIN / "sqbake"), "SQMAP_RECORDS": str(self.records)}
        environment.pop("SQMAP_CACHE_DIR", None)
        result = subprocess.run([SLURM / "submit", self.models, self.out, str(SHARDS), *ROUGH], env=environment,
                                capture_output=True, text=True, timeout=60, check=False)
        self.assert_exit(result, 0)
        return result.stdout.strip()

    def merged(self, job_id):
        """What the merge said: its exit code, its messages, its summary."""
        code = int(self.cluster.wait_for(job_id)["ExitCode"].split(":")[0])
        summary = json.loads((self.records / "all.ndjson").read_text(encoding="utf-8").splitlines()[-1])
        return code, (self.records / "merge.log").read_text(encoding="utf-8"), summary

    def assert_whole(self, job_id):
        code, messages, summary = self.merged(job_id)
        self.assertEqual((code, messages, summary["outcomes"], summary["missing"]),
                         (0, "", {"ok": len(self.serial)}, []), self.cluster.logs())
        self.assertEqual(bundles(self.out), self.serial)

    def wait_for_bake(self, task):
        """Until a task has baked a mesh and is baking another; the number of its process, records so far."""
        return wait_until(lambda: self.midway(task), f"task {task} midway", JOB_TIMEOUT_S)

    def midway(self, task):
        line = f"SLURM_ARRAY_TASK_ID={task}"
        bakes, workers = (processes("sqbake", name, environment=line) for name in ("bake", "worker"))
        done = records_in(self.records / f"shard-{task}.ndjson")
        return bakes and workers and done and (bakes[0], done)

    def wait_for_bake_on(self, node):
        """The number of a task that is midway on this node: which one runs there is Slurm's choice."""
        def one():
            return next((number for number, task in self.cluster.tasks().items() if task["JobState"] == "RUNNING"
                         and task["NodeList"] == node and self.midway(number)), None)
        return wait_until(one, f"a task midway on {node}", JOB_TIMEOUT_S)

    def test_gives_what_one_machine_gives(self):
        job = self.submit()
        self.assert_whole(job)
        self.assertEqual({task["NodeList"] for task in self.cluster.tasks().values()}, {"node1", "node2"})
        self.assertIn("<table", (self.records / "report.html").read_text(encoding="utf-8"))

    def test_a_killed_task_is_missed_by_the_merge_and_baked_by_the_next_run(self):
        job = self.submit()
        victim, done = self.wait_for_bake(2)
        os.kill(victim, signal.SIGKILL)
        code, messages, summary = self.merged(job)
        self.assertEqual(code, 1, messages)
        self.assertEqual(self.cluster.tasks()["2"]["ExitCode"], "0:9")
        shard = {json.loads(line)["output"] for line in
                 (self.records / "plan.ndjson").read_text(encoding="utf-8").splitlines() if '"shard":2' in line}
        missing = set(summary["missing"])
        self.assertTrue(missing and missing < shard, f"{missing} of {shard}")
        self.assertTrue(missing.isdisjoint(record["output"] for record in done))
        for output in missing:
            self.assertIn(f"{output}: no record", messages)
        self.assertEqual(processes("sqbake", "worker"), [], "workers end with their task")
        have = bundles(self.out)
        self.assertEqual(have, {name: self.serial[name] for name in have}, "what is there is whole")

        self.assert_whole(self.submit())
        baked = {r["output"] for r in records_in(self.records / "all.ndjson") if not r["cached"]}
        # Records come in the order of the plan, so a bundle may have been written and its record not.
        self.assertTrue(baked <= missing, f"{baked - missing} had been done")

    def test_a_killed_worker_costs_its_mesh_alone(self):
        job = self.submit()
        victim = wait_until(lambda: processes("sqbake", "worker", f"{LARGE}1.off"), "a large mesh begun", JOB_TIMEOUT_S)
        os.kill(victim[0], signal.SIGKILL)
        code, messages, summary = self.merged(job)
        self.assertEqual((code, summary["outcomes"]), (1, {"crashed": 1, "ok": len(self.serial) - 1}), messages)
        self.assertRegex(messages, rf"{LARGE}1.off: crashed: .*signal 9")
        self.assert_whole(self.submit())

    def test_a_node_that_is_drained_ends_its_task_and_gets_no_other(self):
        self.addCleanup(self.cluster.heal, "node2")
        job = self.submit()
        self.wait_for_bake(1)
        before = {number: task["NodeList"] for number, task in self.cluster.tasks().items()
                  if task["JobState"] != "PENDING"}
        self.cluster.set_node("node2", "DRAIN")
        self.assert_whole(job)
        after = {number: task["NodeList"] for number, task in self.cluster.tasks().items()}
        self.assertIn("node2", before.values())
        self.assertEqual({number: after[number] for number in before}, before)
        self.assertEqual({node for number, node in after.items() if number not in before}, {"node1"})

    def test_the_task_of_a_node_that_crashes_is_baked_by_another(self):
        self.addCleanup(self.cluster.heal, "node2")
        job = self.submit()
        victim = self.wait_for_bake_on("node2")
        self.cluster.crash_node("node2")
        self.cluster.start_now(victim)
        self.assert_whole(job)
        task = self.cluster.tasks()[victim]
        self.assertEqual((task["NodeList"], task["Restarts"]), ("node1", "1"))

    def mount_disk(self, folder, kilobytes):
        folder.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", folder], check=True)
        self.addCleanup(subprocess.run, ["umount", folder], check=True)

    def make_room(self, folder):
        subprocess.run(["mount", "-o", "remount,size=100m", folder], check=True)

    def test_a_full_disk_is_named_and_what_it_kept_out_is_baked_once_there_is_room(self):
        self.mount_disk(self.out, 40)
        self.records = self.folder / "records"
        code, messages, summary = self.merged(self.submit())
        self.assertEqual((code, summary["missing"]), (1, []), messages)
        self.assertEqual(set(summary["outcomes"]), {"ok", "failed"}, messages)
        self.assertEqual(len(re.findall(": failed: .*No space left on device", messages)),
                         summary["outcomes"]["failed"])
        have = bundles(self.out)
        self.assertEqual(have, {name: self.serial[name] for name in have}, "what is there is whole")
        self.assertEqual(len(have), summary["outcomes"]["ok"])
        self.make_room(self.out)
        self.assert_whole(self.submit())

    def test_a_full_disk_of_records_fails_its_jobs_and_costs_no_bundle(self):
        self.records = self.folder / "records"
        self.mount_disk(self.records, 16)
        merge = self.cluster.wait_for(self.submit())
        self.assertEqual(merge["JobState"], "FAILED")
        self.assertIn("FAILED", {task["JobState"] for task in self.cluster.tasks().values()})
        self.assertEqual(bundles(self.out), self.serial)
        self.make_room(self.records)
        self.assert_whole(self.submit())
        self.assertEqual([r["output"] for r in records_in(self.records / "all.ndjson") if not r["cached"]], [])


if __name__ == "__main__":
    enter_namespaces()
    unittest.main()
