# SPDX-License-Identifier: Apache-2.0
"""Who may include whom, where third-party libraries may appear, and the licence in each file's first line.

findings(root) lists every breach as (path, line, text). The tables below are the architecture: change them only
together with a reason.
"""
import os
import re
from fnmatch import fnmatch

# First pattern that matches a path decides which of our own modules ("sqmap/MODULE/...") it may include.
MODULES = [
    ("formats/include/sqmap/asset/*", {"asset"}),
    ("formats/*", {"asset", "io"}),
    ("libruntime/src/c_api_load.cpp", {"asset", "io", "runtime", "sqmap.h"}),  # of the library sqmap_c
    ("libruntime/src/c_api*", {"asset", "runtime", "sqmap.h"}),
    ("libruntime/*", {"asset", "runtime"}),
    ("libbake/include/*", {"asset", "bake"}),
    ("libbake/*", {"asset", "bake", "runtime"}),
    ("apps/sqbake/*", {"asset", "io", "runtime", "bake"}),
    ("apps/sqbench/*", {"asset", "io", "runtime", "bake"}),
    ("apps/*", {"asset", "io", "runtime"}),
    ("samples/*", {"asset", "io", "runtime"}),
    ("tests/formats/*", {"asset", "io"}),
    ("tests/runtime/*", {"asset", "io", "runtime"}),
    ("tests/architecture/*", {"asset", "io", "runtime"}),
    ("tests/*", {"asset", "io", "runtime", "bake"}),
]

# Headers that are not public: who may include them, by whatever path.
PRIVATE_HEADERS = [
    ("formats/src/*", ["formats/src/*", "tests/formats/*", "tests/fuzz/*"]),
    ("libruntime/src/packing.inl", ["libruntime/src/*", "apps/sqbench/grid_kernels.cpp"]),  # no weak rival
    ("libruntime/src/*", ["libruntime/src/*", "tests/runtime/*"]),
    ("libbake/src/*", ["libbake/src/*", "tests/bake/*"]),
    ("apps/common/*", ["apps/*", "tests/apps/*"]),
    ("apps/sqbake/report/*", ["apps/sqbake/*", "apps/sqbench/drawings.cpp", "tests/apps/*"]),
    ("apps/sqbake/*", ["apps/sqbake/*", "tests/apps/*"]),
    ("apps/sqinfo/*", ["apps/sqinfo/*", "tests/apps/*"]),
    ("apps/sqsim/*", ["apps/sqsim/*", "tests/apps/*", "tests/fuzz/*"]),
    ("apps/sqbench/*", ["apps/sqbench/*", "tests/apps/*"]),
    ("tests/*", ["tests/*"]),
]

VERSIONS = "apps/sqbench/machine.cpp"  # says with which versions of the peers it was built

