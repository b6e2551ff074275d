# SPDX-License-Identifier: Apache-2.0
"""sample_energy_test.py ENERGY_CHECK BUNDLES: with passivity, no sample gives a mass on a spring energy.

A few seconds on each bundle that scripts/bake_samples made; scripts/check_energy follows the whole minute. The reaction
alone is the control: it must gain on one sample at least, or the test sees nothing. Exit code 77 where nothing is baked.
"""
import pathlib
import subprocess
import sys

SAMPLES = ("elephant", "camel", "hand", "armadillo", "lion", "dino")
PLACES, FRAMES = "4", "3000"
MOST = 1.01


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    gained, wrong, seen = 0, 0, 0
    for bundle in (folder / (name + ".h5") for name in SAMPLES):
        if not bundle.exists():
            continue
        out = subprocess.run([program, str(bundle), PLACES, FRAMES], stdout=subprocess.PIPE, text=True, timeout=250)
        if out.returncode != 0:
            print("skipped: %s is not of this version" % bundle.name)
            continue
        seen += 1
        for line in out.stdout.splitlines():
            name, model, places, _, _, most = line.split()[:6]
            if int(places) != int(PLACES):
                sys.exit("%s: %s places of %s" % (name, places, PLACES))
            gained += model == "reaction" and float(most) > MOST
            if "passivity" in model:
                print("%-12s %-20s %s" % (name, model, most))
                wrong += not float(most) < MOST
    if seen == 0:
        return 77
    if gained == 0:
        print("the reaction alone gained nothing: the test sees nothing")
    return 1 if wrong or gained == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
