#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy (settings: .clang-tidy) over all sources, and eslint (settings: package.json) over the page of the view,
if it is installed; exit code 1 if they find anything.

A clean source is not checked again until it, an included header of the project, its compiler flags, the settings or
clang-tidy's version change: a hash of all of them is stored in build/lint/clean.

  scripts/lint.py [--jobs N] [PATH...]    PATHs: only sources below these (default: all)
"""
import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/lint"
PAGE = ROOT / "stillmap/view/page"
CLANG_TIDY = ROOT / "build/venv/bin/clang-tidy"
OUR_HEADERS = rf"^{re.escape(str(ROOT))}/(stillmap|apps|lab|fuzz)/.*\.hpp$"
GCC_ONLY = ("-fpch-preprocess", "--param=")
INCLUDE = re.compile(r'^\s*#\s*include\s*"((?:stillmap|apps|lab|fuzz)/[^"]+)"', re.MULTILINE)


def read_commands():
    """Source -> its compile command, adapted to clang, which does not know all of GCC's flags."""
    entries = json.loads((BUILD / "compile_commands.json").read_text())
    for entry in entries:
        entry["command"] = " ".join(w for w in entry["command"].split() if not w.startswith(GCC_ONLY))
    (BUILD / "tidy").mkdir(exist_ok=True)
    (BUILD / "tidy/compile_commands.json").write_text(json.dumps(entries))
    return {Path(entry["file"]): entry["command"] for entry in entries}


def with_our_headers(source):
    """The source and every header of ours that it includes, directly or not, in a fixed order."""
    seen, open_ends = set(), [source]
    while open_ends:
        file = open_ends.pop()
        if file in seen or not file.exists():
            continue
        seen.add(file)
        open_ends.extend(ROOT / name for name in INCLUDE.findall(file.read_text(encoding="utf-8")))
    return sorted(seen)


def fingerprint(source, command, common):
    digest = hashlib.sha256(common + command.encode())
    for file in with_our_headers(source):
        digest.update(str(file.relative_to(ROOT)).encode() + file.read_bytes())
    return digest.hexdigest()


def findings(source):
    """What clang-tidy prints about one source; empty if it is clean."""
    result = subprocess.run([CLANG_TIDY, "--quiet", f"--header-filter={OUR_HEADERS}", "-p", BUILD / "tidy", source],
                            capture_output=True, text=True, check=False)
    return result.stdout or (result.stderr if result.returncode else "")


def without_repeats(text, printed):
    """The findings not printed before: those in headers come once per source that includes them."""
    kept = []
    for finding in re.split(r"^(?=\S+:\d+:\d+: (?:error|warning):)", text, flags=re.MULTILINE):
        if finding.strip() and finding not in printed:
            printed.add(finding)
            kept.append(finding)
    return "".join(kept)


def page_is_clean():
    """Whether eslint finds nothing in the page. Debian's eslint needs the path of its modules if node is another build."""
    if not shutil.which("eslint"):
        print("eslint: skipped, it is not installed")
        return True
    environment = os.environ | {"NODE_PATH": "/usr/share/nodejs"}
    result = subprocess.run(["eslint", "--format", "unix", "."], cwd=PAGE, env=environment, check=False)
    print(f"eslint: {len(list(PAGE.glob('*.js')))} sources, {'clean' if result.returncode == 0 else 'with findings'}")
    return result.returncode == 0


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("paths", nargs="*", type=lambda path: Path(path).resolve())
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    commands = {source: command for source, command in read_commands().items() if not arguments.paths
                or any(source.is_relative_to(path) for path in arguments.paths)}
    version = subprocess.run([CLANG_TIDY, "--version"], capture_output=True, check=True).stdout
    common = version + (ROOT / ".clang-tidy").read_bytes()
    clean = BUILD / "clean"
    clean.mkdir(exist_ok=True)

    def check(source):
        mark = clean / fingerprint(source, commands[source], common)
        if mark.exists():
            return ""
        found = findings(source)
        if not found:
            mark.touch()
        return found

    printed = set()
    dirty = 0
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for found in pool.map(check, sorted(commands)):
            dirty += bool(found)
            print(without_repeats(found, printed), end="", flush=True)
    print(f"clang-tidy: {len(commands)} sources, {dirty} with findings")
    page_asked = not arguments.paths or any(PAGE.is_relative_to(path) for path in arguments.paths)
    return 1 if dirty + (page_asked and not page_is_clean()) else 0


if __name__ == "__main__":
    sys.exit(main())
