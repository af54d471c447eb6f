// Grids and matrices to test levels on, and plain readings of them: maps of places, dense matrices.
#pragma once

#include <taut/mpm/grid_level.hpp>
#include <taut/mpm/level_operator.hpp>

#include <array>
#include <map>
#include <random>
#include <set>

#include "support/dense.hpp"

namespace taut::test {

using Host = Kokkos::DefaultHostExecutionSpace;
using Right = Space<Host, Kokkos::LayoutRight>;
using Left = Space<Host, Kokkos::LayoutLeft>;
using Place = std::array<int, 3>;

inline LeafList leaf_list(std::set<Place> const& places) {
  std::map<Place, LeafMask> leaves;
  for (Place const& p : places) {
    LeafMask& mask = leaves[{p[0] & ~7, p[1] & ~7, p[2] & ~7}];
    mask[p[0] & 7] |= std::uint64_t(1) << (8 * (p[1] & 7) + (p[2] & 7));
  }
  LeafList list;
  for (auto const& [origin, mask] : leaves) {
    list.origin.push_back(origin);
    list.mask.push_back(mask);
  }
  return list;
}

inline std::set<Place> box(Place const& low, Place const& high) {
  std::set<Place> places;
  for (int x = low[0]; x <= high[0]; ++x)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int z = low[2]; z <= high[2]; ++z) places.insert({x, y, z});
  return places;
}

/// A ragged set: a box with holes, and crumbs around it.
inline std::set<Place> ragged(unsigned seed, int size = 9) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coin(0, 3), far(-size, 2 * size);
  std::set<Place> places;
  for (Place const& p : box({-3, 2, -5}, {-3 + size, 2 + size / 2, -5 + size / 3}))
    if (coin(random) > 0) places.insert(p);
  for (int k = 0; k < 2 * size; ++k) places.insert({far(random), far(random), far(random)});
  return places;
}

/// What a few quadratic kernels reach, some of them apart.
inline std::set<Place> reached(unsigned seed, int kernels = 5, int spread = 3) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> uniform(-spread, spread);
  std::set<Place> places;
  for (int k = 0; k < kernels; ++k) {
    Place const p{uniform(random) - 1, uniform(random), uniform(random) / 2};
    places.merge(box(p, {p[0] + 2, p[1] + 2, p[2] + 2}));
  }
  return places;
}

template <class S>
Place place(GridNodes<S> const& nodes, int i) {
  return {nodes.ijk(i, 0), nodes.ijk(i, 1), nodes.ijk(i, 2)};
}

/// Fills a matrix of a level from a dense one, which has blocks within the radius alone.
template <class S, class T, int radius>
void fill(GridMatrix<S, T, radius> const& a, Dense const& dense) {
  set_zero(a);
  for (int i = 0; i < a.size(); ++i)
    for (int j = 0; j < a.size(); ++j) {
      int d[3];
      bool fits = true;
      for (int c = 0; c < 3; ++c) {
        d[c] = a.nodes.ijk(j, c) - a.nodes.ijk(i, c);
        fits = fits && std::abs(d[c]) <= radius;
      }
      if (!fits) continue;
      Mat3<T> b;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) b(r, c) = T(dense(3 * i + r, 3 * j + c));
      a.set(i, d[0], d[1], d[2], b);
    }
}

template <class S, class T, int radius>
Dense dense(GridMatrix<S, T, radius> const& a) {
  Dense m = Dense::Zero(3 * a.size(), 3 * a.size());
  for (int i = 0; i < a.size(); ++i)
    for (int j = 0; j < a.size(); ++j) {
      int d[3];
      bool fits = true;
      for (int c = 0; c < 3; ++c) {
        d[c] = a.nodes.ijk(j, c) - a.nodes.ijk(i, c);
        fits = fits && std::abs(d[c]) <= radius;
      }
      if (!fits) continue;
      Mat3<T> const b = a.block(i, d[0], d[1], d[2]);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) m(3 * i + r, 3 * j + c) = double(b(r, c));
    }
  return m;
}

/// Symmetric, positive definite, random, with blocks within the radius.
template <class S>
Dense random_matrix(GridNodes<S> const& nodes, int radius, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int const n = 3 * nodes.count;
  Dense m = Dense::Zero(n, n);
  for (int i = 0; i < nodes.count; ++i)
    for (int j = 0; j <= i; ++j) {
      Place const p = place(nodes, i), q = place(nodes, j);
      bool fits = true;
      for (int c = 0; c < 3; ++c) fits = fits && std::abs(p[c] - q[c]) <= radius;
      if (!fits) continue;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
          m(3 * i + r, 3 * j + c) = uniform(random);
          m(3 * j + c, 3 * i + r) = m(3 * i + r, 3 * j + c);
        }
    }
  for (int k = 0; k < n; ++k) m(k, k) = 1 + m.row(k).cwiseAbs().sum();
  return m;
}

