#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Shows the live map in a browser with viser while a recording is mapped.

  pip install viser         live_viser.py FOLDER [PORT]      (then open http://localhost:PORT, 8080 by default)

Tried with viser 1.1.1 on a rendered recording; not with a browser.
"""
import sys

import viser
import viser.transforms

import stillmap

server = viser.ViserServer(port=int(sys.argv[2]) if len(sys.argv) > 2 else 8080)
server.scene.set_up_direction("-y")
source = stillmap.source(sys.argv[1])
slam = stillmap.Slam(source.camera)
for frame in source:
    pose = slam.push(frame).T_world_camera
    if pose is not None:
        rotation = viser.transforms.SO3.from_matrix(pose[:3, :3])
        server.scene.add_camera_frustum("/camera", fov=0.8, aspect=4 / 3, image=frame.rgb[::4, ::4],
                                        wxyz=rotation.wxyz, position=pose[:3, 3])
    if frame.index % 10 == 0:
        cloud = slam.cloud
        server.scene.add_point_cloud("/cloud", cloud.points, cloud.colors, point_size=0.01)
cloud = slam.finish().cloud
server.scene.add_point_cloud("/cloud", cloud.points, cloud.colors, point_size=0.01)
print(f"{len(cloud)} points")
if sys.stdin.isatty():
    input("Enter ends the server. ")
