#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets (fuzz/) with libFuzzer, one after the other; exit code 1 if one of them finds something.

Inputs that reach new code are kept in build/fuzz/corpus/TARGET for later calls, and those that crash, hang or take too
much memory in build/fuzz/findings/TARGET. A finding that is mended goes into fuzz/findings/TARGET, which the tests
fuzz.TARGET parse.

  scripts/fuzz.py [--seconds N] [TARGET...]    N: seconds per target (default 60); TARGETs: default all
"""
import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/fuzz"
PROGRAM_PREFIX = "stillmap_fuzz_"
LARGEST_INPUT = 8192  # bytes; seeds are smaller, and larger inputs are slower without reaching more
SECONDS_PER_INPUT = 10
LARGEST_MEMORY = 2048  # MiB, of the whole process and of one allocation


def fuzz(program, seconds):
    """Returns the number of inputs and whether there is a finding, after a line with both."""
    name = program.name.removeprefix(PROGRAM_PREFIX)
    corpus, findings = BUILD / "corpus" / name, BUILD / "findings" / name
    findings.mkdir(parents=True, exist_ok=True)
    subprocess.run([program, "--write-seeds", corpus], check=True)
    before = set(findings.iterdir())
    environment = dict(os.environ)
    if Path("/dev/shm").is_dir():
        environment["TMPDIR"] = "/dev/shm"  # parsers that read files read them from memory
    done = subprocess.run(
        [program, corpus, ROOT / "fuzz/findings" / name if (ROOT / "fuzz/findings" / name).exists() else corpus,
         f"-max_total_time={seconds}", f"-max_len={LARGEST_INPUT}", f"-timeout={SECONDS_PER_INPUT}",
         f"-rss_limit_mb={LARGEST_MEMORY}", f"-malloc_limit_mb={LARGEST_MEMORY}", f"-artifact_prefix={findings}/",
         "-print_final_stats=1", "-verbosity=1"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", check=False,
        env=environment)
    executed = re.search(r"stat::number_of_executed_units:\s*(\d+)", done.stderr)
    inputs = int(executed[1]) if executed else 0
    covered = re.findall(r"cov: (\d+)", done.stderr)
    print(f"{name:18}{inputs:>12} inputs{covered[-1] if covered else '0':>8} edges{len(list(corpus.iterdir())):>7} kept  "
          + ("ok" if done.returncode == 0 else "FINDING"), flush=True)
    if done.returncode != 0:
        lines = done.stderr.splitlines()
        start = next((i for i, line in enumerate(lines) if "ERROR" in line or "runtime error" in line), max(0, len(lines) - 30))
        print("\n".join(lines[start:start + 30]))
        for file in sorted(set(findings.iterdir()) - before):
            print(f"  the input: {file.relative_to(ROOT)}; again with: {program.relative_to(ROOT)} {file.relative_to(ROOT)}")
    return inputs, done.returncode != 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("targets", nargs="*")
    arguments = parser.parse_args()
    programs = {p.name.removeprefix(PROGRAM_PREFIX): p for p in sorted((BUILD / "fuzz").glob(PROGRAM_PREFIX + "*")) if p.is_file()}
    unknown = [target for target in arguments.targets if target not in programs]
    if unknown or not programs:
        sys.exit(f"error: there is no target {', '.join(unknown)}\n  fix: build them with make fuzz; known: {', '.join(programs)}")
    results = [fuzz(programs[name], arguments.seconds) for name in arguments.targets or programs]
    print(f"{sum(inputs for inputs, _ in results)} inputs, {sum(found for _, found in results)} targets with findings")
    sys.exit(any(found for _, found in results))


if __name__ == "__main__":
    main()
