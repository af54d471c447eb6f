// Rest shape of linear tets: Ds = [x1-x0 | x2-x0 | x3-x0], F = Ds B with B = Dm^-1, volume W.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/math/matrix.hpp>

#include <span>
#include <vector>

namespace taut {

struct RestShape {
  Mat3<double> B;  ///< inverse of the rest edge matrix, 1/m
  double W;        ///< volume |det Dm| / 6, m^3
};

RestShape rest_shape(std::vector<Point> const& rest, Tet const& tet);

/// Lumped mass per vertex, kg: a quarter of each tet's mass goes to each of its vertices.
std::vector<double> lumped_mass(TetMesh const& rest, std::span<double const> density_per_tet);

/// Mean length of the edges of the mesh, m: the length in which tolerances are measured.
double mean_edge_length(TetMesh const& rest);

}  // namespace taut