# Third-party libraries: how an include of theirs begins, and the only files that may hold one.
THIRD_PARTY = {
    "Boost.Multiprecision": (("boost/multiprecision/",), ["tests/hard/reference.hpp"]),
    "CGAL": (("CGAL/", "boost/"), ["libbake/src/heat_method.cpp", "libbake/src/hull.cpp",
                                   "apps/sqbench/peer_cgal.cpp", VERSIONS]),
    "Ceres": (("ceres/", "glog/"), ["libbake/src/fit_surface.cpp"]),
    "Eigen": (("Eigen/", "unsupported/"), ["libbake/src/fit.cpp", "libbake/src/fit_model.cpp",
                                           "libbake/src/fit_model.hpp", "libbake/src/fit_starts.cpp",
                                           "libbake/src/fit_volume.cpp", "libbake/src/fit_bend.cpp", "libbake/src/heat_method.cpp",
                                           "libbake/src/partition.cpp"]),
    "assimp": (("assimp/",), ["libbake/src/scene_reader.cpp", "apps/common/source_mesh.cpp"]),
    "Embree": (("embree",), ["libbake/src/mesh_boxes.cpp", "apps/sqbench/embree_closest.cpp", VERSIONS]),
    "Highway": (("hwy/",), ["apps/sqbench/grid_kernels.cpp", "libruntime/src/engine.cpp", VERSIONS]),
    "FCL": (("fcl/",), ["apps/sqbench/peer_fcl.cpp", VERSIONS]),
    "TBB": (("tbb/", "oneapi/"), ["libbake/src/*.cpp", "apps/sqbake/worker_pool.cpp",
                                  "tests/bake/decompose_test.cpp", "tests/bake/fit_stress.cpp",
                                  "tests/support/certainty_points.hpp"]),
    "HDF5": (("hdf5", "H5"), ["formats/src/hdf5_handle.cpp", "formats/src/writer.cpp",
                              "tests/formats/hostile_test.cpp"]),
    "zlib": (("zlib.h",), ["formats/src/chunk.cpp", "tests/formats/hostile_test.cpp"]),
    "xxHash": (("xxh",), ["formats/src/digest.cpp", "libbake/src/mesh_io.cpp", "apps/common/source_mesh.cpp",
                          "apps/sqbake/cache/content_hash.cpp", "tests/formats/bundle_bytes.cpp"]),
    "JSON": (("nlohmann/",), ["apps/*.cpp", "apps/common/json_text.hpp", "libbake/src/options.cpp"]),
    "toml++": (("toml++/",), ["apps/sqbake/toml_files.cpp"]),
    "CLI11, fmt": (("CLI/", "fmt/"), ["apps/*.cpp", "apps/common/choices.hpp"]),
    "Bullet": (("Bullet", "LinearMath/", "btBullet"), ["apps/sqsim/cloth.cpp", "apps/sqbench/peer_gimpact.cpp",
                                                            "apps/sqbench/peer_hulls.cpp", VERSIONS]),
    "HACD": (("HACD/",), ["apps/sqbench/peer_hulls.cpp"]),
    "NanoVDB": (("nanovdb/",), ["apps/sqbench/peer_nanovdb.cpp", VERSIONS]),
    "OpenVDB": (("openvdb/",), ["apps/sqbench/peer_openvdb.cpp", VERSIONS]),
    "libpng": (("png.h",), ["apps/common/png_bytes.cpp"]),
    "RapidCheck": (("rapidcheck/",), ["tests/*/*_test.cpp", "tests/support/branches.hpp"]),
    "GoogleTest": (("gtest/", "gmock/"), ["tests/*_test.cpp", "tests/support/branches.hpp"]),
}
# The system's own interface; files, signals and terminals. None in a public header.
POSIX = re.compile(r"((sys|linux)/\w+|unistd|fcntl|poll|sched|spawn|malloc)\.h$")

GPL = "GPL-3.0-or-later"
APACHE = "Apache-2.0"
GPL_PATHS = ["libbake/*", "apps/sqbake/*", "apps/sqbench/*", "tests/bake/*"]
SPDX_NAMES = ["*.cpp", "*.hpp", "*.c", "*.h", "*.py", "*.cmake", "*.in", "CMakeLists.txt"]
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SKIPPED_FOLDERS = re.compile(r"(\.git|build.*|__pycache__)$")


def tree(root):
    """Paths of all files below root, relative, with forward slashes, sorted."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(f for f in folders if not SKIPPED_FOLDERS.match(f))
        for name in sorted(names):
            yield os.path.relpath(os.path.join(folder, name), root).replace(os.sep, "/")


def matches(path, patterns):
    return any(fnmatch(path, pattern) for pattern in patterns)


def lines_of(root, path):
    with open(os.path.join(root, path), encoding="utf-8", errors="replace") as file:
        return file.read().splitlines()


def includes_of(lines):
    for number, line in enumerate(lines, 1):
        if match := INCLUDE.match(line):
            yield number, match[1] == '"', match[2]


def resolve(path, include, files):
    """File of the tree that a quoted include names: beside its user, below tests/, or in its library's src/."""
    candidates = [f"{base}/{include}" for base in (os.path.dirname(path), "tests", "apps", "formats/src",
                                                   "libruntime/src", "libbake/src")]
    candidates += [f"{library}/include/{include}" for library in ("formats", "libruntime", "libbake")]
    return next((os.path.normpath(c) for c in candidates if os.path.normpath(c) in files), None)


