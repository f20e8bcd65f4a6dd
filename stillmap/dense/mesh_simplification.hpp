// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/mesh.hpp"

namespace stillmap {

/// Returns the mesh with fewer triangles, by edge collapses with quadric error metrics (Garland and
/// Heckbert 1997; meshoptimizer). The vertices that remain do not move. Distances from the former
/// surface are mostly below `error` [m], and below three times that.
TriangleMesh simplified(const TriangleMesh& mesh, double error);

}  // namespace stillmap
