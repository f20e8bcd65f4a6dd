# SPDX-License-Identifier: Apache-2.0
"""The 2-D grid of a live cloud, for Nav2."""
from dataclasses import dataclass

import numpy as np

UNKNOWN, FREE, OCCUPIED = -1, 0, 100


@dataclass
class Grid:
    cell: float  # side of a cell [m]
    origin: tuple[float, float]  # corner of cell (0, 0) in the map [m]
    values: np.ndarray  # int8, rows along y


def grown(cells):
    """Returns the cells and their eight neighbors."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]


def closed(cells):
    """Returns the cells without holes of one cell."""
    return ~grown(~grown(cells)) | cells


def grid_of_cloud(points, way, cell, lowest, highest, radius):
    """Returns the grid of points N x 3 [m] whose z is the height above the floor, or None without any.

    A cell is occupied if points are in it between the heights; otherwise it is free if floor was seen in it, or if the
    robot, of this radius [m], drove over it.
    way: positions of the robot, M x 2 [m]."""
    flat = [points[:, :2], np.reshape(way, (-1, 2))]
    if not len(flat[0]) and not len(flat[1]):
        return None
    both = np.concatenate(flat)
    low = np.floor(both.min(axis=0) / cell - radius / cell - 1)
    size = (np.ceil(both.max(axis=0) / cell + radius / cell + 1) - low).astype(int)

    def marked(positions):
        cells = np.zeros(size[::-1], bool)
        u, v = (np.floor(positions / cell) - low).astype(int).T
        cells[v, u] = True
        return cells
    z = points[:, 2]
    occupied = marked(flat[0][(z >= lowest) & (z <= highest)])
    free = closed(marked(flat[0][np.abs(z) < lowest]))
    driven = marked(flat[1])
    for _ in range(int(radius / cell)):
        driven = grown(driven)
    values = np.full(occupied.shape, UNKNOWN, np.int8)
    values[free | driven] = FREE
    values[occupied] = OCCUPIED
    return Grid(cell, (float(low[0] * cell), float(low[1] * cell)), values)
