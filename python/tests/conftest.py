# SPDX-License-Identifier: Apache-2.0
"""A small rendered recording, and the command's results of it. The command is $STILLMAP_COMMAND."""
import os
import subprocess

import pytest

import stillmap

FRAMES = 24


def run_command(*words):
    command = os.environ.get("STILLMAP_COMMAND")
    if not command:
        pytest.skip("skipped: STILLMAP_COMMAND does not name the command stillmap")
    return subprocess.run([command, *map(str, words)], check=True, capture_output=True, text=True)


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    """A folder in TUM layout with walking people, masks and true poses."""
    folder = tmp_path_factory.mktemp("simulated") / "sequence"
    run_command("simulate", "--people", 1, "--frames", FRAMES, "--width", 320, "--height", 240, "--out", folder)
    return folder


@pytest.fixture(scope="session")
def frames(recording):
    return list(stillmap.source(recording))


@pytest.fixture(scope="session")
def camera(recording):
    return stillmap.source(recording).camera


@pytest.fixture
def slam(camera):
    """A system without dense map and movers, which is fast."""
    return stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})


@pytest.fixture
def command():
    return run_command
