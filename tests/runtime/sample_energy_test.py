# SPDX-License-Identifier: Apache-2.0
"""sample_energy_test.py ENERGY_CHECK SQBAKE MESHES: with passivity, no sample gives a mass on a spring energy.

A few seconds on each sample, baked here; scripts/check_energy follows the whole minute. The reaction alone is the
control: it must gain on one sample at least, or the test sees nothing.
"""
import pathlib
import subprocess
import sys
import tempfile

SAMPLES = ("elephant", "camel", "hand", "armadillo", "lion", "dino")
PLACES, FRAMES = "4", "3000"
MOST = 1.01


def main():
    program, sqbake, meshes = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    gained, wrong = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        inputs = [str(meshes / (name + ".off")) for name in SAMPLES]
        subprocess.run([sqbake, "bake", *inputs, "--out-dir", folder, "--no-cache"], check=True)
        for name in SAMPLES:
            out = subprocess.run([program, "%s/%s.h5" % (folder, name), PLACES, FRAMES], stdout=subprocess.PIPE,
                                 text=True, timeout=250, check=True)
            for line in out.stdout.splitlines():
                _, model, places, _, _, most = line.split()[:6]
                if int(places) != int(PLACES):
                    sys.exit("%s: %s places of %s" % (name, places, PLACES))
                gained += model == "reaction" and float(most) > MOST
                if "passivity" in model:
                    print("%-12s %-20s %s" % (name, model, most))
                    wrong += not float(most) < MOST
    if gained == 0:
        print("the reaction alone gained nothing: the test sees nothing")
    return 1 if wrong or gained == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
