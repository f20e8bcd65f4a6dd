#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `stillmap batch --slurm` on Slurm itself, with two nodes on this computer: kills a run and a node midway, and
compares all results with those of `stillmap batch`. Needs root, and the packages slurm-wlm and munge.

  scripts/test_slurm.py PROGRAM [--recordings N] [--throughput]

With --throughput it also prints the recordings per hour on one node and on both, without failures.
"""
import argparse
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOOLS = ("slurmctld", "slurmd", "munged", "sbatch")
CONFIGURATION = """\
ClusterName=stillmap
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
AuthType=auth/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
SchedulerParameters=sched_interval=5
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName=node[1-2] NodeHostname={host} NodeAddr=127.0.0.1 Port=[16818-16819] CPUs=1 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
"""


class Slurm:
    """A cluster of two nodes, whose jobs are those of this test."""

    def __init__(self, folder):
        self.folder, self.running = folder, {}
        for name in ("state", "spool.node1", "spool.node2"):
            (folder / name).mkdir()
        self.configuration = folder / "slurm.conf"
        self.configuration.write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], folder=folder))
        os.environ["SLURM_CONF"] = str(self.configuration)
        for name in ("/run/munge", "/var/lib/munge", "/var/log/munge"):
            Path(name).mkdir(mode=0o755, parents=True, exist_ok=True)
            shutil.chown(name, "munge", "munge")
        self.start("munged", "runuser", "-u", "munge", "--", "munged", "--foreground")
        self.start("slurmctld", "slurmctld", "-D", "-f", self.configuration)
        for node in ("node1", "node2"):
            self.start(node, "slurmd", "-D", "-N", node, "-f", self.configuration)

    def start(self, name, *words):
        with (self.folder / f"{name}.log").open("w") as log:
            self.running[name] = subprocess.Popen([str(word) for word in words], stdout=log, stderr=log)

    def ask(self, *words):
        return subprocess.run(words, capture_output=True, text=True, check=False).stdout

    def wait_until(self, condition, seconds, what):
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                for log in self.folder.glob("*.log"):
                    print(f"== {log.name}\n{log.read_text()[-2000:]}")
                sys.exit(f"FAILED: {what}\n{self.ask('sinfo', '-N')}{self.ask('squeue')}")
            time.sleep(0.2)

    def idle_nodes(self):
        return self.ask("sinfo", "-h", "-N", "-o", "%T").split().count("idle")

    def close(self):
        self.ask("scancel", "--user=root")
        for process in reversed(self.running.values()):
            process.terminate()
            process.wait()


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def processes_of(text):
    return [int(pid) for pid in subprocess.run(["pgrep", "-f", text], capture_output=True, text=True, check=False).stdout.split()]


def node_of(process):
    try:
        environment = Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    except OSError:
        return None
    return next((word.split(b"=")[1].decode() for word in environment if word.startswith(b"SLURMD_NODENAME=")), None)


def kill(processes):
    """Kills processes at once. Returns whether there was one."""
    killed = 0
    for process in processes:
        try:
            os.kill(process, signal.SIGKILL)
            killed += 1
        except ProcessLookupError:
            pass
    return killed > 0


def differences(a, b):
    """The results that differ between two folders of a batch."""
    for name in sorted(folder.name for folder in a.iterdir() if (folder / "summary.json").exists()):
        for file in ("trajectory.txt", "cloud.ply", "movers.csv", "run.map"):
            if (a / name / file).read_bytes() != (b / name / file).read_bytes():
                yield f"{name}/{file}"


def print_throughput(slurm, batch, folder, recordings):
    for nodes, options in ((1, "--cpus-per-task=1 --exclude=node2"), (2, "--cpus-per-task=1")):
        begin = time.monotonic()
        run(*batch, "--out", folder / f"on_{nodes}", f"--slurm={options}")
        slurm.wait_until(lambda: not slurm.ask("squeue", "-h"), 600, "the jobs do not end")
        seconds = time.monotonic() - begin
        print(f"{nodes} node(s): {seconds:.0f} s, {3600 * recordings / seconds:.0f} recordings per hour")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--throughput", action="store_true")
    arguments = parser.parse_args()
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    if missing or os.geteuid() != 0:
        print(f"skipped: not root, or there is no {', '.join(missing)}\n  fix: apt-get install slurm-wlm munge")
        return 77
    program = arguments.program.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for i in range(arguments.recordings):
            run(program, "simulate", "--frames", 80, "--people", 1, "--width", 160, "--height", 120, "--seed", i + 1, "--out",
                folder / "recordings" / f"visit_{i:02}")
        batch = [program, "batch", folder / "recordings" / "*", "--quiet", "--set", "features.keypoints=600"]
        begin = time.monotonic()
        run(*batch, "--out", folder / "alone", "--merge", folder / "alone.map")
        print(f"without Slurm: {time.monotonic() - begin:.0f} s")
        slurm = Slurm(folder)
        try:
            slurm.wait_until(lambda: slurm.idle_nodes() == 2, 30, "the nodes do not start")
            if arguments.throughput:
                print_throughput(slurm, batch, folder, arguments.recordings)
            begin, out = time.monotonic(), folder / "results"
            run(*batch, "--out", out, "--merge", folder / "all.map", "--slurm=--cpus-per-task=1")
            runs = f"{program} run .*{out}"

            def summaries():
                return len(list(out.glob("*/summary.json")))
            slurm.wait_until(lambda: summaries() >= 3 and kill(processes_of(runs)[:1]), 120, "nothing is run")
            print(f"killed a run after {summaries()} recordings")
            slurm.wait_until(lambda: summaries() >= 6 and any(node_of(p) == "node2" for p in processes_of(runs)), 120,
                             "the others do not go on")
            slurm.running["node2"].kill()
            kill(process for process in processes_of(f"slurmstepd: |{runs}|batch .*{out}") if node_of(process) == "node2")
            print(f"killed a node after {summaries()} recordings")
            slurm.wait_until(lambda: not slurm.ask("squeue", "-h"), 600, "the jobs do not end")
            print(f"with Slurm, two nodes: {time.monotonic() - begin:.0f} s")
            found = list(differences(folder / "alone", out))
            if (folder / "alone.map").read_bytes() != (folder / "all.map").read_bytes():
                found.append("all.map")
            print((out / "results.csv").read_text())
            if slurm.idle_nodes() != 1:
                found.append("the killed node is not down")
        finally:
            slurm.close()
    print("results that differ from those without Slurm:", ", ".join(found) or "none")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
