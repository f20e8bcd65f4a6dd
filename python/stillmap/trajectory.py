# SPDX-License-Identifier: Apache-2.0
"""Trajectories as NumPy arrays."""
import numpy as np

COLUMNS = 8  # of a row in TUM format


class Trajectory(np.ndarray):
    """Camera poses T_world_camera, N x 8 float64 in rows of TUM format: timestamp [s], translation x y z [m],
    quaternion x y z w. It can be used like any other array."""

    @property
    def stamps(self):
        """Timestamps, N float64 [s]."""
        return np.asarray(self)[:, 0]

    @property
    def positions(self):
        """Positions of the camera, N x 3 float64 [m]."""
        return np.asarray(self)[:, 1:4]

    @property
    def quaternions(self):
        """Orientations of the camera, N x 4 float64, x y z w."""
        return np.asarray(self)[:, 4:8]

    def matrices(self):
        """Returns the poses as matrices, N x 4 x 4 float64."""
        x, y, z, w = self.quaternions.T
        matrices = np.zeros((len(self), 4, 4))
        matrices[:, :3, :3] = np.stack([
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=-1),
            np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=-1),
            np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1)], axis=-2)
        matrices[:, :3, 3] = self.positions
        matrices[:, 3, 3] = 1
        return matrices

    def to_evo(self):
        """Returns an evo.core.trajectory.PoseTrajectory3D (`pip install evo`)."""
        if self.ndim != 2 or self.shape[1] != COLUMNS:
            raise ValueError(f"a trajectory has the shape (N, {COLUMNS}), this array {self.shape}")
        from evo.core.trajectory import PoseTrajectory3D
        x, y, z, w = self.quaternions.T
        return PoseTrajectory3D(positions_xyz=self.positions, timestamps=self.stamps,
                                orientations_quat_wxyz=np.stack([w, x, y, z], axis=-1))
