# SPDX-License-Identifier: Apache-2.0
"""Bundles are the same on processors with and without fused multiply-add, which changes the C library's pow and exp."""
import os
import unittest

from support import FolderTest, run, sphere, write_off

WITHOUT_FMA = "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4"


def egg():
    """One convex part."""
    vertices, faces = sphere(3)
    return [(x, 0.7 * y, 0.4 * z + 0.1 * x * x) for x, y, z in vertices], faces


def broken_and_bent():
    """Goes through every stage: two components, one bent and cut into parts, with holes and a face turned inside out."""
    vertices, faces = sphere(3)
    faces = faces[5:]
    faces[100] = faces[100][::-1]
    ball, ball_faces = sphere(2, 0.4)
    bent = [(3 * x, y + x * x, z) for x, y, z in vertices]
    return (bent + [(x + 1.5, y - 0.5, z + 0.3) for x, y, z in ball],
            faces + [tuple(i + len(bent) for i in face) for face in ball_faces])


class Machine(FolderTest):
    def baked(self, mesh, *options, **variables):
        source, bundle = write_off(self.folder / "mesh.off", mesh), self.folder / "mesh.h5"
        result = run("sqbake", "bake", source, "-o", bundle, "--force", *options, env={**os.environ, **variables})
        self.assertEqual(result.returncode, 0, result.stderr)
        return bundle.read_bytes()

    def test_bundles_do_not_depend_on_fused_multiply_add(self):
        usual = self.baked(egg())
        self.assertEqual(self.baked(egg(), GLIBC_TUNABLES=WITHOUT_FMA), usual)
        self.assertEqual(self.baked(egg(), "--no-isolation", GLIBC_TUNABLES=WITHOUT_FMA), usual)
        self.assertEqual(self.baked(egg(), "--no-isolation"), usual)
        self.assertEqual(self.baked(egg(), GLIBC_TUNABLES="glibc.malloc.arena_max=2"), usual)

    def test_nor_do_those_of_meshes_that_are_repaired_and_cut(self):
        options = ("--max-error", "0.2%", "--conservative", "on")
        usual = self.baked(broken_and_bent(), *options)
        self.assertEqual(self.baked(broken_and_bent(), *options, GLIBC_TUNABLES=WITHOUT_FMA), usual)
        shown = run("sqinfo", "show", self.folder / "mesh.h5").stdout
        self.assertRegex(shown, r", ([2-9]|\d\d) parts in 2 segments")
        self.assertRegex(shown, r"1 flipped, 2 holes filled")


if __name__ == "__main__":
    unittest.main()
