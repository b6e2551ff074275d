# SPDX-License-Identifier: Apache-2.0
"""layers.py finds each kind of breach in a made-up tree, and none in this one. Usage: layers_test.py"""
import os
import sys
import tempfile
import unittest

import layers

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
APACHE = "// SPDX-License-Identifier: Apache-2.0\n"
GPL = "// SPDX-License-Identifier: GPL-3.0-or-later\n"
ONCE = "#pragma once\n"

# A small tree without breach; each test adds or replaces one file.
CLEAN = {
    "formats/include/sqmap/asset/a.hpp": APACHE + ONCE + "#include <vector>\n",
    "formats/include/sqmap/io/b.hpp": APACHE + ONCE + '#include "sqmap/asset/a.hpp"\n',
    "formats/src/h.hpp": APACHE + ONCE,
    "libruntime/include/sqmap/runtime/r.hpp": APACHE + ONCE + '#include "sqmap/asset/a.hpp"\n',
    "libbake/include/sqmap/bake/k.hpp": GPL + ONCE + '#include "sqmap/asset/a.hpp"\n',
    "tests/support/shapes.hpp": GPL + ONCE + '#include "sqmap/bake/k.hpp"\n',
    "scripts/run": "#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\n",
}


class FindsBreaches(unittest.TestCase):
    def found_with(self, path, text):
        with tempfile.TemporaryDirectory() as root:
            for name, content in {**CLEAN, path: text}.items():
                os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
                with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                    file.write(content)
            return layers.findings(root)

    def expect_one(self, path, text, part):
        found = self.found_with(path, text)
        self.assertEqual([(path, True)], [(f[0], part in f[2]) for f in found], found)

    def expect_none(self, path, text):
        self.assertEqual([], self.found_with(path, text))

    def test_runtime_may_not_include_io_or_bake(self):
        self.expect_one("libruntime/src/x.cpp", APACHE + '#include "sqmap/io/b.hpp"\n', "may only include")
        self.expect_one("libruntime/src/x.cpp", GPL + '#include "sqmap/bake/k.hpp"\n', "may only include")

    def test_formats_may_not_include_runtime(self):
        self.expect_one("formats/src/x.cpp", APACHE + '#include "sqmap/runtime/r.hpp"\n', "may only include")

    def test_asset_headers_may_not_include_io(self):
        self.expect_one("formats/include/sqmap/asset/x.hpp", APACHE + ONCE + '#include "sqmap/io/b.hpp"\n',
                        "may only include")

    def test_bake_may_not_include_io(self):
        self.expect_one("libbake/src/x.cpp", GPL + '#include "sqmap/io/b.hpp"\n', "may only include")

    def test_angle_brackets_do_not_hide_a_breach(self):
        self.expect_one("libruntime/src/x.cpp", APACHE + "#include <sqmap/io/b.hpp>\n", "may only include")

    def test_third_party_in_a_public_header(self):
        self.expect_one("libbake/include/sqmap/bake/x.hpp", GPL + ONCE + "#  include <Eigen/Core>\n", "Eigen")
        self.expect_one("formats/include/sqmap/io/x.hpp", APACHE + ONCE + "#include <unistd.h>\n", "public header")

    def test_third_party_outside_its_files(self):
        for header in ("CGAL/Surface_mesh.h", "ceres/ceres.h", "assimp/scene.h", "embree3/rtcore.h", "tbb/task.h",
                       "hdf5.h", "nlohmann/json.hpp", "CLI/CLI.hpp", "gtest/gtest.h"):
            self.expect_one("libruntime/src/x.cpp", APACHE + f"#include <{header}>\n", "may only appear in")

    def test_library_nobody_declared(self):
        self.expect_one("libruntime/src/x.cpp", APACHE + "#include <lz4.h>\n", "does not know")

    def test_private_header_of_another_library(self):
        self.expect_one("libruntime/src/x.cpp", APACHE + '#include "../../formats/src/h.hpp"\n', "is private to")
        self.expect_one("apps/sqinfo/x.cpp", APACHE + '#include "h.hpp"\n', "is private to")
        self.expect_none("tests/formats/x.cpp", APACHE + '#include "h.hpp"\n')

    def test_include_that_is_no_file_of_the_tree(self):
        self.expect_one("libruntime/src/x.cpp", APACHE + '#include "nowhere.hpp"\n', "no file of this tree")

    def test_missing_or_wrong_licence(self):
        self.expect_one("libruntime/src/x.cpp", "int x;\n", "must be SPDX-License-Identifier: Apache-2.0")
        self.expect_one("libbake/src/x.cpp", APACHE, "must be SPDX-License-Identifier: GPL-3.0-or-later")
        self.expect_one("scripts/run", "#!/usr/bin/env bash\n", "must be SPDX")
        self.expect_one("samples/CMakeLists.txt", "project(x)\n", "must be SPDX")

    def test_who_includes_gpl_code_is_gpl(self):
        self.expect_one("tests/apps/x_test.cpp", APACHE + '#include "support/shapes.hpp"\n', "GPL-3.0-or-later")
        self.expect_none("tests/apps/x_test.cpp", GPL + '#include "support/shapes.hpp"\n')

    def test_header_without_guard(self):
        self.expect_one("libruntime/src/x.hpp", APACHE, "#pragma once")

    def test_clean_tree_has_no_finding(self):
        self.expect_none("libruntime/src/x.cpp",
                         APACHE + '#include "sqmap/runtime/r.hpp"\n\n#include <cmath>\n#include <sys/mman.h>\n')


class ThisTree(unittest.TestCase):
    def test_has_no_breach(self):
        found = layers.findings(ROOT)
        if found:
            self.fail("\n" + "\n".join(f"{path}:{line}: {text}" for path, line, text in found))

    def test_permits_no_third_party_library_where_none_is_used(self):
        self.assertEqual([], list(layers.unused_permissions(ROOT)))


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    unittest.main()
