# SPDX-License-Identifier: Apache-2.0
"""sqinfo export: scenes, segmentations and pictures, read back by readers written here from the specifications."""
import json
import math
import struct
import unittest
import zlib

from support import ROUGH, FolderTest, box, run, sphere, write_off

COMPONENTS = {5126: ("f", 4), 5125: ("I", 4)}
WIDTH = {"SCALAR": 1, "VEC3": 3}


def read_glb(content):
    """JSON and accessor values of a binary glTF, every length checked."""
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    chunks, place = [], 12
    while place < length:
        size, kind = struct.unpack_from("<I4s", content, place)
        assert size % 4 == 0
        chunks.append((kind, content[place + 8:place + 8 + size]))
        place += 8 + size
    assert place == length
    assert [kind for kind, _ in chunks] == [b"JSON", b"BIN\0"]
    scene, buffer = json.loads(chunks[0][1]), chunks[1][1]
    assert 0 <= len(buffer) - scene["buffers"][0]["byteLength"] < 4
    values = []
    for accessor in scene["accessors"]:
        view = scene["bufferViews"][accessor["bufferView"]]
        code, size = COMPONENTS[accessor["componentType"]]
        width = WIDTH[accessor["type"]]
        assert accessor["count"] * width * size == view["byteLength"]
        assert view["byteOffset"] + view["byteLength"] <= scene["buffers"][0]["byteLength"]
        flat = struct.unpack_from(f"<{accessor['count'] * width}{code}", buffer, view["byteOffset"])
        rows = [flat[i:i + width] for i in range(0, len(flat), width)]
        if "min" in accessor:
            assert tuple(accessor["min"]) == tuple(map(min, zip(*rows)))
            assert tuple(accessor["max"]) == tuple(map(max, zip(*rows)))
        values.append(rows)
    return scene, values


def read_png(content):
    """Rows of RGB pixels of an 8-bit RGB PNG, checksums checked."""
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    place, data, size = 8, b"", None
    while place < len(content):
        length, kind = struct.unpack_from(">I4s", content, place)
        body = content[place + 8:place + 8 + length]
        assert struct.unpack_from(">I", content, place + 8 + length)[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", body)
            assert size[2:4] == (8, 2) and size[6] == 0
        if kind == b"IDAT":
            data += body
        place += 12 + length
    width, height = size[:2]
    lines, stride = zlib.decompress(data), 3 * width
    assert len(lines) == height * (stride + 1)
    rows, above = [], bytes(stride)
    for k in range(height):
        kind, line = lines[k * (stride + 1)], bytearray(lines[k * (stride + 1) + 1:(k + 1) * (stride + 1)])
        for i in range(stride):
            left, up = line[i - 3] if i >= 3 else 0, above[i]
            corner = above[i - 3] if i >= 3 else 0
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda x, g=guess: abs(x - g))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append([tuple(line[i:i + 3]) for i in range(0, stride, 3)])
        above = line
    return rows


