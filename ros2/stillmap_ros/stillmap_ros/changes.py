# SPDX-License-Identifier: Apache-2.0
"""What changes in the live cloud from one to the next."""
import numpy as np


class Changes:
    """Compares clouds of the live map, which have one point in each voxel that has a surface."""

    def __init__(self):
        self.voxels, self.points = np.zeros(0, np.uint64), np.zeros((0, 3), np.float32)

    def update(self, points, voxels):
        """Returns which points are in voxels without a point in the cloud before (bool), and the points of that cloud
        whose voxels have none now. voxels: their numbers"""
        added = np.isin(voxels, self.voxels, assume_unique=True, invert=True)
        removed = self.points[np.isin(self.voxels, voxels, assume_unique=True, invert=True)]
        self.voxels, self.points = voxels, points
        return added, removed
