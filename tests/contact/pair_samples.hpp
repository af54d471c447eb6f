// Pairs to test contact on: random ones and every degenerate kind, drawn in double and rounded to
// the precision under test.
#pragma once

#include <taut/contact/closest_features.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace taut::test::pairs {

using Random = std::mt19937_64;
using Corners = std::array<Vec3<double>, 4>;

inline double uniform(Random& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}
inline double log_uniform(Random& random, double from, double to) {
  return std::exp(uniform(random, std::log(from), std::log(to)));
}
inline Vec3<double> uniform_vector(Random& random, double size = 1) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}
inline Vec3<double> uniform_direction(Random& random) {
  for (;;) {
    Vec3<double> const v = uniform_vector(random);
    double const length = norm(v);
    if (length > 0.1 && length < 1) return (1 / length) * v;
  }
}
inline Corners uniform_corners(Random& random, double size = 1) {
  return {uniform_vector(random, size), uniform_vector(random, size), uniform_vector(random, size),
          uniform_vector(random, size)};
}

/// A kind of pair: four vertices, to be read as point and triangle or as two edges.
struct Family {
  char const* name;
  std::function<Corners(Random&)> draw;
};
std::vector<Family> families();

/// The distance by golden-section search in long double: over the lines of the triangle parallel to
/// one edge, or over the points of one edge, of the distance to a segment, which is convex.
long double searched_distance(PairKind kind, Vec3<long double> const (&y)[4]);

/// A point and triangle, or two edges, with edges of 0.5 to 1.5 times `size`, whose closest points
/// lie well inside the given feature, `gap` apart.
Corners corners_of(Random& random, Feature feature, double gap, double size);

inline constexpr int features = 16;
inline PairKind kind_of(Feature f) {
  return f <= Feature::vertex_2 ? PairKind::point_triangle : PairKind::edge_edge;
}

template <class To, class From>
Vec3<To> cast(Vec3<From> const& v) {
  return {static_cast<To>(v[0]), static_cast<To>(v[1]), static_cast<To>(v[2])};
}

}  // namespace taut::test::pairs
