# SPDX-License-Identifier: Apache-2.0
"""sqmap_bake() of an installed sqmap bakes what has changed and nothing else.

The project is samples/baked_project, copied, against an installation in a folder of the test.
"""
import os
import shutil
import subprocess
import unittest
from pathlib import Path

from support import BIN, FolderTest, TIMEOUT_S

SAMPLE = Path(os.environ["SQMAP_SOURCE_DIR"]) / "samples" / "baked_project"
TOYS, FURNITURE = {"cube.h5", "tetrahedron.h5"}, {"table.h5"}


class BakedProject(FolderTest):
    generator = "Ninja"

    def setUp(self):
        super().setUp()
        self.environment = {**os.environ, "SQMAP_CACHE_DIR": str(self.folder / "cache")}
        self.source, self.build, self.prefix = (self.folder / name for name in ("source", "build", "prefix"))
        self.command("cmake", "--install", BIN.parent, "--prefix", self.prefix)
        schema = Path(os.environ["SQMAP_SOURCE_DIR"]) / "apps" / "sqbake" / "bake.schema.json"
        self.assertEqual((self.prefix / "share" / "sqmap" / schema.name).read_bytes(), schema.read_bytes())
        shutil.copytree(SAMPLE, self.source)
        self.configure()
        self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)

    def command(self, *arguments):
        result = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, timeout=TIMEOUT_S,
                                check=False, env=self.environment)
        self.assert_exit(result, 0)
        return result.stdout

    def configure(self, *defines):
        self.command("cmake", "-S", self.source, "-B", self.build, "-G", self.generator,
                     f"-DCMAKE_PREFIX_PATH={self.prefix}", *defines)

    def bake_what_changed(self):
        """Builds; the names of the bundles that sqbake was called for."""
        self.output = self.command("cmake", "--build", self.build)
        return {line.split("Baking ")[1].split()[0] for line in self.output.splitlines() if "Baking " in line}

    def bundles(self):
        return {path.name: (path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino)
                for path in self.build.rglob("*.h5")}

    def mesh(self, name):
        return self.source / "meshes" / name

    def scale(self, name, factor):
        head, counts, *lines = self.mesh(name).read_text(encoding="ascii").splitlines()
        count = int(counts.split()[0])
        lines[:count] = [" ".join(str(factor * float(x)) for x in line.split()) for line in lines[:count]]
        self.mesh(name).write_text("\n".join([head, counts, *lines]) + "\n", encoding="ascii")

    def test_bakes_what_has_changed_and_nothing_else(self):
        table = (self.build / "toys.txt").read_text(encoding="ascii")
        self.assertRegex(table, r"cube.off: 1 parts, the origin at -0\.0(49|50|51)")  # half the edge of 0.1 m

        with self.subTest("nothing changed"):
            before = self.bundles()
            self.assertEqual(self.bake_what_changed(), set())
            self.assertIn("no work to do", self.output)
            self.assertEqual(self.bundles(), before)

        with self.subTest("one mesh touched"):
            self.mesh("cube.off").touch()
            self.assertEqual(self.bake_what_changed(), {"cube.h5"})
            self.assertEqual(self.bundles(), before, "its contents are the same, so it is left untouched")
            self.assertNotIn("toys.txt", self.output, "what uses the bundle need not run")
            self.assertEqual(self.bake_what_changed(), set())

        with self.subTest("one mesh changed"):
            self.scale("cube.off", 2)
            self.assertEqual(self.bake_what_changed(), {"cube.h5"})
            table = (self.build / "toys.txt").read_text(encoding="ascii")
            self.assertRegex(table, r"cube.off: 1 parts, the origin at -0\.(099|100|101)")
            self.assertEqual(self.bake_what_changed(), set())

        with self.subTest("an option of one target changed"):
            self.configure("-DTOY_ERROR=1%")
            self.assertEqual(self.bake_what_changed(), TOYS)
            self.assertEqual(self.bake_what_changed(), set())

        with self.subTest("a sidecar appeared, changed, and went"):
            sidecar = self.source / "meshes" / "table.off.sqbake.toml"
            sidecar.write_text("max-parts = 3\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), FURNITURE)
            sidecar.write_text("max-parts = 4\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), FURNITURE)
            self.assertEqual(self.bake_what_changed(), set())
            sidecar.unlink()
            self.assertEqual(self.bake_what_changed(), FURNITURE)
            self.assertEqual(self.bake_what_changed(), set())

        with self.subTest("a project file appeared above the meshes, another beside them, changed, and they went"):
            above, beside = self.source / "sqbake.toml", self.source / "meshes" / "sqbake.toml"
            above.write_text("[default]\nmax-parts = 5\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)
            beside.write_text("[default]\nmax-parts = 6\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)
            self.assertEqual(self.bake_what_changed(), set())
            above.write_text("[default]\nmax-parts = 7\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), set(), "the nearest one holds")
            beside.write_text("[default]\nmax-parts = 8\n", encoding="ascii")
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)
            beside.unlink()
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)
            above.unlink()
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)
            self.assertEqual(self.bake_what_changed(), set())

        with self.subTest("another sqbake"):
            (self.prefix / "bin" / "sqbake").touch()
            self.assertEqual(self.bake_what_changed(), TOYS | FURNITURE)

        with self.subTest("a mesh that cannot be baked"):
            self.mesh("cube.off").write_text("OFF\n", encoding="ascii")
            before = self.bundles()
            result = subprocess.run(["cmake", "--build", str(self.build)], capture_output=True, text=True,
                                    timeout=TIMEOUT_S, check=False, env=self.environment)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn("cube.off", result.stdout + result.stderr)
            self.assertEqual(self.bundles(), before, "the earlier bundle stays")


class Arguments(FolderTest):
    CASES = [
        ("TARGET x", "needs TARGET name and MESHES"),
        ("MESHES a.off", "needs TARGET name and MESHES"),
        ("x TARGET x MESHES a.off", "unknown arguments x"),
        ("TARGET x MESHES a.off OPTIONZ --unit mm", "OPTIONZ, which has no extension"),
        ("TARGET x MESHES a.off sub/a.off", "two meshes called a"),
    ]

    def test_wrong_arguments_stop_the_configuration_and_say_why(self):
        function = Path(os.environ["SQMAP_SOURCE_DIR"]) / "scripts" / "cmake" / "SqmapBake.cmake"
        for arguments, words in self.CASES:
            with self.subTest(arguments):
                (self.folder / "CMakeLists.txt").write_text(
                    "cmake_minimum_required(VERSION 3.25)\nproject(wrong LANGUAGES NONE)\n"
                    f"include({function})\nadd_executable(sqmap::sqbake IMPORTED)\nsqmap_bake({arguments})\n",
                    encoding="utf-8")
                result = subprocess.run(["cmake", "-S", self.folder, "-B", self.folder / "build"], capture_output=True,
                                        text=True, check=False)
                self.assertNotEqual(result.returncode, 0)
                self.assertIn(words, " ".join(result.stderr.split()))


if __name__ == "__main__":
    unittest.main()
