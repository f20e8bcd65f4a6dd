#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps recordings on the computers of a Ray cluster, and joins their maps.

  pip install ray           batch_ray.py OUT RECORDING...

All computers have Stillmap's wheel and see the folders of the recordings and OUT. Ray maps a recording again if its
computer goes. Without a cluster it uses the cores of this computer. Tried with Ray 2.60.0.
"""
import sys
from pathlib import Path

import ray

import stillmap


@ray.remote(num_cpus=2, max_retries=3)
def run(recording, folder):
    """Maps a recording. Returns its map and how many of its frames have a pose."""
    source = stillmap.source(recording)
    slam = stillmap.Slam(source.camera)
    for frame in source:
        slam.push(frame)
    results = slam.finish()
    results.write(folder)
    return folder / "run.map", "{tracked} of {frames} frames tracked".format_map(results.statistics)


out, recordings = Path(sys.argv[1]).absolute(), [Path(word).absolute() for word in sys.argv[2:]]
ray.init(ignore_reinit_error=True)
begun = {run.remote(recording, out / recording.name): recording for recording in recordings}
maps, waiting = [], list(begun)
while waiting:
    (ready,), waiting = ray.wait(waiting)
    file, text = ray.get(ready)
    maps.append(file)
    print(f"{begun[ready].name}: {text}, {len(waiting)} to come", flush=True)
# The order of the maps does not matter, byte for byte.
for pair in stillmap.merge_maps(maps, out / "all.map"):
    print(f"{pair.a.parent.name}, {pair.b.parent.name}: {'connected' if pair.connected else pair.reason}")
