#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the Python module that CMake built. Exit code 77 ("skipped" for ctest) if no interpreter has the
module's version, NumPy and pytest.

  run_tests.py --venv DIR --package DIR --command FILE     (the arguments are given by python/CMakeLists.txt)
"""
import argparse
import os
import subprocess
import sys
from pathlib import Path

PROBE = "import numpy, pytest, stillmap"


def interpreters(venv):
    """The interpreters that may have the packages, the environment of the build first."""
    return [str(file) for file in (venv / "bin" / "python3", Path(sys.executable)) if file.exists()]


def main():
    parser = argparse.ArgumentParser()
    for name in ("venv", "package", "command"):
        parser.add_argument("--" + name, required=True, type=Path)
    arguments = parser.parse_args()
    environment = os.environ | {"PYTHONPATH": str(arguments.package), "STILLMAP_COMMAND": str(arguments.command),
                                "PYTHONDONTWRITEBYTECODE": "1"}
    problem = "no Python"
    for python in interpreters(arguments.venv):
        probe = subprocess.run([python, "-c", PROBE], env=environment, capture_output=True, text=True, check=False)
        if probe.returncode == 0:
            tests = Path(__file__).parent / "tests"
            return subprocess.run([python, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", tests],
                                  env=environment, check=False).returncode
        problem = probe.stderr.strip().splitlines()[-1]
    print(f"skipped: {problem}\n  fix: run scripts/install_dependencies.sh")
    return 77


if __name__ == "__main__":
    sys.exit(main())
