# SPDX-License-Identifier: Apache-2.0
"""sqbake below make and ninja: what it read stands in the depfile, equal outputs stay untouched, the jobserver's
tokens bound its workers and come back, the clock of the build decides nothing."""
import base64
import ctypes
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import time
import unittest
from pathlib import Path

from support import ROUGH, TIMEOUT_S, FolderTest, box, command, run, sphere, write_off

from bake_isolation_test import bent, children, until

FOREIGN = Path("/usr/share/assimp/models")


def write_obj(path, mesh, material=None):
    lines = [f"mtllib {material}"] if material else []
    lines += ["v " + " ".join(map(repr, v)) for v in mesh[0]]
    lines += ["usemtl red"] if material else []
    lines += ["f " + " ".join(str(i + 1) for i in f) for f in mesh[1]]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_gltf(path, mesh, buffer):
    """A scene with its numbers in `buffer` beside it, or inside when that is None."""
    vertices = b"".join(struct.pack("<3f", *v) for v in mesh[0])
    indices = b"".join(struct.pack("<3I", *f) for f in mesh[1])
    data = vertices + indices
    if buffer is None:
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode("ascii")
    else:
        (path.parent / buffer).write_bytes(data)
        uri = buffer
    low, high = ([f(v[k] for v in mesh[0]) for k in range(3)] for f in (min, max))
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": uri, "byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(vertices)},
                        {"buffer": 0, "byteOffset": len(vertices), "byteLength": len(indices)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(mesh[0]), "type": "VEC3", "min": low,
                       "max": high},
                      {"bufferView": 1, "componentType": 5125, "count": 3 * len(mesh[1]), "type": "SCALAR"}]}),
        encoding="ascii")


class OpenedFiles:
    """Names of the files in one folder that anybody opens, told by the kernel."""
    IN_OPEN, IN_ISDIR = 0x20, 0x40000000

    def __init__(self, folder):
        libc = ctypes.CDLL(None, use_errno=True)
        self.fd = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self.fd < 0 or libc.inotify_add_watch(self.fd, os.fsencode(folder), self.IN_OPEN) < 0:
            raise unittest.SkipTest("no inotify here")

    def names(self):
        names, data = set(), b""
        try:
            while chunk := os.read(self.fd, 65536):
                data += chunk
        except BlockingIOError:
            pass
        os.close(self.fd)
        while data:
            _, mask, _, length = struct.unpack_from("iIII", data)
            if not mask & self.IN_ISDIR:
                names.add(os.fsdecode(data[16:16 + length].rstrip(b"\0")))
            data = data[16 + length:]
        return names


