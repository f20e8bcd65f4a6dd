# SPDX-License-Identifier: Apache-2.0
from typing import Any

import numpy as np
from numpy.typing import NDArray

COLUMNS: int

class Trajectory(np.ndarray[Any, np.dtype[np.float64]]):
    @property
    def stamps(self) -> NDArray[np.float64]: ...  # N
    @property
    def positions(self) -> NDArray[np.float64]: ...  # N x 3
    @property
    def quaternions(self) -> NDArray[np.float64]: ...  # N x 4
    def matrices(self) -> NDArray[np.float64]: ...  # N x 4 x 4
    def to_evo(self) -> Any: ...
