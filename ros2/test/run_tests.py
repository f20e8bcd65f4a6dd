#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the ROS 2 node in an environment that install_ros.py made. Exit code 77 ("skipped" for ctest)
without one.

  run_tests.py --venv DIR --package DIR --command FILE [PYTEST ARGUMENTS]     (as ros2/CMakeLists.txt gives them)
"""
import argparse
import os
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
PROBE = "import cv2, numpy, pytest, rclpy, stillmap, stillmap_msgs.msg, tf2_msgs.msg"


def shared_memory():
    """The files by which nodes of Fast DDS on one computer exchange messages, 68 MB each."""
    return set(Path("/dev/shm").glob("*fastrtps_*"))


def main():
    parser = argparse.ArgumentParser()
    for name in ("venv", "package", "command"):
        parser.add_argument("--" + name, required=True, type=Path)
    arguments, rest = parser.parse_known_args()
    python = arguments.venv / "bin" / "python3"
    if not python.exists():
        print("skipped: there is no ROS 2\n  fix: run `make ros-test`")
        return 77
    paths = [arguments.package, FOLDER.parent / "stillmap_ros", FOLDER]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths)), "PYTHONDONTWRITEBYTECODE": "1",
                                "STILLMAP_COMMAND": str(arguments.command), "AMENT_PREFIX_PATH": str(arguments.venv),
                                "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}
    probe = subprocess.run([python, "-c", PROBE], env=environment, capture_output=True, text=True, check=False)
    if probe.returncode:
        print(f"skipped: {probe.stderr.strip().splitlines()[-1]}\n  fix: remove {arguments.venv}, and run `make ros-test`")
        return 77
    before = shared_memory()
    code = subprocess.run([python, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", *(rest or [FOLDER])],
                          env=environment, check=False).returncode
    for left in shared_memory() - before:  # by the nodes that the tests kill
        left.unlink(missing_ok=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
