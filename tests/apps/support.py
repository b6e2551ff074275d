# SPDX-License-Identifier: Apache-2.0
"""What the tests of the programs share: running them, and writing small meshes whose answers are known."""
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

BIN = Path(os.environ["SQMAP_BIN_DIR"])
# What is tested is the baker, not what it kept; tests of the cache name theirs.
os.environ["SQMAP_CACHE_DIR"] = ""
TIMEOUT_S = 240
# Options of run() for a user who owns nothing.
NOBODY = {"user": 65534, "group": 65534, "extra_groups": ()}
# Enough where a test is not about accuracy.
ROUGH = ("--max-error", "1%")


def command(program, *arguments):
    return [str(BIN / program), *map(str, arguments)]


def run(program, *arguments, **options):
    """Runs a program to its end; output as text."""
    if "input" not in options:
        options["stdin"] = subprocess.DEVNULL
    return subprocess.run(command(program, *arguments), capture_output="stdout" not in options, text=True,
                          timeout=TIMEOUT_S, check=False, **options)


def sphere(subdivisions=3, radius=1.0):
    """Icosphere: vertices on the sphere, faces counter-clockwise seen from outside."""
    g = (1 + math.sqrt(5)) / 2
    vertices = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
             (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5),
             (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(subdivisions):
        middle, finer = {}, []

        def between(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(vertices)
                vertices.append(tuple((p + q) / 2 for p, q in zip(vertices[a], vertices[b])))
            return middle[key]

        for a, b, c in faces:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return [tuple(radius * x / math.hypot(*v) for x in v) for v in vertices], faces


def box(x=1.0, y=1.0, z=1.0):
    """Box centred at the origin with these edge lengths, 12 triangles."""
    vertices = [(x * (i & 1) - x / 2, y * (i >> 1 & 1) - y / 2, z * (i >> 2) - z / 2) for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return vertices, [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]


def off_text(vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(repr(x) for x in v) for v in vertices]
    lines += [" ".join(map(str, (len(f), *f))) for f in faces]
    return "\n".join(lines) + "\n"


def write_off(path, mesh):
    Path(path).write_text(off_text(*mesh), encoding="ascii")
    return Path(path)


class FolderTest(unittest.TestCase):
    """A test with a folder of its own, `self.folder`, gone afterwards."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="sqmap-")
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)

    def files(self):
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.rglob("*") if p.is_file())

    def assert_exit(self, result, code):
        self.assertEqual(result.returncode, code, f"stdout:\n{result.stdout}\nstderr:\n{result.stderr}")

    def bake(self, mesh, name="mesh", *options):
        """Bakes a mesh in the test's folder; the bundle."""
        source = write_off(self.folder / f"{name}.off", mesh)
        bundle = self.folder / f"{name}.h5"
        self.assert_exit(run("sqbake", "bake", source, "-o", bundle, *options), 0)
        return bundle
