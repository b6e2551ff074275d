# SPDX-License-Identifier: Apache-2.0
"""`sqbake bake` with a cache bakes nothing twice, says why it bakes, and never suffers from the cache."""
import json
import os
import shutil
import subprocess
import unittest

from support import NOBODY, FolderTest, ROUGH, box, run, sphere, write_off

from bake_build_test import write_gltf, write_obj


class Cache(FolderTest):
    def setUp(self):
        super().setUp()
        self.models, self.out, self.cache = (self.folder / name for name in ("models", "out", "cache"))
        self.models.mkdir()
        for k in range(4):
            write_off(self.models / f"ball {k}.off", sphere(1, 1 + k))

    def bake(self, *options, models=None, out=None, cache=None, code=0):
        """Records by file name."""
        result = run("sqbake", "bake", models or self.models, "--out-dir", out or self.out, "--cache",
                     cache or self.cache, "--format", "ndjson", "--explain", *ROUGH, *options)
        self.assert_exit(result, code)
        self.stderr = result.stderr
        records = [json.loads(line) for line in result.stdout.splitlines()]
        return {os.path.basename(r["input"]): r for r in records if r["type"] == "asset"}

    def baked(self, *options, **more):
        return sorted(name for name, record in self.bake(*options, **more).items() if not record["cached"])

    def bundles(self, out=None):
        return {p.name: p.read_bytes() for p in (out or self.out).rglob("*.h5")}

    def stamps(self):
        return {p.name: (p.stat().st_mtime_ns, p.stat().st_ino) for p in self.out.rglob("*.h5")}

    def test_bakes_once_what_does_not_change(self):
        names = [f"ball {k}.off" for k in range(4)]
        self.assertEqual(self.baked(), names)
        cold, stamps = self.bundles(), self.stamps()
        self.assertEqual(self.baked(), [])
        for name in names:
            (self.models / name).touch()
        self.assertEqual(self.baked(), [])
        self.assertEqual((self.bundles(), self.stamps()), (cold, stamps))

        write_off(self.models / "ball 2.off", box())
        self.assertEqual(self.baked(), ["ball 2.off"])
        self.assertIn("ball 2.off: mesh ball 2.off changed", self.stderr)

        (self.models / "ball 1.off.sqbake.toml").write_text("max-parts = 3\n", encoding="ascii")
        self.assertEqual(self.baked(), ["ball 1.off"])
        self.assertRegex(self.stderr, r"ball 1.off: option --max-parts: 3, was 24")
        self.assertEqual(self.baked("--unit", "mm"), names)
        self.assertEqual(self.baked(), [])

    def test_materials_and_buffers_count_and_textures_do_not(self):
        shutil.rmtree(self.models)
        self.models.mkdir()
        write_obj(self.models / "red.obj", sphere(1), "red.mtl")
        write_gltf(self.models / "box.gltf", box(), "box.bin")
        (self.models / "skin.png").write_bytes(b"one")
        material = "newmtl red\nmap_Kd skin.png\n"
        (self.models / "red.mtl").write_text(material, encoding="ascii")
        self.assertEqual(self.baked(), ["box.gltf", "red.obj"])
        (self.models / "skin.png").write_bytes(b"another")
        self.assertEqual(self.baked(), [])
        (self.models / "red.mtl").write_text(material + "Kd 1 0 0\n", encoding="ascii")
        self.assertEqual(self.baked(), ["red.obj"])
        self.assertIn("red.obj: file red.mtl changed", self.stderr)
        before = self.bundles()["box.h5"]
        write_gltf(self.models / "elsewhere.gltf", box(2, 2, 3), "box.bin")  # other numbers in the same buffer
        (self.models / "elsewhere.gltf").unlink()
        self.assertEqual(self.baked(), ["box.gltf"])
        self.assertIn("box.gltf: file box.bin changed", self.stderr)
        self.assertNotEqual(self.bundles()["box.h5"], before)

    def foretold(self, *options):
        """What -n --explain says would be baked; that it writes nothing."""
        files = lambda: {p: (p.stat().st_mtime_ns, p.stat().st_ino) for p in self.folder.rglob("*")}
        before = files()
        result = run("sqbake", "bake", self.models, "--out-dir", self.out, "--cache", self.cache, "-n", "--explain",
                     "--format", "ndjson", *ROUGH, *options)
        self.assert_exit(result, 0)
        self.stderr = result.stderr
        self.assertEqual(files(), before)
        records = [json.loads(line) for line in result.stdout.splitlines()]
        names = sorted(os.path.basename(r["input"]) for r in records if not r["cached"])
        self.assertIn(f"{len(names)} of {len(records)} would be baked", self.stderr)
        for record in records:
            for reason in record["reasons"]:
                self.assertIn(reason, self.stderr)
        return names

    def test_a_dry_run_foretells_what_is_baked_and_why(self):
        names = [f"ball {k}.off" for k in range(4)]
        self.assertEqual(self.foretold(), names)
        self.assertIn("no earlier bake", self.stderr)
        self.bake()
        self.assertEqual(self.foretold(), [])
        self.assertIn("up to date", self.stderr)
        (self.out / "ball 3.h5").unlink()
        write_off(self.models / "ball 2.off", box())
        self.assertEqual(self.foretold(), ["ball 2.off"])
        self.assertIn("ball 2.off: mesh ball 2.off changed", self.stderr)
        self.assertIn("ball 3.off: the cache has it", self.stderr)
        self.assertEqual(self.foretold("--max-parts", "2"), names)
        self.assertRegex(self.stderr, r"option --max-parts: 2, was 24")
        self.assertEqual(self.baked(), ["ball 2.off"])
        self.assertEqual(self.foretold("--no-cache"), names)
        for path in (self.cache / "v1" / "objects").rglob("*"):
            if path.is_file():
                path.unlink()
        (self.out / "ball 1.h5").unlink()
        self.assertEqual(self.foretold(), ["ball 1.off"])

    def test_a_hit_has_the_bytes_and_the_record_of_a_cold_bake_without_cache(self):
        self.bake()
        cold = self.folder / "cold"
        without = run("sqbake", "bake", self.models, "--out-dir", cold, "--no-cache", "--format", "ndjson", *ROUGH)
        self.assert_exit(without, 0)
        shutil.rmtree(self.out)
        hits = self.bake()
        self.assertTrue(all(record["cached"] for record in hits.values()))
        self.assertEqual(self.bundles(), self.bundles(cold))
        for line in without.stdout.splitlines()[:-1]:
            record = json.loads(line)
            hit = hits[os.path.basename(record["input"])]
            for name in ("parts", "bytes", "errors", "mesh", "outcome", "eq35_percent"):
                self.assertEqual(hit[name], record[name])

    def test_a_shared_cache_serves_another_folder_with_its_own_names(self):
        self.bake()
        moved, out = self.folder / "elsewhere", self.folder / "out2"
        shutil.copytree(self.models, moved)
        records = self.bake(models=moved, out=out)
        for name, record in records.items():
            self.assertTrue(record["cached"])
            self.assertEqual(record["input"], str(moved / name))
            self.assertEqual(record["output"], str(out / name.replace(".off", ".h5")))
        self.assertEqual(self.bundles(out), self.bundles())

    def test_a_broken_cache_costs_time_and_nothing_else(self):
        self.bake()
        cold = self.bundles()
        for kind in ("objects", "results", "outputs"):
            for path in (self.cache / "v1" / kind).rglob("*"):
                if path.is_file():
                    path.write_bytes(path.read_bytes()[:50])
            shutil.rmtree(self.out)
            self.assertEqual(len(self.baked()), 0 if kind == "outputs" else 4, kind)
            self.assertEqual(self.bundles(), cold)
        (self.folder / "file").write_text("no folder", encoding="ascii")
        self.assertEqual(len(self.baked(cache=self.folder / "file")), 4)
        self.assertIn("warning", self.stderr)

    def test_failures_are_not_cached(self):
        (self.models / "bad.off").write_text("OFF\n3 0 0\n", encoding="ascii")
        for _ in range(2):
            self.assertEqual(self.bake(code=1)["bad.off"]["outcome"], "failed")

    def test_stats_verify_and_gc_tell_what_is_there(self):
        self.bake()
        show = lambda *arguments: run("sqbake", "cache", *arguments, "--cache", self.cache, "--format", "json")
        stats = json.loads(show("stats").stdout)
        self.assertEqual((stats["results"], stats["bundles"], stats["outputs"]), (4, 4, 4))
        files = [p for p in (self.cache / "v1").rglob("*") if p.is_file()]
        self.assertEqual(stats["bytes"], sum(p.stat().st_size for p in files))
        self.assert_exit(show("verify"), 0)
        damaged = next(p for p in (self.cache / "v1" / "objects").rglob("*") if p.is_file())
        damaged.write_bytes(damaged.read_bytes() + b"x")
        result = show("verify")
        self.assert_exit(result, 1)
        self.assertIn(damaged.name, result.stdout)
        self.assert_exit(show("verify"), 0)
        self.assert_exit(show("gc", "--max-size", "1"), 0)
        stats = json.loads(show("stats").stdout)
        self.assertEqual((stats["results"], stats["bundles"], stats["outputs"], stats["bytes"]), (0, 0, 0, 0))
        missing = run("sqbake", "cache", "stats", "--cache", self.folder / "none")
        self.assert_exit(missing, 3)

    def test_verify_and_gc_do_not_pass_over_what_they_may_not_remove(self):
        self.bake()
        self.folder.chmod(0o755)
        try:
            run("sqbake", "--version", **NOBODY).check_returncode()
        except (OSError, subprocess.CalledProcessError) as problem:
            self.skipTest(f"nobody may not start sqbake here: {problem}")
        kept = [p for p in (self.cache / "v1" / "objects").rglob("*") if p.is_file()]
        kept[0].write_bytes(kept[0].read_bytes() + b"x")
        for arguments, words in ((("verify",), ["1 damaged\n", kept[0].name]), (("gc", "--max-size", "1"), ["removed 0 "])):
            result = run("sqbake", "cache", *arguments, "--cache", self.cache, **NOBODY)
            self.assert_exit(result, 3)
            for word in words:
                self.assertIn(word, result.stdout)
            self.assertRegex(result.stderr, rf"^sqbake: error: {self.cache}: \d+ files? could not be removed; ")
        self.assertTrue(all(path.exists() for path in kept))