def check_own(path, number, include, allowed, files):
    if include.startswith("sqmap/"):
        module = include.split("/")[1]
        if module not in allowed:
            yield path, number, f'includes "{include}", may only include sqmap/{{{",".join(sorted(allowed))}}}'
    target = resolve(path, include, files)
    if target is None:
        yield path, number, f'includes "{include}", which is no file of this tree (third-party includes take < >)'
        return
    users = next((users for pattern, users in PRIVATE_HEADERS if fnmatch(target, pattern)), None)
    if users is not None and not matches(path, users):
        yield path, number, f"includes {target}, which is private to {', '.join(users)}"


def check_foreign(path, number, include):
    is_public = "/include/" in path
    if re.fullmatch(r"[a-z_0-9]+", include):
        return  # C++ standard library
    if POSIX.match(include):
        if is_public:
            yield path, number, f"public header includes <{include}>, only the C++ standard library may be there"
        return
    for name, (prefixes, users) in THIRD_PARTY.items():
        if include.startswith(prefixes):
            if is_public or not matches(path, users):
                yield path, number, f"includes <{include}>: {name} may only appear in {', '.join(users) or 'no file'}"
            return
    yield path, number, f"includes <{include}>, which tests/architecture/layers.py does not know"


def check_licence(path, lines, gpl_files):
    first = lines[1] if lines and lines[0].startswith("#!") and len(lines) > 1 else lines[0] if lines else ""
    match = re.match(r"(?://|#) SPDX-License-Identifier: (\S+)$", first)
    required = GPL if path in gpl_files else APACHE
    if not match or match[1] != required:
        yield path, 1, f"first line {first[:60]!r}, must be SPDX-License-Identifier: {required}"


def gpl_closure(includes, files):
    """Files in GPL folders, and whoever includes one of them, however indirectly."""
    gpl = {path for path in files if matches(path, GPL_PATHS)}
    while True:
        users = {path for path, targets in includes.items() if path not in gpl and not gpl.isdisjoint(targets)}
        if not users:
            return gpl
        gpl |= users


def findings(root):
    files = set(tree(root))
    result, targets, texts = [], {}, {}
    for path in sorted(files):
        is_script = "." not in os.path.basename(path) and lines_of(root, path)[:1] and lines_of(root, path)[0][:2] == "#!"
        if not (is_script or matches(os.path.basename(path), SPDX_NAMES)):
            continue
        lines = texts[path] = lines_of(root, path)
        if not path.endswith((".cpp", ".hpp")):
            continue
        allowed = next((modules for pattern, modules in MODULES if fnmatch(path, pattern)), set())
        if path.endswith(".hpp") and "#pragma once" not in lines:
            result.append((path, 1, "header without #pragma once"))
        for number, is_quoted, include in includes_of(lines):
            if is_quoted or include.startswith("sqmap/"):
                targets.setdefault(path, set()).add(resolve(path, include, files))
                result += check_own(path, number, include, allowed, files)
            else:
                result += check_foreign(path, number, include)
    gpl_files = gpl_closure(targets, files)
    for path, lines in texts.items():
        result += check_licence(path, lines, gpl_files)
    return sorted(result)


def unused_permissions(root):
    """Entries of THIRD_PARTY that no file makes use of: the table must not be wider than the tree."""
    files = set(tree(root))
    for name, (prefixes, users) in THIRD_PARTY.items():
        for user in users:
            if not any(fnmatch(path, user) and path.endswith((".cpp", ".hpp")) and
                       any(include.startswith(prefixes) for _, _, include in includes_of(lines_of(root, path)))
                       for path in files):
                yield f"{name}: {user}"
