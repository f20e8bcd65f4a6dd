#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps a recording and shows the static cloud with the path of the camera in Open3D's window.

  pip install open3d        view_open3d.py FOLDER [--no-window]

Tried with open3d-cpu 0.20.0 on a rendered recording, without the window.
"""
import sys

import numpy as np
import open3d as o3d

import stillmap

source = stillmap.source(sys.argv[1])
slam = stillmap.Slam(source.camera)
for frame in source:
    slam.push(frame)
results = slam.finish()

cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(results.cloud.points.astype(np.float64)))
cloud.colors = o3d.utility.Vector3dVector(results.cloud.colors / 255)
steps = np.arange(len(results.trajectory) - 1)
path = o3d.geometry.LineSet(o3d.utility.Vector3dVector(results.trajectory.positions),
                            o3d.utility.Vector2iVector(np.stack([steps, steps + 1], axis=1)))
print(cloud, path)
if "--no-window" not in sys.argv:
    o3d.visualization.draw_geometries([cloud, path])
