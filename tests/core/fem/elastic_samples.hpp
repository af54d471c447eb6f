// What the tests of elastic bodies share: a twisted body of two materials, and the layouts.
#pragma once

#include "elastic_oracle.hpp"

#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/presets/elastic.hpp>

#include <algorithm>
#include <cmath>

namespace taut::test {

struct Sample {
  TetMesh rest;
  std::vector<Point> x;
  std::vector<Point> p;
  std::vector<int> material_of_tet;

  explicit Sample(int resolution = 6, double jitter = 0.02) {
    TetMesh const mesh = make_shape(BoxShape{{1, 1.2, 0.9}}, resolution);
    Ordering const order = locality_order(mesh);
    for (int v : order.vertices) rest.points.push_back(mesh.points[v]);
    for (int t : order.tets) {
      Tet tet;
      for (int a = 0; a < 4; ++a) tet[a] = order.new_vertex[mesh.tets[t][a]];
      rest.tets.push_back(tet);
      material_of_tet.push_back(rest.points[tet[0]][1] > 0 ? 1 : 0);
    }
    std::vector<Point> const noise = random_points(rest.points.size(), jitter, 3);
    p = random_points(rest.points.size(), 1, 4);
    for (std::size_t i = 0; i < rest.points.size(); ++i) {
      Point const& X = rest.points[i];
      // A twist and a stretch, far from the origin.
      double const angle = 0.8 * X[1], c = std::cos(angle), s = std::sin(angle);
      x.push_back({3 + 1.1 * (c * X[0] - s * X[2]) + noise[i][0], -7 + 0.9 * X[1] + noise[i][1],
                   1.1 * (s * X[0] + c * X[2]) + noise[i][2]});
    }
    // Tets come in groups of one material.
    std::stable_sort(rest.tets.begin(), rest.tets.end(), [&](Tet const& a, Tet const& b) {
      return (rest.points[a[0]][1] > 0) < (rest.points[b[0]][1] > 0);
    });
    std::sort(material_of_tet.begin(), material_of_tet.end());
  }
};

inline std::vector<Lame<double>> const two_materials = {lame_parameters(1e4, 0.3),
                                                        lame_parameters(1e5, 0.45)};

inline double largest(std::vector<Point> const& field) {
  double m = 0;
  for (Point const& p : field)
    for (double c : p) m = std::max(m, std::abs(c));
  return m;
}

template <class View>
auto host(View const& v) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), v);
}

using Right = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutRight>;
using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;

}  // namespace taut::test
