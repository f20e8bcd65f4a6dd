#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps a recording with ground truth and evaluates the trajectory with evo, next to Stillmap's own figure.

  pip install evo           evaluate_evo.py FOLDER

Tried with evo 1.38.1 on a rendered recording: both figures are equal.
"""
import sys

from evo.core import metrics, sync
from evo.tools import file_interface

import stillmap

source = stillmap.source(sys.argv[1])
slam = stillmap.Slam(source.camera, dense={"enabled": False})
for frame in source:
    slam.push(frame)
trajectory = slam.finish().trajectory

truth_file = sys.argv[1] + "/groundtruth.txt"
truth = file_interface.read_tum_trajectory_file(truth_file)
truth, estimate = sync.associate_trajectories(truth, trajectory.to_evo(), max_diff=0.02)
estimate.align(truth)
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((truth, estimate))
print(f"evo:      {ape.get_statistic(metrics.StatisticsType.rmse):.6f} m")
print(f"stillmap: {stillmap.ate(truth_file, trajectory).translation.rmse:.6f} m")
