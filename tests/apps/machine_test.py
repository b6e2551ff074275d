# SPDX-License-Identifier: Apache-2.0
"""Bundles are the same on processors with and without fused multiply-add, which changes the C library's pow and exp."""
import os
import unittest

from support import FolderTest, run, sphere, write_off

WITHOUT_FMA = "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4"


class Machine(FolderTest):
    def baked(self, *options, **variables):
        vertices, faces = sphere(3)
        mesh = write_off(self.folder / "egg.off", ([(x, 0.7 * y, 0.4 * z + 0.1 * x * x) for x, y, z in vertices], faces))
        bundle = self.folder / "egg.h5"
        result = run("sqbake", "bake", mesh, "-o", bundle, "--force", *options, env={**os.environ, **variables})
        self.assertEqual(result.returncode, 0, result.stderr)
        return bundle.read_bytes()

    def test_bundles_do_not_depend_on_fused_multiply_add(self):
        usual = self.baked()
        self.assertEqual(self.baked(GLIBC_TUNABLES=WITHOUT_FMA), usual)
        self.assertEqual(self.baked("--no-isolation", GLIBC_TUNABLES=WITHOUT_FMA), usual)
        self.assertEqual(self.baked("--no-isolation"), usual)
        self.assertEqual(self.baked(GLIBC_TUNABLES="glibc.malloc.arena_max=2"), usual)


if __name__ == "__main__":
    unittest.main()
