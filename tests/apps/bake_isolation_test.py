# SPDX-License-Identifier: Apache-2.0
"""Each mesh is baked in a process of its own: whatever becomes of it, the others, the earlier bundles and the parent
stay; limits end it; the records say how it ended; nothing is left behind."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

from support import BIN, ROUGH, TIMEOUT_S, FolderTest, box, command, run, sphere, write_off

IS_ASAN = b"__asan_init" in (BIN / "sqbake").read_bytes()
PATIENCE_S = 60


def bent(subdivisions, bend):
    """A sphere bent over: cannot be bounded by one superquadric, so its bake takes a while."""
    vertices, faces = sphere(subdivisions)
    return [(3 * x, y + bend * x * x, z) for x, y, z in vertices], faces


def children(pid):
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]
    except OSError:
        return []


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.005)
    raise AssertionError("it never came to pass")


def records_of(text):
    return [record for line in text.splitlines() if (record := json.loads(line))["type"] == "asset"]


class Isolation(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        self.models.mkdir()
        self.out = self.folder / "out"

    def start(self, *arguments):
        process = subprocess.Popen(command("sqbake", "bake", *arguments), stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for cleanup in (process.stdout.close, process.stderr.close, process.wait, process.kill):
            self.addCleanup(cleanup)
        return process

    def worker_on(self, parent, name):
        """Process id of the worker that bakes the mesh of this name."""
        for pid in children(parent.pid):
            try:
                if Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")[2:3] == [os.fsencode(self.models / name)]:
                    return pid
            except OSError:
                pass
        return None

    def test_a_crash_ends_one_bake_and_no_other(self):
        write_off(self.models / "a.off", box())
        write_off(self.models / "b.off", bent(4, 1))
        write_off(self.models / "c.off", box(1, 2, 3))
        self.out.mkdir()
        earlier = self.bake(box(2, 2, 2), "earlier", *ROUGH).read_bytes()
        (self.out / "b.h5").write_bytes(earlier)
        process = self.start(self.models, "--out-dir", self.out, "--format", "ndjson", "-j1")
        os.kill(until(lambda: self.worker_on(process, "b.off")), signal.SIGSEGV)
        stdout, stderr = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 1, stderr)
        records = records_of(stdout)
        self.assertEqual([r["outcome"] for r in records], ["ok", "crashed", "ok"])
        self.assertIn("signal 11", records[1]["error"]["finding"])
        self.assertIn("2 of 3 baked, 1 crashed", stderr)
        self.assertEqual((self.out / "b.h5").read_bytes(), earlier)
        self.assertEqual(sorted(p.name for p in self.out.iterdir()), ["a.h5", "b.h5", "c.h5"])

    def test_a_crash_of_a_single_mesh_has_an_exit_code_of_its_own(self):
        source = write_off(self.models / "b.off", bent(4, 1))
        process = self.start(source, "-o", self.folder / "b.h5")
        os.kill(until(lambda: self.worker_on(process, "b.off")), signal.SIGABRT)
        _, stderr = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 9, stderr)
        self.assertFalse((self.folder / "b.h5").exists())

    def test_a_time_limit_ends_a_bake(self):
        source = write_off(self.models / "b.off", bent(5, 1))
        result = run("sqbake", "bake", source, "-o", self.folder / "b.h5", "--timeout", "0.05s", "--format", "ndjson")
        self.assert_exit(result, 8)
        self.assertEqual(records_of(result.stdout)[0]["outcome"], "timeout")
        self.assertIn("0.05 s", result.stderr)
        self.assertIn("(timeout 0.05s, command line)", result.stderr)
        sidecar = self.models / "b.off.sqbake.toml"
        sidecar.write_text('unit = "mm"\ntimeout = "0.04s"\n', encoding="ascii")
        told = run("sqbake", "bake", source, "-o", self.folder / "b.h5").stderr
        self.assertIn(f"(timeout 0.04s, {sidecar}:2)", told)
        self.assertTrue(told.startswith(f"sqbake: error: {source}: "), told)  # though the sidecar's name holds it
        self.assertFalse((self.folder / "b.h5").exists())

    @unittest.skipIf(IS_ASAN, "AddressSanitizer's own maps exceed any limit")
    def test_a_memory_limit_ends_a_bake_and_a_sufficient_one_changes_no_byte(self):
        source = write_off(self.models / "b.off", bent(4, 1))
        tight, ample, free = (self.folder / f"{name}.h5" for name in ("tight", "ample", "free"))
        large = write_off(self.models / "large.off", bent(5, 1))
        result = run("sqbake", "bake", large, "-o", tight, "--memory", "16M", "-j1", "--format", "ndjson")
        self.assert_exit(result, 8)
        self.assertEqual(records_of(result.stdout)[0]["outcome"], "memory")
        self.assertIn("--memory", result.stderr)
        self.assertFalse(tight.exists())
        self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", ample, "--memory", "2G"), 0)
        self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", free), 0)
        self.assertEqual(ample.read_bytes(), free.read_bytes())

    @unittest.skipIf(IS_ASAN, "AddressSanitizer's own maps exceed any limit")
    def test_a_memory_limit_counts_what_is_used_and_not_the_threads(self):
        source = write_off(self.models / "box.off", box())
        for threads in ("-j1", "-j32"):
            self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", self.folder / "box.h5", "--memory", "48M", threads,
                                 "--no-cache"), 0)

    def test_a_worker_may_not_start_programs_nor_take_more_memory_than_the_machine_has(self):
        write_off(self.models / "b.off", bent(5, 1))
        process = self.start(self.models / "b.off", "-o", self.folder / "b.h5", "-j1")
        worker = Path(f"/proc/{until(lambda: self.worker_on(process, 'b.off'))}")
        until(lambda: "Seccomp:\t2" in (worker / "status").read_text(encoding="ascii"))
        if not IS_ASAN:
            limit = re.search(r"Max data size +(\d+) ", (worker / "limits").read_text(encoding="ascii"))
            self.assertIsNotNone(limit)
            machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
            self.assertGreaterEqual(int(limit[1]), machine)
            self.assertLess(int(limit[1]), 1.1 * machine)
        process.kill()

    def test_memory_without_a_limit_has_none(self):
        write_off(self.models / "b.off", bent(5, 1))
        process = self.start(self.models / "b.off", "-o", self.folder / "b.h5", "-j1", "--memory", "none")
        worker = Path(f"/proc/{until(lambda: self.worker_on(process, 'b.off'))}")
        until(lambda: "Seccomp:\t2" in (worker / "status").read_text(encoding="ascii"))
        self.assertRegex((worker / "limits").read_text(encoding="ascii"), r"Max data size +unlimited ")
        process.kill()

    def test_workers_end_with_a_parent_that_is_killed_and_leave_no_file(self):
        write_off(self.models / "a.off", bent(5, 1))
        write_off(self.models / "b.off", bent(5, 2))
        process = self.start(self.models, "--out-dir", self.out, "-j2")
        workers = [until(lambda name=name: self.worker_on(process, name)) for name in ("a.off", "b.off")]
        process.kill()
        process.wait()
        until(lambda: not any(map(is_alive, workers)))
        self.assertEqual(list(self.out.iterdir()), [])

    def test_a_signal_ends_workers_before_the_parent(self):
        write_off(self.models / "a.off", bent(5, 1))
        process = self.start(self.models, "--out-dir", self.out, "--format", "ndjson")
        worker = until(lambda: self.worker_on(process, "a.off"))
        process.terminate()
        stdout, stderr = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 143, stderr)
        self.assertFalse(is_alive(worker))
        self.assertEqual([r["outcome"] for r in records_of(stdout)], ["cancelled"])
        self.assertEqual(list(self.out.iterdir()), [])

    def test_isolation_changes_no_byte(self):
        source = write_off(self.models / "b.off", bent(3, 1))
        bundles = []
        for number, options in enumerate((("-j1",), ("-j3",), ("--no-isolation",), ("--verify-determinism", "-j2"))):
            output = self.folder / f"{number}.h5"
            self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", output, *options), 0)
            bundles.append(output.read_bytes())
        self.assertEqual(bundles, bundles[:1] * 4)

    def comma_locale(self):
        """Environment of a locale that writes 0,5 for a half, made for this test."""
        if shutil.which("localedef") is None:
            self.skipTest("no localedef, which makes the locale")
        made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", str(self.folder / "de_DE.UTF-8")],
                              capture_output=True, text=True, check=False)
        environment = {"LOCPATH": str(self.folder), "LC_ALL": "de_DE.UTF-8"}
        probe = "import locale; locale.setlocale(locale.LC_ALL, ''); print(locale.localeconv()['decimal_point'])"
        point = subprocess.run([sys.executable, "-c", probe], env=os.environ | environment, capture_output=True, text=True,
                               check=False).stdout.strip()
        if point != ",":
            self.skipTest(f"no locale with a decimal comma: {made.stderr.strip()}")
        return environment

    def test_neither_threads_nor_place_nor_surroundings_change_a_byte(self):
        locale = self.comma_locale()
        mesh = bent(3, 1)
        source, elsewhere = self.models / "b.off", self.folder / "a folder" / "of another name"
        elsewhere.mkdir(parents=True)
        for folder in (self.models, elsewhere):
            write_off(folder / "b.off", mesh)
        bundles = {}

        def bake(case, *options, mesh=source, **surroundings):
            output = self.folder / f"{case}.h5"
            self.assert_exit(run("sqbake", "bake", mesh, *ROUGH, "-o", output, *options, **surroundings), 0)
            bundles[case] = output.read_bytes()

        bake("one thread", "-j1")
        bake("two threads", "-j2")
        bake("sixteen threads", "-j16")
        bake("another folder", mesh=elsewhere / "b.off")
        bake("another working directory", mesh="b.off", cwd=elsewhere)
        bake("another umask", umask=0o077)
        bake("a decimal comma", env=os.environ | locale)
        bake("another time zone", env=os.environ | {"TZ": "Pacific/Kiritimati"})
        self.assertEqual({case: bundle == bundles["one thread"] for case, bundle in bundles.items()},
                         dict.fromkeys(bundles, True))

    def test_verify_determinism_bakes_a_second_time(self):
        source = write_off(self.models / "b.off", bent(3, 1))
        result = run("sqbake", "bake", source, *ROUGH, "-o", self.folder / "b.h5", "--verify-determinism", "--format",
                     "ndjson")
        stages = {s["stage"]: s["seconds"] for s in records_of(result.stdout)[0]["stages"]}
        self.assertGreater(stages["verify"], stages["refine"])

    def test_jobs_bound_the_workers(self):
        for name in "abcd":
            write_off(self.models / f"{name}.off", bent(4, 1))
        process = self.start(self.models, *ROUGH, "--out-dir", self.out, "-j2", "-q")
        most = 0
        while process.poll() is None:
            most = max(most, len(children(process.pid)))
            time.sleep(0.002)
        self.assertEqual((process.returncode, most), (0, 2))

    def test_fail_fast_begins_no_further_mesh(self):
        (self.models / "a.off").write_text("OFF\n1 1 0\n", encoding="ascii")
        for name in "bcd":
            write_off(self.models / f"{name}.off", box())
        result = run("sqbake", "bake", self.models, "--out-dir", self.out, "-j1", "--fail-fast", "--format", "ndjson")
        self.assert_exit(result, 1)
        self.assertEqual([r["outcome"] for r in records_of(result.stdout)], ["failed"] + 3 * ["cancelled"])
        self.assertEqual(list(self.out.iterdir()), [])


class Degraded(FolderTest):
    OPEN = (box()[0], box()[1][2:])

    def test_a_mesh_that_stays_open_is_degraded_and_says_so(self):
        source = write_off(self.folder / "open.off", self.OPEN)
        output = self.folder / "open.h5"
        options = (*ROUGH, "--repair", "none", "--format", "ndjson")
        result = run("sqbake", "bake", source, "-o", output, *options)
        self.assert_exit(result, 0)
        record = records_of(result.stdout)[0]
        self.assertEqual((record["outcome"], [d["id"] for d in record["degradations"]]), ("degraded", ["open-mesh"]))
        self.assertIn("degraded: 4 edges with one face", result.stderr)
        self.assert_exit(run("sqbake", "bake", source, "-o", output, *options, "--strict"), 10)
        self.assert_exit(run("sqbake", "bake", source, "--out-dir", self.folder / "out", *options, "--strict"), 10)
        self.assert_exit(run("sqbake", "bake", self.folder, "--out-dir", self.folder / "out", *options, "--strict"), 1)

    def test_quiet_is_not_silent_about_it(self):
        source = write_off(self.folder / "open.off", self.OPEN)
        result = run("sqbake", "bake", source, "-o", self.folder / "open.h5", *ROUGH, "--repair", "none", "-q")
        self.assert_exit(result, 0)
        self.assertRegex(result.stderr, r"\Asqbake: warning: open\.off: degraded: [^\n]+\n\Z")
        self.assertEqual(result.stdout, "")

    def test_a_closed_mesh_is_not(self):
        source = write_off(self.folder / "box.off", box())
        result = run("sqbake", "bake", source, *ROUGH, "-o", self.folder / "box.h5", "--format", "ndjson", "--strict")
        self.assert_exit(result, 0)
        self.assertEqual(records_of(result.stdout)[0]["outcome"], "ok")
        self.assertNotIn("degraded", run("sqinfo", "show", self.folder / "box.h5").stdout)

    def test_the_fallback_is_marked_in_log_record_and_bundle_and_bounds_the_mesh(self):
        (vertices, faces), (box_vertices, box_faces) = bent(4, 1), box()
        mesh = (vertices + [(x + 9, y, z) for x, y, z in box_vertices],  # two components
                faces + [tuple(i + len(vertices) for i in face) for face in box_faces])
        source = write_off(self.folder / "bent.off", mesh)
        output = self.folder / "bent.h5"
        process = subprocess.Popen(
            command("sqbake", "bake", source, "-o", output, "--fallback", "superquadric", "--format", "ndjson"),
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        os.kill(until(lambda: children(process.pid))[0], signal.SIGKILL)
        stdout, stderr = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 0, stderr)
        record = records_of(stdout)[0]
        self.assertEqual((record["outcome"], record["mesh"]["components"], record["parts"]), ("degraded", 2, 1))
        self.assertEqual(record["degradations"][0]["id"], "fallback")
        self.assertIn("crashed", record["degradations"][0]["finding"])
        self.assertIn("degraded: one superquadric", stderr)
        shown = json.loads(run("sqinfo", "show", output, "--format", "json").stdout)
        self.assertEqual(shown["provenance"]["options"]["fallback"], "superquadric")
        self.assertRegex(run("sqinfo", "show", output).stdout, r"(?m)^  degraded +fallback \(superquadric\)")
        self.assertTrue(shown["provenance"]["options"]["decompose"]["join_components"])
        points = "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in mesh[0])
        layer_1 = run("sqinfo", "query", output, "--points", "-", "--layer", "1", input=points)
        self.assert_exit(layer_1, 0)
        self.assertEqual({line.split(",")[3] for line in layer_1.stdout.splitlines()[1:]}, {"1"})

    def bake_killed(self, source, output):
        """The record and the messages of a bake with a fallback whose first worker is killed."""
        process = subprocess.Popen(
            command("sqbake", "bake", source, "-o", output, "--fallback", "superquadric", "--format", "ndjson"),
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        os.kill(until(lambda: children(process.pid))[0], signal.SIGKILL)
        stdout, stderr = process.communicate(timeout=TIMEOUT_S)
        return process.returncode, records_of(stdout)[0], stderr

    def test_a_fallback_takes_the_place_of_another_and_of_no_better_bundle(self):
        source = write_off(self.folder / "bent.off", bent(4, 1))
        output = self.folder / "bent.h5"
        output.write_bytes(self.bake(box(2, 2, 2), "earlier", *ROUGH).read_bytes())
        earlier = output.read_bytes()
        code, record, stderr = self.bake_killed(source, output)
        self.assertEqual((code, record["outcome"]), (9, "crashed"), stderr)
        self.assertIn("is kept", record["warnings"][0])
        self.assertIn("is kept", stderr)
        self.assertEqual(output.read_bytes(), earlier)
        output.write_bytes(earlier[:len(earlier) // 2])  # a damaged one is no better
        self.assertEqual(self.bake_killed(source, output)[1]["degradations"][0]["id"], "fallback")
        write_off(source, bent(4, 2))
        fallback = output.read_bytes()
        self.assertEqual(self.bake_killed(source, output)[1]["outcome"], "degraded")
        self.assertNotEqual(output.read_bytes(), fallback)

    def test_a_mesh_that_cannot_be_read_gets_no_fallback(self):
        source = self.folder / "bad.off"
        source.write_text("OFF\n1 1 0\n", encoding="ascii")
        self.assert_exit(run("sqbake", "bake", source, "-o", self.folder / "bad.h5", "--fallback", "superquadric"), 4)
        self.assertEqual(self.files(), ["bad.off"])


if __name__ == "__main__":
    unittest.main()
