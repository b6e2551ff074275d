# SPDX-License-Identifier: Apache-2.0
"""What sqbake does with inputs and outputs that cannot work: exit code, a message with the name, nothing left."""
import os
import resource
import unittest
from pathlib import Path

from support import ROUGH, FolderTest, box, off_text, run, sphere, write_off

NAN_VERTEX = off_text([(0, 0, 0), (1, 0, 0), (0, float("nan"), 0), (0, 0, 1)], [(0, 1, 2), (0, 1, 3)])


class BadInput(FolderTest):
    CASES = [
        ("unknown.xyz", off_text(*box()), 4),
        ("noextension", off_text(*box()), 4),
        ("empty.off", "", 4),
        ("empty.stl", "", 4),
        ("nan.off", NAN_VERTEX, 4),
        ("nofaces.off", off_text(box()[0], []), 4),
        ("noarea.off", off_text([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]), 4),
        ("short.off", off_text(*box())[:-20], 4),
        ("range.off", off_text(box()[0], [(0, 1, 99)]), 4),
        ("huge.off", "OFF\n4000000000 4000000000 0\n0 0 0\n", 4),
        ("words.obj", "this is not a mesh\n", 4),
        ("words.glb", "this is not a mesh\n", 4),
        ("other.glb", off_text(*box()), 4),  # a name leads to the readers of its format alone
        ("other.obj", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                      "endloop\nendfacet\nendsolid x\n", 4),
    ]

    def check(self, result, name, code):
        self.assert_exit(result, code)
        self.assertTrue(result.stderr.startswith("sqbake: error: "), result.stderr)
        self.assertIn(name, result.stderr)
        self.assertEqual(result.stdout, "")

    def test_a_bad_mesh_is_named_and_leaves_no_output(self):
        for name, text, code in self.CASES:
            with self.subTest(name=name):
                source = self.folder / name
                source.write_text(text, encoding="ascii")
                self.check(run("sqbake", "bake", source, "-o", self.folder / "out.h5"), name, code)
                self.check(run("sqbake", "check", source), name, code)
                self.assertEqual(self.files(), [name])
                source.unlink()

    def test_a_message_names_the_file_once_and_where_it_is(self):
        (self.folder / "below").mkdir()
        source = self.folder / "below" / "short.off"
        source.write_text(off_text(*box())[:-20], encoding="ascii")
        for arguments in (("check", source), ("bake", source, "-o", self.folder / "out.h5")):
            message = run("sqbake", *arguments).stderr
            self.assertTrue(message.startswith(f"sqbake: error: {source}"), message)
            self.assertEqual(message.count("short.off"), 1, message)

    def test_more_than_one_face_a_line_is_told_as_what_it_may_be(self):
        lines = off_text(*box()).splitlines()
        source = self.folder / "joined.off"
        for joined in (lines[:2] + [" ".join(lines[2:10])] + lines[10:], lines[:10] + [" ".join(lines[10:])]):
            source.write_text("\n".join(joined) + "\n", encoding="ascii")
            result = run("sqbake", "check", source)
            self.check(result, "joined.off", 4)
            self.assertIn("more than one vertex or face a line", result.stderr)

    def test_a_line_feed_in_a_name_forges_no_line(self):
        (self.folder / "models").mkdir()
        (self.folder / "models" / "a\nb.off").write_text("OFF\n", encoding="ascii")
        (self.folder / "models" / "c.off").write_text("OFF\n", encoding="ascii")
        result = run("sqbake", "bake", self.folder / "models", "--out-dir", self.folder / "out")
        self.assertEqual(result.returncode, 1)
        self.assertEqual([line.split()[0] for line in result.stdout.splitlines()], ["asset", "a\\x0ab.off", "c.off"])
        dry = run("sqbake", "bake", self.folder / "models", "--out-dir", self.folder / "out", "-n")
        self.assertEqual(len(dry.stdout.splitlines()), 2, dry.stdout)

    def test_a_missing_file_is_a_file_error(self):
        self.check(run("sqbake", "bake", self.folder / "none.off", "-o", self.folder / "out.h5"), "none.off", 3)
        self.check(run("sqbake", "check", self.folder / "none.off"), "none.off", 3)

    def test_a_folder_called_like_a_mesh_is_a_folder(self):
        folder = self.folder / "x.obj"
        folder.mkdir()
        self.check(run("sqbake", "bake", folder, "-o", self.folder / "out.h5"), "x.obj", 2)
        self.check(run("sqbake", "bake", folder, "--out-dir", self.folder / "out"), "x.obj", 4)
        self.check(run("sqbake", "check", folder), "x.obj", 3)
        self.assertEqual(self.files(), [])

    def test_a_pipe_is_refused_and_not_waited_for(self):
        pipe = self.folder / "pipe.off"
        os.mkfifo(pipe)
        self.check(run("sqbake", "bake", pipe, "-o", self.folder / "out.h5"), "pipe.off", 3)

    def test_a_file_name_cannot_forge_a_line_of_the_log(self):
        result = run("sqbake", "bake", self.folder / "a\nsqbake: error: b\033[2J.off", "-o", self.folder / "out.h5")
        self.assert_exit(result, 3)
        self.assertEqual(result.stderr.count("\n"), 1)
        self.assertNotIn("\033", result.stderr)


