# SPDX-License-Identifier: Apache-2.0
"""Small files of the corpus end as outcomes.tsv says, and a file that ends otherwise is named."""
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCRIPT = HERE.parent.parent / "scripts/bake_corpus"
NOTHING_TO_DO = 77
IS_SANITIZED = bool(os.environ.get("SQMAP_SANITIZED"))
TIME_LIMIT_S = 1700 if IS_SANITIZED else 240


def bake_corpus(*arguments):
    return subprocess.run([SCRIPT, *map(str, arguments), "--offline", "--files", HERE / "replay.txt"],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="sqmap-")
        cls.addClassCleanup(holder.cleanup)
        cls.out = Path(holder.name)
        limits = ["--memory", "none"] if IS_SANITIZED else []  # sanitizers reserve terabytes
        cls.result = bake_corpus(cls.out, "--bin", os.environ["SQMAP_BIN_DIR"], "--contain", 3, *limits)
        if cls.result.returncode == NOTHING_TO_DO:
            raise unittest.SkipTest(cls.result.stderr.strip())

    def test_every_file_ends_as_expected(self):
        self.assertEqual(self.result.returncode, 0, self.result.stdout + self.result.stderr)
        self.assertIn(" 0 not as expected", self.result.stdout)

    def test_it_meets_good_degraded_and_refused_files(self):
        for outcome in ("ok", "degraded", "failed"):
            self.assertRegex(self.result.stdout, rf" +\d+ {outcome} ")

    def test_another_outcome_a_new_file_and_a_crash_are_differences(self):
        log = next(self.out.glob("*.ndjson"))
        records = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
        assets = [record for record in records if record["type"] == "asset"]
        other, new, crashed = (f"{log.stem}/{Path(record['input'])}" for record in assets[:3])
        lines = (HERE / "outcomes.tsv").read_text(encoding="utf-8").splitlines()
        lines = [f"{other}\tok\tby-magic" if line.startswith(f"{other}\t") else line for line in lines]
        expected = self.out / "other.tsv"
        expected.write_text("\n".join(line for line in lines if not line.startswith(f"{new}\t")), encoding="utf-8")
        original = log.read_bytes()
        assets[2]["outcome"] = "crashed"
        log.write_text("\n".join(map(json.dumps, records)), encoding="utf-8")
        result = bake_corpus(self.out, "--again", "--expect", expected, "--contain", 0)
        log.write_bytes(original)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertRegex(result.stdout, rf"(?m)^{other}: .*, expected ok by-magic$")
        self.assertRegex(result.stdout, rf"(?m)^{new}: .*, no outcome is written down$")
        self.assertRegex(result.stdout, rf"(?m)^{crashed}: crashed .*, which no mesh may end as$")
        self.assertIn(" 3 not as expected", result.stdout)


if __name__ == "__main__":
    unittest.main()
