#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that CHANGELOG.md and CITATION.cff name the version of CMakeLists.txt, on the same day, and that the packages
and wheels given as arguments are of this version.

  scripts/check_version.py [FILE...]
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def found(pattern, file):
    match = re.search(pattern, (ROOT / file).read_text(), re.MULTILINE)
    if not match:
        sys.exit(f"error: {file} has nothing like {pattern}")
    return match.groups()


def problems(files):
    version, = found(r"project\(stillmap VERSION ([0-9.]+)", "CMakeLists.txt")
    newest, day = found(r"^## \[([0-9.]+)\] - ([0-9-]+)$", "CHANGELOG.md")
    cited, = found(r"^version: ([0-9.]+)$", "CITATION.cff")
    released, = found(r"^date-released: ([0-9-]+)$", "CITATION.cff")
    if newest != version:
        yield f"CHANGELOG.md begins with {newest}, CMakeLists.txt says {version}"
    if cited != version:
        yield f"CITATION.cff says {cited}, CMakeLists.txt {version}"
    if released != day:
        yield f"CITATION.cff says {released}, CHANGELOG.md {day}"
    for file in files:
        if not re.search(rf"[_-]{re.escape(version)}[_-]", Path(file).name):
            yield f"{file} is not of version {version}"


def main():
    found_problems = list(problems(sys.argv[1:]))
    for problem in found_problems:
        print(problem, file=sys.stderr)
    return 1 if found_problems else 0


if __name__ == "__main__":
    sys.exit(main())