class Environment(FolderTest):
    def test_an_empty_name_means_no_cache_for_every_command(self):
        write_off(self.folder / "ball.off", sphere(0))
        environment = {**os.environ, "HOME": str(self.folder), "XDG_CACHE_HOME": str(self.folder / "xdg")}
        environment.pop("SQMAP_CACHE_DIR", None)
        bake = ("bake", self.folder / "ball.off", *ROUGH, "-o", self.folder / "ball.h5")
        self.assert_exit(run("sqbake", *bake, env=environment), 0)
        for command in ("stats", "verify", "gc"):
            self.assert_exit(run("sqbake", "cache", command, env=environment), 0)
        before = self.files()
        for command in ("stats", "verify", "gc"):
            result = run("sqbake", "cache", command, env={**environment, "SQMAP_CACHE_DIR": ""})
            self.assert_exit(result, 2)
            self.assertIn("no cache folder: SQMAP_CACHE_DIR is set to nothing", result.stderr)
        self.assert_exit(run("sqbake", *bake, "--unit", "mm", env={**environment, "SQMAP_CACHE_DIR": ""}), 0)
        self.assertEqual(self.files(), before)


class LargeFolder(FolderTest):
    def test_a_second_run_over_380_meshes_bakes_none_and_writes_nothing(self):
        models, out = self.folder / "models", self.folder / "out"
        source = write_off(self.folder / "ball.off", sphere(0))
        for number in range(380):
            (models / f"{number:03}").mkdir(parents=True)
            (models / f"{number:03}" / "ball.off").write_bytes(source.read_bytes())
        options = (*ROUGH, "--cache", self.folder / "cache", "--format", "ndjson")
        first = run("sqbake", "bake", source, *options, "-o", self.folder / "ball.h5")
        self.assertFalse(json.loads(first.stdout.splitlines()[0])["cached"])
        times = []
        for _ in range(2):
            result = run("sqbake", "bake", models, "--recursive", *options, "--out-dir", out)
            self.assert_exit(result, 0)
            *assets, summary = map(json.loads, result.stdout.splitlines())
            self.assertEqual((len(assets), summary["ok"], summary["cached"]), (380, 380, 380))
            self.assertEqual([a["input"] for a in assets if not a["cached"]], [])
            times.append({p: (p.stat().st_mtime_ns, p.stat().st_ino) for p in out.rglob("*.h5")})
        self.assertEqual(len(times[0]), 380)
        self.assertEqual(times[0], times[1])


if __name__ == "__main__":
    unittest.main()