class Depfile(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "my models"
        self.models.mkdir()
        self.depfile = self.folder / "out.d"

    def dependencies(self):
        """Inputs of the first rule as GNU make prints them, escapes undone."""
        rule = self.depfile.read_text(encoding="utf-8").replace("\\\n", " ").splitlines()[0]
        words = re.findall(r"(?:\\.|[^\s\\])+", rule)
        self.assertTrue(words[0].endswith(":"))
        return {re.sub(r"\\(.)", r"\1", word).replace("$$", "$") for word in words[1:]}

    def check(self, mesh):
        opened = OpenedFiles(self.models)
        self.assert_exit(run("sqbake", "bake", mesh, *ROUGH, "-o", self.folder / "out.h5", "--depfile", self.depfile), 0)
        self.assertEqual(self.dependencies(), {str(self.models / name) for name in opened.names()})
        return self.dependencies()

    def test_it_names_every_file_that_was_opened(self):
        mesh = sphere(1)
        write_off(self.models / "a $b#c.off", mesh)
        write_obj(self.models / "plain.obj", mesh)
        write_obj(self.models / "red.obj", mesh, "red paint.mtl")
        (self.models / "red paint.mtl").write_text("newmtl red\nKd 1 0 0\n", encoding="ascii")
        write_obj(self.models / "lost.obj", mesh, "lost paint.mtl")
        write_gltf(self.models / "inside.gltf", mesh, None)
        write_gltf(self.models / "beside.gltf", mesh, "the numbers.bin")
        counts = {name: len(self.check(self.models / name))
                  for name in ("a $b#c.off", "plain.obj", "red.obj", "lost.obj", "inside.gltf", "beside.gltf")}
        self.assertEqual(counts, {"a $b#c.off": 1, "plain.obj": 1, "red.obj": 2, "lost.obj": 1, "inside.gltf": 1,
                                  "beside.gltf": 2})

    @unittest.skipUnless(FOREIGN.is_dir(), "needs assimp-testmodels")
    def test_it_names_buffers_and_materials_and_no_texture_whatever_the_format(self):
        write_obj(self.models / "painted.obj", sphere(1), "painted.mtl")
        (self.models / "painted.mtl").write_text("newmtl red\nmap_Kd skin.png\n", encoding="ascii")
        (self.models / "skin.png").write_bytes(b"no picture: nobody looks")
        for source in ("glTF2/BoxTextured-glTF", "glTF2/BoxTextured-glTF-Binary", "Collada/cube_triangulate.dae",
                       "FBX/box.fbx", "3MF/box.3mf", "STL/triangle.stl"):
            source = FOREIGN / source
            for file in source.iterdir() if source.is_dir() else [source]:
                shutil.copy(file, self.models)
        pictures = [file for file in self.models.iterdir() if file.suffix == ".png"]
        self.assertGreater(len(pictures), 1, "no texture is there to be left alone")
        for mesh, *others in (("painted.obj", "painted.mtl"), ("BoxTextured.gltf", "BoxTextured0.bin"),
                              ("BoxTextured.glb",), ("cube_triangulate.dae",), ("box.fbx",), ("box.3mf",),
                              ("triangle.stl",)):
            with self.subTest(mesh=mesh):
                self.assertEqual({Path(name).name for name in self.check(self.models / mesh)}, {mesh, *others})

    def test_it_names_the_files_of_the_settings(self):
        write_off(self.models / "a.off", box())
        (self.models / "sqbake.toml").write_text("[default]\nmax-parts = 2\n", encoding="ascii")
        (self.models / "a.sqbake.toml").write_text("max-parts = 1\n", encoding="ascii")
        self.assertEqual({Path(name).name for name in self.check(self.models / "a.off")},
                         {"a.off", "sqbake.toml", "a.sqbake.toml"})

    def refuse(self, code, named, *arguments):
        before = {name: (self.folder / name).read_bytes() for name in self.files()}
        result = run("sqbake", "bake", self.models / "a.off", *ROUGH, *arguments)
        self.assert_exit(result, code)
        self.assertIn(named, result.stderr)
        self.assertEqual({name: (self.folder / name).read_bytes() for name in self.files()}, before)

    def test_it_takes_the_place_of_a_depfile_only(self):
        write_off(self.models / "a.off", box())
        other = write_off(self.models / "b.off", box())
        (self.models / "a.sqbake.toml").write_text("max-parts = 1\n", encoding="ascii")
        (self.models / "link.d").symlink_to("a.off")
        (self.folder / "notes.d").write_text("buy: milk\n", encoding="ascii")
        output = self.folder / "out.h5"
        for file, code, named in ((other, 3, "not a depfile"), (self.models / "a.off", 2, "an input"),
                                  (self.models / "link.d", 2, "an input"), (output, 2, "an output"),
                                  (self.models / "a.sqbake.toml", 2, "an input"), (self.models, 3, "is a folder"),
                                  (self.folder / "none" / "out.d", 3, "no folder"),
                                  (self.folder / "notes.d", 3, "--force")):
            for dry in ((), ("-n",)):
                with self.subTest(file=file.name, dry=dry):
                    self.refuse(code, named, "-o", output, "--depfile", file, *dry)
        self.refuse(2, "an output", "--out-dir", self.folder / "new", "--depfile", self.folder / "new" / "a.h5")
        for name, options in (("notes.d", ("--force",)), ("empty.d", ())):
            if not options:
                (self.folder / name).touch()
            for again in (options, ()):
                self.assert_exit(run("sqbake", "bake", self.models / "a.off", *ROUGH, "-o", output, "--depfile",
                                     self.folder / name, *again), 0)
            self.assertIn("a.off", (self.folder / name).read_text(encoding="utf-8"))
        self.assert_exit(run("sqbake", "bake", self.models / "a.off", *ROUGH, "--out-dir", self.folder / "new",
                             "--depfile", self.folder / "new" / "a.d"), 0)


@unittest.skipUnless(shutil.which("ninja"), "needs ninja")
class Ninja(FolderTest):
    def build(self):
        result = subprocess.run(["ninja", "-C", self.folder, "-d", "explain"], capture_output=True, text=True,
                                timeout=TIMEOUT_S, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result.stdout

    def test_it_bakes_what_changed_and_stops_where_the_bytes_did_not(self):
        source = write_off(self.folder / "a b.off", box())
        sidecar = self.folder / "a b.sqbake.toml"
        sidecar.write_text("max-parts = 2\n", encoding="ascii")
        sqbake = command("sqbake")[0]
        (self.folder / "build.ninja").write_text(
            f"rule bake\n  command = {sqbake} bake $in -o $out --max-error 1% --depfile $out.d -q\n"
            "  depfile = $out.d\n  restat = 1\n  description = BAKE\n"
            "rule copy\n  command = cp $in $out\n  description = COPY\n"
            "build a.h5: bake a$ b.off\nbuild copy.h5: copy a.h5\n", encoding="ascii")
        self.assertRegex(self.build(), "(?s)BAKE.*COPY")
        self.assertIn("no work to do", self.build())
        later = time.time_ns() + 10**9
        os.utime(source, ns=(later, later))  # touched: baked, and no further
        touched = self.build()
        self.assertIn("BAKE", touched)
        self.assertNotIn("COPY", touched)
        sidecar.write_text('max-parts = 2\nunit = "mm"\n', encoding="ascii")
        os.utime(sidecar, ns=(later + 10**9, later + 10**9))
        self.assertRegex(self.build(), "(?s)BAKE.*COPY")


class Jobserver(FolderTest):
    def setUp(self):
        super().setUp()
        self.models = self.folder / "models"
        self.models.mkdir()
        for name in "abcd":
            write_off(self.models / f"{name}.off", bent(2, 1 + ord(name) % 3))
        self.arguments = ("bake", self.models, *ROUGH, "--out-dir", self.folder / "out", "-j4", "-q")

    def most_workers(self, process, sqbake):
        most = 0
        while process.poll() is None:
            most = max(most, len(children(sqbake())))
            time.sleep(0.002)
        return most

    def fifo(self, tokens):
        path = self.folder / "jobserver"
        os.mkfifo(path)
        fd = os.open(path, os.O_RDWR | os.O_NONBLOCK)
        self.addCleanup(os.close, fd)
        os.write(fd, tokens)
        return fd, {**os.environ, "MAKEFLAGS": f" -j --jobserver-auth=fifo:{path}"}

    def test_a_named_pipe_grants_its_tokens_and_gets_them_back(self):
        fd, environment = self.fifo(b"xy")
        process = subprocess.Popen(command("sqbake", *self.arguments), env=environment)
        self.assertEqual(self.most_workers(process, lambda: process.pid), 3)  # one of its own, and two
        self.assertEqual(process.returncode, 0)
        self.assertEqual(sorted(os.read(fd, 10)), sorted(b"xy"))

    def test_no_token_means_one_worker(self):
        _, environment = self.fifo(b"")
        process = subprocess.Popen(command("sqbake", *self.arguments), env=environment)
        self.assertEqual(self.most_workers(process, lambda: process.pid), 1)
        self.assertEqual(process.returncode, 0)

    def test_tokens_come_back_when_the_run_is_stopped(self):
        for name in "abcd":
            write_off(self.models / f"{name}.off", bent(5, 1))
        fd, environment = self.fifo(b"xyz")
        process = subprocess.Popen(command("sqbake", *self.arguments), env=environment)
        until(lambda: len(children(process.pid)) == 4)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=TIMEOUT_S), 143)
        self.assertEqual(sorted(os.read(fd, 10)), sorted(b"xyz"))

    @unittest.skipUnless(shutil.which("make"), "needs GNU make")
    def test_make_hands_its_jobs_to_sqbake(self):
        line = " ".join(f"'{word}'" for word in command("sqbake", *self.arguments))
        for prefix, expected in (("+exec ", 3), ("exec ", 1)):
            with self.subTest(prefix=prefix):
                (self.folder / "Makefile").write_text(f"all:\n\t{prefix}{line}\n", encoding="ascii")
                process = subprocess.Popen(["make", "-s", "-j3", "-C", self.folder], stderr=subprocess.DEVNULL)
                workers = self.most_workers(process, lambda p=process: (children(p.pid) or [0])[0])
                self.assertEqual(process.returncode, 0)
                self.assertEqual(workers, expected)


class Clock(FolderTest):
    def test_the_clock_of_the_build_decides_no_byte(self):
        source = write_off(self.folder / "a.off", box())
        for name, epoch in (("a", None), ("b", "0"), ("c", "1700000000")):
            environment = {k: v for k, v in os.environ.items() if k != "SOURCE_DATE_EPOCH"}
            if epoch is not None:
                environment["SOURCE_DATE_EPOCH"] = epoch
            self.assert_exit(run("sqbake", "bake", source, *ROUGH, "-o", self.folder / f"{name}.h5", env=environment), 0)
        bundles = {(self.folder / f"{name}.h5").read_bytes() for name in "abc"}
        self.assertEqual(len(bundles), 1)


if __name__ == "__main__":
    unittest.main()
