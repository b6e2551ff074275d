# SPDX-License-Identifier: Apache-2.0
"""Another program reads a bundle by FORMAT.md alone: runs the Python of its section 10 on the golden bundle.

usage: h5py_test.py FORMAT.md BUNDLE       exit code 77: this Python has no h5py
"""
import re
import sys
import unittest

try:
    import h5py
    import numpy as np
except ImportError:
    sys.exit(77)

FORMAT, BUNDLE = sys.argv[1:3]


def code_in_format():
    with open(FORMAT, encoding="utf-8") as page:
        names = {}
        exec(re.search(r"```python\n(.*?)```", page.read(), re.DOTALL).group(1), names)
        return names


class Golden(unittest.TestCase):
    def setUp(self):
        self.bundle = h5py.File(BUNDLE, "r")
        self.depths_m = code_in_format()["depths_m"]

    # The formula of smooth_map() in tests/support/asset_builder.hpp.
    def smooth(self, rows, cols, bits):
        row, col = np.mgrid[0:rows, 0:cols]
        miss = 2**bits - 1
        return 0.01 + 0.25 / miss * ((100 + row * row + 3 * (col * (cols - col) // 4)) % miss)

    def test_depths_of_the_first_part(self):
        np.testing.assert_allclose(self.depths_m(self.bundle, 0), self.smooth(17, 32, 10), rtol=1e-14)

    def test_depths_of_the_second_part_with_its_misses(self):
        expected = self.smooth(9, 12, 8)
        expected.flat[[5, 30]] = np.nan
        expected.flat[40] = 0.01 + 0.25 / 255 * 17
        np.testing.assert_allclose(self.depths_m(self.bundle, 1), expected, rtol=1e-14)

    def test_a_part_without_hits(self):
        self.assertTrue(np.isnan(self.depths_m(self.bundle, 2)).all())

    def test_text_is_text(self):
        self.assertEqual(self.bundle.attrs["format"], b"sqmap")
        self.assertEqual(self.bundle.attrs["source_name"].decode(), 'h\u00e4nd "left".off')

    def test_crossings_by_running_sums(self):
        counts = self.bundle["maps/layout"][:, 5]
        self.assertEqual(counts.tolist(), [0, 4, 0])
        self.assertEqual(np.cumsum(self.bundle["maps/crossing_texel"]).tolist(), [0, 0, 40, 107])


unittest.main(argv=sys.argv[:1])
