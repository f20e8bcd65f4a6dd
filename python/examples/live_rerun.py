#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Shows camera, images and live map in Rerun while a recording is mapped.

  pip install rerun-sdk     live_rerun.py FOLDER [RECORDING.rrd]      (a file instead of the viewer)

Tried with rerun-sdk 0.41.0 on a rendered recording, into a file; not with the viewer.
"""
import sys

import rerun as rr

import stillmap

rr.init("stillmap", spawn=len(sys.argv) < 3)
if len(sys.argv) > 2:
    rr.save(sys.argv[2])
source = stillmap.source(sys.argv[1])
camera = source.camera
slam = stillmap.Slam(camera)
rr.log("world", rr.ViewCoordinates.RDF, static=True)
rr.log("world/camera", rr.Pinhole(image_from_camera=camera.matrix, width=camera.width, height=camera.height))
for frame in source:
    pose = slam.push(frame).T_world_camera
    rr.set_time("stamp", timestamp=frame.stamp)
    rr.log("world/camera", rr.Image(frame.rgb))
    if pose is not None:
        rr.log("world/camera", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
    if frame.index % 10 == 0:
        snapshot = slam.snapshot()
        rr.log("world/cloud", rr.Points3D(snapshot.cloud.points, colors=snapshot.cloud.colors))
        rr.log("world/path", rr.LineStrips3D([snapshot.trajectory.positions]))