def volume(points, triangles):
    """Signed volume, positive when the triangles are counter-clockwise seen from outside."""
    total = 0.0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[a], points[b], points[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


class Scene(FolderTest):
    def export(self, bundle, *options):
        scene = self.folder / "scene.glb"
        self.assert_exit(run("sqinfo", "export", bundle, "--glb", scene, *options), 0)
        return read_glb(scene.read_bytes())

    @staticmethod
    def mesh(scene, values, node):
        primitive = scene["meshes"][node["mesh"]]["primitives"][0]
        flat = [row[0] for row in values[primitive["indices"]]]
        points = values[primitive["attributes"]["POSITION"]]
        assert max(flat) == len(points) - 1
        normals = values[primitive["attributes"]["NORMAL"]] if "NORMAL" in primitive["attributes"] else []
        return points, [tuple(flat[i:i + 3]) for i in range(0, len(flat), 3)], normals

    def test_the_drawn_surface_is_the_sphere_that_was_baked(self):
        scene, values = self.export(self.bake(sphere(4), "ball"))
        names = [node["name"] for node in scene["nodes"]]
        self.assertEqual(names[1:], ["superquadrics", "surface", "part 00", "part 00"])
        children = {n["name"]: n["children"] for n in scene["nodes"] if "children" in n}
        for group in ("superquadrics", "surface"):
            (child,) = children[group]
            node = scene["nodes"][child]
            points, triangles, normals = self.mesh(scene, values, node)
            # part frame: the centre of a sphere's superquadric is close to the origin
            for p, n in zip(points, normals):
                self.assertAlmostEqual(math.hypot(*p), 1, delta=0.02)
                self.assertAlmostEqual(math.hypot(*n), 1, places=4)
                self.assertGreater(sum(a * b for a, b in zip(p, n)), 0.95)
            self.assertAlmostEqual(volume(points, triangles), 4 / 3 * math.pi, delta=0.06)
        materials = [m.get("alphaMode") for m in scene["materials"]]
        self.assertEqual(materials, ["BLEND", None])

    def test_up_is_up(self):
        """The root turns the object's z to glTF's y."""
        scene, _ = self.export(self.bake(box(), "box", *ROUGH))
        x, y, z, w = scene["nodes"][scene["scenes"][0]["nodes"][0]]["rotation"]
        turned_z = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
        for got, expected in zip(turned_z, (0, 1, 0)):
            self.assertAlmostEqual(got, expected)

    def test_the_source_is_drawn_where_the_bundle_has_it(self):
        mesh = box(100, 200, 300)
        bundle = self.bake(mesh, "box", "--unit", "mm", "--up", "y", *ROUGH)
        scene, values = self.export(bundle, "--source", self.folder / "box.off")
        (node,) = [n for n in scene["nodes"] if n["name"] == "source"]
        points, triangles, _ = self.mesh(scene, values, node)
        extent = [max(p[a] for p in points) - min(p[a] for p in points) for a in range(3)]
        for got, expected in zip(extent, (0.1, 0.3, 0.2)):
            self.assertAlmostEqual(got, expected, places=6)
        self.assertAlmostEqual(volume(points, triangles), 0.006, places=7)

    def test_another_mesh_as_source_is_mentioned(self):
        bundle = self.bake(box(), "box", *ROUGH)
        other = write_off(self.folder / "other.off", box(2, 2, 2))
        result = run("sqinfo", "export", bundle, "--glb", self.folder / "s.glb", "--source", other)
        self.assert_exit(result, 0)
        self.assertIn("not the file the bundle was baked from", result.stderr)

    def test_an_input_is_never_overwritten(self):
        bundle = self.bake(box(), "box", *ROUGH)
        before = bundle.read_bytes()
        self.assert_exit(run("sqinfo", "export", bundle, "--glb", bundle), 2)
        self.assert_exit(run("sqinfo", "export", bundle, "--seg", bundle), 2)
        self.assertEqual(bundle.read_bytes(), before)

    def test_an_output_that_cannot_be_written_is_named(self):
        bundle = self.bake(box(), "box", *ROUGH)
        before = self.files()
        for option in ("--glb", "--seg", "--maps"):
            result = run("sqinfo", "export", bundle, option, bundle / "x")
            self.assert_exit(result, 3)
            self.assertIn(str(bundle / "x"), result.stderr)
        self.assertEqual(self.files(), before)


class Segmentation(FolderTest):
    def test_components_have_labels_of_their_own_in_the_order_of_the_faces(self):
        (va, fa), (vb, fb) = box(), sphere(1)
        both = (va + [(x + 5, y, z) for x, y, z in vb], fa + [tuple(i + len(va) for i in f) for f in fb])
        bundle = self.bake(both, "two", *ROUGH)
        for level in ("segments", "parts"):
            path = self.folder / f"{level}.seg"
            self.assert_exit(run("sqinfo", "export", bundle, "--seg", path, "--level", level), 0)
            labels = [int(line) for line in path.read_text(encoding="ascii").splitlines()]
            self.assertEqual(len(labels), len(fa) + len(fb))
            first, second = set(labels[:len(fa)]), set(labels[len(fa):])
            self.assertTrue(first.isdisjoint(second), labels)
            self.assertGreaterEqual(min(labels), 0)

    def test_a_dropped_face_takes_the_label_of_the_one_before(self):
        vertices, faces = box()
        bundle = self.bake((vertices, [(0, 0, 1), *faces[:6], (2, 2, 2), *faces[6:]]), "flat", *ROUGH, "--max-parts", "1")
        path = self.folder / "flat.seg"
        self.assert_exit(run("sqinfo", "export", bundle, "--seg", path), 0)
        self.assertEqual(path.read_text(encoding="ascii"), "0\n" * 14)


class Maps(FolderTest):
    def test_each_part_has_a_picture_of_its_map_and_a_legend(self):
        bundle = self.bake(box(1, 1, 2), "box")
        pictures = self.folder / "maps"
        self.assert_exit(run("sqinfo", "export", bundle, "--maps", pictures), 0)
        legend = json.loads((pictures / "legend.json").read_text(encoding="ascii"))
        shown = json.loads(run("sqinfo", "show", bundle, "--format", "json").stdout)
        self.assertEqual(len(legend["maps"]), len(shown["parts"]))
        for entry, part in zip(legend["maps"], shown["parts"]):
            rows = read_png((pictures / entry["file"]).read_bytes())
            self.assertEqual((len(rows), len(rows[0])), (part["map"]["rows"], part["map"]["cols"]))
            self.assertEqual(entry["depth_at_1_m"], part["map"]["depth_most_m"])
            pixels = [p for row in rows for p in row]
            self.assertEqual(pixels.count(tuple(legend["miss_rgb"])), part["map"]["misses"])
            self.assertEqual(pixels.count(tuple(legend["start_inside_rgb"])), part["map"]["start_inside"])
            self.assertIn((253, 231, 37), pixels)  # the deepest node is at the end of the colours
            self.assertIn((68, 1, 84), pixels)

    def test_a_coarser_level_is_a_smaller_picture(self):
        bundle = self.bake(sphere(3), "ball")
        sizes = []
        for level in (0, 1):
            pictures = self.folder / f"maps{level}"
            self.assert_exit(run("sqinfo", "export", bundle, "--maps", pictures, "--map-level", level), 0)
            rows = read_png((pictures / "part_00.png").read_bytes())
            sizes.append((len(rows), len(rows[0])))
        self.assertEqual(sizes[1], ((sizes[0][0] + 1) // 2, sizes[0][1] // 2))


if __name__ == "__main__":
    unittest.main()
