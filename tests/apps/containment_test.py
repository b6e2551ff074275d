# SPDX-License-Identifier: Apache-2.0
"""The bounding promise, checked by scripts/check_containment, and that this check can fail."""
import json
import os
import re
import subprocess
import unittest

from support import TIMEOUT_S, FolderTest, run, sphere, write_off

PYTHON = "/usr/bin/python3"
SCRIPT = os.environ["SQMAP_CHECK_CONTAINMENT"]
HAS_LIBRARIES = subprocess.run([PYTHON, "-c", "import h5py, numpy"], capture_output=True, check=False).returncode == 0


class Checked(FolderTest):
    def check(self, bundle, mesh):
        return subprocess.run([PYTHON, SCRIPT, bundle, mesh], capture_output=True, text=True, timeout=TIMEOUT_S,
                              check=False)


@unittest.skipUnless(HAS_LIBRARIES, "python3-h5py and python3-numpy are not installed")
class Containment(Checked):
    def bent(self, stretch):
        vertices, faces = sphere(3)
        return [(stretch * x, y + x * x, z * (1 + 0.3 * x)) for x, y, z in vertices], faces

    def test_every_vertex_and_surface_point_is_inside_a_superquadric(self):
        bundle = self.bake(self.bent(3), "bent", "--unit", "cm", "--up", "y", "--max-parts", "6")
        result = self.check(bundle, self.folder / "bent.off")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn(", 0 outside", result.stdout)

    def test_a_larger_mesh_is_found_to_stick_out(self):
        bundle = self.bake(self.bent(3), "bent")
        larger = write_off(self.folder / "larger.off", self.bent(3.1))
        self.assertEqual(self.check(bundle, larger).returncode, 1)

    def test_another_mesh_is_refused(self):
        bundle = self.bake(self.bent(3), "bent")
        other = write_off(self.folder / "other.off", sphere(2))
        self.assertEqual(self.check(bundle, other).returncode, 4)


@unittest.skipUnless(HAS_LIBRARIES and os.environ.get("SQMAP_MESH_DIR"), "SQMAP_MESH_DIR is not set")
class SampleMeshes(Checked):
    def test_a_real_mesh_is_bounded_by_superquadrics_that_hold_little_else(self):
        mesh = os.path.join(os.environ["SQMAP_MESH_DIR"], "elephant.off")
        bundle = self.folder / "elephant.h5"
        self.assert_exit(run("sqbake", "bake", mesh, "-o", bundle, "--max-parts", "16"), 0)
        result = self.check(bundle, mesh)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        union = float(re.search(r"is ([\d.]+) times the mesh's volume", result.stdout)[1])
        self.assertGreater(union, 1)
        self.assertLess(union, 1.85)

    def test_tapers_hold_it_more_tightly(self):
        mesh = os.path.join(os.environ["SQMAP_MESH_DIR"], "elephant.off")
        bundle = self.folder / "tapered.h5"
        self.assert_exit(run("sqbake", "bake", mesh, "-o", bundle, "--max-parts", "16", "--taper", "on"), 0)
        result = self.check(bundle, mesh)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertLess(float(re.search(r"is ([\d.]+) times the mesh's volume", result.stdout)[1]), 1.65)

    def test_bends_hold_it_too(self):
        mesh = os.path.join(os.environ["SQMAP_MESH_DIR"], "elephant.off")
        bundle = self.folder / "bent.h5"
        self.assert_exit(run("sqbake", "bake", mesh, "-o", bundle, "--bend", "on"), 0)
        parts = json.loads(run("sqinfo", "show", bundle, "--format", "json").stdout)["parts"]
        self.assertGreater(sum(any(part["bend_per_m"]) for part in parts), 2)
        result = self.check(bundle, mesh)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
