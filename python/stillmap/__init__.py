# SPDX-License-Identifier: Apache-2.0
"""RGB-D SLAM for dynamic scenes.

    slam = stillmap.Slam("camera.yaml", {"network.model": "yolo11n-seg.onnx"})
    for rgb, depth, stamp in camera:                   # H x W x 3 uint8, H x W uint16 or float32 [m], seconds
        T_world_camera = slam.push(rgb, depth, stamp)  # 4x4 float64 [m], or None
    results = slam.finish()
    results.write("results")

Poses are T_world_camera: p_world = T_world_camera * p_camera, in meters. docs/python.md describes the module.
"""
import os as _os
import sys as _sys

# ONNX Runtime is looked for in the active environment (docs/networks.md): that of this interpreter, even if its
# program was started without activating it.
if _sys.prefix != _sys.base_prefix:
    _os.environ.setdefault("VIRTUAL_ENV", _sys.prefix)

from ._native import (AteResult, Camera, Cloud, DetectedObject, DistanceField, Error, Finding, Frame, Imu, MapEvent, MergedPair, Mover,
                      MoverTrack, NavigationGrid, ObjectChange, ObservedFrame, Options, PoseUpdate, Results, RpeResult, Slam,
                      Snapshot, Source, Statistics, WarningEvent, __version__, ate, compare_maps, distance_field, merge_maps,
                      navigation_grid, presets, read_ply, read_trajectory, rpe, source, write_trajectory)
from .trajectory import Trajectory

__all__ = ["AteResult", "Camera", "Cloud", "DetectedObject", "DistanceField", "Error", "Finding", "Frame", "Imu", "MapEvent",
           "MergedPair", "Mover", "MoverTrack", "NavigationGrid", "ObjectChange", "ObservedFrame", "Options", "PoseUpdate",
           "Results", "RpeResult", "Slam", "Snapshot", "Source", "Statistics", "Trajectory", "WarningEvent", "__version__",
           "ate", "compare_maps", "distance_field", "merge_maps", "navigation_grid", "presets", "read_ply",
           "read_trajectory", "rpe", "source", "write_trajectory"]
