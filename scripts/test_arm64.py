#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Uses what `make arm64` made under QEMU: the command of the Debian package and of the wheel on a rendered sequence, whose
trajectories must be the same bytes as those of the native command (with a network, the same within a micrometer); the Python
module; and the unit tests of the modules that compute. The processor is the Cortex-A76 of the Raspberry Pi 5.

  test_arm64.py [--frames N] [--model NETWORK.onnx] [--modules NAME,NAME...]
"""
import argparse
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ARM_ROOT = ROOT / "build" / "arm64_root"
QEMU = ["qemu-aarch64", "-cpu", "cortex-a76", "-L", ARM_ROOT]
MODULES = "base,config,geometry,inertial,recording,sensor,feature,segment,motion,map,optimize,track,loop,dense"
# QEMU does not tell which pages of a mapped file are resident, its own work is CPU time of the program, the program cannot
# start itself again, and full networks take minutes each. OpenVINO's logarithm of zero is finite on ARM.
LEFT_OUT = ("NvidiaGpuDeathTest|DenseMap.NeverHoldsMorePixelsThanItsMemory|Trace.CpuTimeCountsOnlyComputing|/Network[.]|"
            "WrongNetwork.OutputsThatAreNoNumbers/openvino")
SAME = ("trajectory.txt", "trajectory_live.txt", "trajectory_covariance.txt", "keyframes.txt", "movers.csv")


def run(*command):
    subprocess.run([str(part) for part in command], check=True, cwd=ROOT)


def the_one(pattern):
    found = list((ROOT / "build").glob(pattern))
    if len(found) != 1:
        sys.exit(f"error: there are {len(found)} files build/{pattern}, not one\n  fix: make arm64")
    return found[0]


def package_command(folder):
    """The command of the Debian package, unpacked."""
    run("dpkg-deb", "--extract", the_one("arm64/packages/stillmap_*_arm64.deb"), folder)
    return folder / "usr" / "bin" / "stillmap"


def wheel_command(folder):
    """The command of the wheel, unpacked; the module is tried, too."""
    with zipfile.ZipFile(the_one("wheels/stillmap-*-cp311-*_aarch64.whl")) as wheel:
        wheel.extractall(folder)
    packages = f"PYTHONPATH={folder}:{ARM_ROOT}/usr/lib/python3/dist-packages"
    run(*QEMU, "-E", packages, "-E", f"PYTHONHOME={ARM_ROOT}/usr", ARM_ROOT / "usr/bin/python3.11",
        "scripts/use_module.py")
    command = folder / "stillmap.scripts" / "stillmap"
    command.chmod(0o755)
    return command


def within_a_micrometer(file, native):
    """Returns whether the numbers of two files are the same but for a millionth."""
    numbers = [[float(word) for word in path.read_text().replace(",", " ").split() if word[0] in "-.0123456789"]
               for path in (file, native)]
    return len(numbers[0]) == len(numbers[1]) and all(abs(a - b) <= 1e-6 for a, b in zip(*numbers))


def differing_results(folder, frames, model):
    """Runs the programs on the same recording; yields the results that differ from the native ones."""
    run(ROOT / "build/release/stillmap", "simulate", "--frames", frames, "--people", 2, "--out", folder / "sequence")
    programs = {"native": [ROOT / "build/release/stillmap"],
                "package": [*QEMU, package_command(folder / "package")], "wheel": [*QEMU, wheel_command(folder / "wheel")]}
    runs = [(name, []) for name in programs]
    if model:  # run by OpenVINO, which the wheel does not have
        runs += [(name, ["--model", model.resolve()]) for name in ("native", "package")]
    for name, network in runs:
        start, results = time.monotonic(), "with network" if network else "results"
        run(*programs[name], "run", folder / "sequence", *network, "--quiet", "--out", folder / name / results)
        print(f"{name}, {results}: {frames} frames in {time.monotonic() - start:.1f} s", flush=True)
        for file in SAME:
            here, native = (folder / program / results / file for program in (name, "native"))
            if here.read_bytes() == native.read_bytes() or (network and within_a_micrometer(here, native)):
                continue
            yield f"{name}, {results}: {file}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--model", type=Path, help="network in ONNX format that is compared, too")
    parser.add_argument("--modules", default=MODULES)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        differing = list(differing_results(Path(folder), arguments.frames, arguments.model))
    print("results that differ from the native ones:", ", ".join(differing) or "none", flush=True)
    modules = arguments.modules.split(",")
    run("cmake", "--build", "--preset", "arm64", "--target", *(f"stillmap_{module}_test" for module in modules))
    labels = "|".join(modules)
    tests = subprocess.run(["ctest", "--preset", "arm64", "-L", f"^({labels})$", "-E", LEFT_OUT, "--timeout", "3000", "-j", "2"],
                           cwd=ROOT, check=False)
    return 1 if differing or tests.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