class BadOutput(FolderTest):
    def setUp(self):
        super().setUp()
        self.source = write_off(self.folder / "box.off", box())

    def refuse(self, code, named, *arguments, **options):
        before = self.files()
        result = run("sqbake", "bake", *arguments, **options)
        self.assert_exit(result, code)
        self.assertIn(named, result.stderr)
        self.assertEqual(self.files(), before)
        return result

    def test_an_output_is_needed(self):
        self.refuse(2, "--out-dir", self.source)

    def test_a_bundle_ends_in_h5(self):
        self.refuse(2, "box.glb", self.source, "-o", self.folder / "box.glb")

    def test_one_output_takes_one_input(self):
        self.refuse(2, "-o", self.source, self.source, "-o", self.folder / "box.h5")

    def test_two_inputs_for_one_bundle_are_refused_before_work(self):
        other = self.folder / "box.obj"
        other.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n", encoding="ascii")
        result = self.refuse(2, "box.obj", self.source, other, "--out-dir", self.folder / "out")
        self.assertIn("box.off", result.stderr)
        self.assert_exit(run("sqbake", "bake", self.source, other, "--out-dir", self.folder / "out",
                             "--keep-extension", *ROUGH), 0)
        self.assertEqual([f for f in self.files() if f.startswith("out")], ["out/box.obj.h5", "out/box.off.h5"])

    def test_a_missing_folder_is_named(self):
        self.refuse(3, "nowhere", self.source, "-o", self.folder / "nowhere" / "box.h5")

    def test_a_file_is_no_output_folder(self):
        self.refuse(3, "box.off", self.source, "--out-dir", self.source)

    def test_an_output_that_is_a_folder_is_refused(self):
        (self.folder / "box.h5").mkdir()
        self.refuse(3, "box.h5", self.source, "-o", self.folder / "box.h5", "--force")

    def test_a_foreign_file_is_kept_unless_forced(self):
        output = self.folder / "box.h5"
        output.write_text("somebody's data", encoding="ascii")
        self.refuse(3, "--force", self.source, "-o", output)
        self.assertEqual(output.read_text(encoding="ascii"), "somebody's data")
        self.assert_exit(run("sqbake", "bake", self.source, "-o", output, "--force", *ROUGH), 0)
        self.assert_exit(run("sqinfo", "validate", output), 0)

    def test_an_own_bundle_is_replaced_without_force(self):
        output = self.folder / "box.h5"
        self.assert_exit(run("sqbake", "bake", self.source, "-o", output, *ROUGH), 0)
        first = output.read_bytes()
        self.assert_exit(run("sqbake", "bake", self.source, "-o", output, "--unit", "mm", *ROUGH), 0)
        self.assertNotEqual(output.read_bytes(), first)

    def test_a_failed_bake_keeps_the_earlier_bundle(self):
        output = self.folder / "box.h5"
        self.assert_exit(run("sqbake", "bake", self.source, "-o", output, *ROUGH), 0)
        first = output.read_bytes()
        self.source.write_text(NAN_VERTEX, encoding="ascii")
        self.assert_exit(run("sqbake", "bake", self.source, "-o", output), 4)
        self.assertEqual(output.read_bytes(), first)

    def test_a_full_disk_leaves_no_file(self):
        def limit_file_size():
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

        self.refuse(3, "box.h5", self.source, "-o", self.folder / "box.h5", preexec_fn=limit_file_size)

    def test_results_that_cannot_be_printed_are_an_error(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            result = run("sqbake", "check", self.source, stdout=full, stderr=-1)
            self.assertEqual(result.returncode, 3)
            self.assertIn("standard output", result.stderr)

    def test_a_size_that_looks_like_a_wrong_unit_is_mentioned(self):
        source = write_off(self.folder / "far.off", box(5000, 5000, 5000))
        self.assertIn("--unit", run("sqbake", "check", source).stderr)
        self.assertEqual(run("sqbake", "check", source, "--unit", "mm").stderr, "")


class Check(FolderTest):
    def test_counts_what_is_wrong_with_the_mesh(self):
        vertices, faces = sphere(1)
        faces = [faces[0][::-1], *faces[1:], faces[5]]  # one turned round, one twice
        source = write_off(self.folder / "bad.off", (vertices, faces))
        text = run("sqbake", "check", source, "--format", "json").stdout
        self.assertIn('"duplicate_faces": 1', text)
        self.assertIn('"flipped_faces": 1', text)
        self.assertIn('"is_closed": true', text)
        self.assertEqual(self.files(), [Path("bad.off").name])

    def test_repair_none_leaves_the_mesh_open(self):
        vertices, faces = box()
        source = write_off(self.folder / "open.off", (vertices, faces[2:]))
        self.assertIn('"is_closed": true', run("sqbake", "check", source, "--format", "json").stdout)
        self.assertIn('"is_closed": false', run("sqbake", "check", source, "--repair", "none", "--format", "json").stdout)


if __name__ == "__main__":
    unittest.main()
