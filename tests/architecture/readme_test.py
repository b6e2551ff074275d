# SPDX-License-Identifier: Apache-2.0
"""README.md shows the sample as it is, and names only files that exist. Usage: readme_test.py"""
import json
import os
import re
import unittest

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))


def text_of(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


class Readme(unittest.TestCase):
    readme = text_of("README.md")

    def blocks(self, language):
        return re.findall(rf"^```{language}\n(.*?)^```$", self.readme, re.MULTILINE | re.DOTALL)

    def test_shows_the_sample_byte_for_byte(self):
        self.assertEqual([text_of("samples/query_bundle.cpp")], self.blocks("cpp"))

    def test_names_only_files_that_exist(self):
        named = set(re.findall(r"\]\((?!https?:)([^)#]+)", self.readme))  # links
        named |= set(re.findall(r"^((?:[\w.-]+/)+[\w.-]*)  ", self.readme, re.MULTILINE))  # the map of the tree
        named |= set(re.findall(r"(?<![\w/.])(?:scripts|formats|samples|tests)/[\w./-]*\w", self.readme))
        self.assertGreater(len(named), 8, "the patterns no longer find the names")
        self.assertEqual([], sorted(name for name in named if not os.path.exists(os.path.join(ROOT, name))))

    def test_its_scene_has_as_many_parts_as_the_papers(self):
        parts = {name: int(count) for name, count in re.findall(r"^(\w+)[.]off +(\d+) ", self.readme, re.MULTILINE)}
        scene = json.loads(text_of("samples/scenes/object_recognition.json"))
        self.assertGreaterEqual(sum(parts[item["bundle"].removesuffix(".h5")] for item in scene["objects"]), 89)

    def test_scripts_it_names_can_be_run(self):
        scripts = set(re.findall(r"scripts/[a-z_]+(?![\w./])", self.readme))
        self.assertIn("scripts/test", scripts)
        self.assertEqual([], sorted(s for s in scripts if not os.access(os.path.join(ROOT, s), os.X_OK)))

    def test_links_the_users_cmake_to_targets_that_are_installed(self):
        named = set(re.findall(r"sqmap::(\w+)", "".join(self.blocks("cmake"))))
        installed = set(re.findall(r"^ *sqmap_install_component\((.+)\)", text_of("scripts/cmake/SqmapInstall.cmake"),
                                   re.MULTILINE))
        libraries = {library for line in installed for library in line.split()[1:]}
        self.assertTrue(named and named <= libraries, f"{named} of {libraries}")


if __name__ == "__main__":
    unittest.main()