template <class S, class T>
VectorField<T, S> random_field(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  VectorField<T, S> field("random", n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) field(i, c) = T(uniform(random));
  return field;
}

template <class Field>
Eigen::VectorXd flat(Field const& field, int n) {
  Eigen::VectorXd v(3 * n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) v(3 * i + c) = double(field(i, c));
  return v;
}

/// Relative, in the norm of all numbers.
template <class Field>
double difference(Field const& field, Eigen::VectorXd const& expected) {
  Eigen::VectorXd const found = flat(field, static_cast<int>(expected.size()) / 3);
  return (found - expected).norm() / (1e-300 + expected.norm());
}

/// Prolongation of an embedding between two sets of nodes, in its definition; rows of fixed nodes
/// are zero.
template <class Embedding, class S>
Dense prolongation(GridNodes<S> const& fine, GridNodes<S> const& coarse,
                   std::vector<std::uint8_t> const& fixed = {}) {
  Dense p = Dense::Zero(3 * fine.count, 3 * coarse.count);
  for (int f = 0; f < fine.count; ++f) {
    if (!fixed.empty() && fixed[f] != 0) continue;
    for (int c = 0; c < coarse.count; ++c) {
      double w = 1;
      for (int a = 0; a < 3; ++a) {
        int const d = fine.ijk(f, a) - 2 * coarse.ijk(c, a);
        w *= std::abs(d) <= Embedding::radius ? Embedding::weight(d) : 0;
      }
      for (int k = 0; k < 3; ++k) p(3 * f + k, 3 * c + k) = w;
    }
  }
  return p;
}

template <class S>
FixedNodes<S> fixed_nodes(std::vector<std::uint8_t> const& flags) {
  Kokkos::View<std::uint8_t*, typename S::memory> view("fixed", flags.size());
  for (std::size_t i = 0; i < flags.size(); ++i) view(i) = flags[i];
  return view;
}

template <class S_, class T, int radius_>
struct Case {
  using S = S_;
  using Real = T;
  static constexpr int radius = radius_;
};

/// A level with a random matrix.
template <class C>
struct Sample {
  using S = typename C::S;
  using Real = typename C::Real;
  GridLevel<S> grid;
  MatrixLevel<S, Real, C::radius> level;
  Dense matrix;

  explicit Sample(std::set<Place> const& places, std::vector<std::uint8_t> const& fixed = {}) {
    grid.assign(leaf_list(places), 0.1);
    matrix = random_matrix(grid.nodes(), C::radius, 3);
    level.resize(grid.nodes(), fixed_nodes<S>(fixed));
    fill(level.matrix(), matrix);
    level.finish();
  }
  int size() const { return level.size(); }
};

/// The quadratic B-splines at a point, with spacing 1: weights and gradients of 27 nodes.
struct Support {
  struct Value {
    double weight;
    Vec3<double> gradient;
  };
  std::map<Place, Value> nodes;

  explicit Support(double const (&x)[3]) {
    int base[3];
    double w[3][3], d[3][3];
    for (int c = 0; c < 3; ++c) {
      base[c] = static_cast<int>(std::floor(x[c] - 0.5));
      double const t = x[c] - base[c];
      double const weights[] = {(1.5 - t) * (1.5 - t) / 2, 0.75 - (t - 1) * (t - 1),
                                (t - 0.5) * (t - 0.5) / 2};
      double const slopes[] = {t - 1.5, -2 * (t - 1), t - 0.5};
      std::copy(weights, weights + 3, w[c]);
      std::copy(slopes, slopes + 3, d[c]);
    }
    for (int i = 0; i < 27; ++i) {
      int const a = i / 9, b = i / 3 % 3, c = i % 3;
      nodes[{base[0] + a, base[1] + b, base[2] + c}] = {
          w[0][a] * w[1][b] * w[2][c],
          {d[0][a] * w[1][b] * w[2][c], w[0][a] * d[1][b] * w[2][c], w[0][a] * w[1][b] * d[2][c]}};
    }
  }
};

}  // namespace taut::test
