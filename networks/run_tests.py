#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of networks/ in the environment of `make networks-env`; exit code 77 ("skipped" for ctest) without it.

  networks/run_tests.py STILLMAP_LAB
"""
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PYTHON = ROOT / "build/networks_venv/bin/python"


def has_packages():
    words = [PYTHON, "-c", "import torch, pytest"]
    return PYTHON.exists() and subprocess.run(words, capture_output=True, check=False).returncode == 0


def main():
    if not has_packages():
        print(f"skipped: no PyTorch in {PYTHON.parent.parent}; fix: make networks-env")
        return 77
    environment = {**os.environ, "STILLMAP_LAB": sys.argv[1], "OMP_WAIT_POLICY": "passive"}
    command = [PYTHON, "-m", "pytest", "-q", "-p", "no:cacheprovider", "networks"]
    return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
