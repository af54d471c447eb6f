// The signed distance to a closed surface on a lattice around it: how boundaries are given by
// files.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/mpm/solid.hpp>

#include <array>
#include <string>
#include <vector>

namespace taut {

/// Distances at lowest + spacing (i, j, k), m, negative inside; values[(i n[1] + j) n[2] + k].
/// Farther from the surface than the band they are the band's width, with their sign.
struct DistanceField {
  Vec3<double> lowest{};
  double spacing = 0;
  std::array<int, 3> n{};
  double band = 0;
  std::vector<float> values;
};

/// Of the surface of a solid, whose inside decides the sign. `band` must be above `spacing`. Throws
/// Error for a lattice of more than 2^28 points; `name` stands for the surface in messages.
DistanceField distance_field(TriangleMesh const& surface, Solid const& solid, double spacing,
                             double band, std::string const& name);

}  // namespace taut
