# SPDX-License-Identifier: Apache-2.0
"""The smallest use of an installed Python module stillmap; prints its version."""
import numpy as np

import stillmap

slam = stillmap.Slam(stillmap.Camera(160, 120, fx=140, fy=140, cx=80, cy=60, depth_factor=1000))
for i in range(3):
    slam.push(np.full((120, 160, 3), 128, np.uint8), np.full((120, 160), 2, np.float32), i / 30)
assert len(slam.finish().trajectory) <= 3
print("stillmap", stillmap.__version__)
