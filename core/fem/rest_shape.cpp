#include <taut/core/fem/rest_shape.hpp>

#include <cmath>

namespace taut {

namespace {
Mat3<double> edge_matrix(std::vector<Point> const& x, Tet const& tet) {
  Mat3<double> d;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) d(i, j) = x[tet[j + 1]][i] - x[tet[0]][i];
  return d;
}
}  // namespace

RestShape rest_shape(std::vector<Point> const& rest, Tet const& tet) {
  Mat3<double> const Dm = edge_matrix(rest, tet);
  double const det = determinant(Dm);
  return {(1 / det) * transpose(cofactor(Dm)), std::abs(det) / 6};
}

std::vector<double> lumped_mass(TetMesh const& rest, std::span<double const> density_per_tet) {
  std::vector<double> mass(rest.points.size(), 0.0);
  for (std::size_t t = 0; t < rest.tets.size(); ++t) {
    double const W = std::abs(determinant(edge_matrix(rest.points, rest.tets[t]))) / 6;
    for (std::int32_t v : rest.tets[t]) mass[v] += 0.25 * density_per_tet[t] * W;
  }
  return mass;
}

double mean_edge_length(TetMesh const& rest) {
  // Every tet counts its six edges: an edge weighs as much as the tets around it.
  double sum = 0;
  for (Tet const& tet : rest.tets) {
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) {
        Point const &p = rest.points[tet[a]], &q = rest.points[tet[b]];
        sum += std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
      }
    }
  }
  return rest.tets.empty() ? 0 : sum / (6.0 * static_cast<double>(rest.tets.size()));
}

}  // namespace taut
