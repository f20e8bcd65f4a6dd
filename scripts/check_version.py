#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that CHANGELOG.md and CITATION.cff name the version of CMakeLists.txt, on the same day, and that the packages
and wheels given as arguments are of this version, and their commands of the last commit.

  scripts/check_version.py [FILE...]
"""
import io
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def found(pattern, file):
    match = re.search(pattern, (ROOT / file).read_text(), re.MULTILINE)
    if not match:
        sys.exit(f"error: {file} has nothing like {pattern}")
    return match.groups()


def command_in(file):
    """The bytes of the command in a package or wheel; None if it has none."""
    if file.endswith(".whl"):
        with zipfile.ZipFile(file) as wheel:
            return next(wheel.read(name) for name in wheel.namelist() if name.endswith("stillmap.scripts/stillmap"))
    if not Path(file).name.startswith("stillmap_"):
        return None
    tar = subprocess.run(["dpkg-deb", "--fsys-tarfile", file], check=True, stdout=subprocess.PIPE).stdout
    with tarfile.open(fileobj=io.BytesIO(tar)) as files:
        return files.extractfile("./usr/bin/stillmap").read()


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
    if not files:
        return
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout.strip()
    for file in files:
        if not re.search(rf"[_-]{re.escape(version)}[_-]", Path(file).name):
            yield f"{file} is not of version {version}"
        command = command_in(file)
        if command is not None and commit not in command:
            yield f"{file} is not of the commit {commit.decode()}"


def main():
    found_problems = list(problems(sys.argv[1:]))
    for problem in found_problems:
        print(problem, file=sys.stderr)
    return 1 if found_problems else 0


if __name__ == "__main__":
    sys.exit(main())
