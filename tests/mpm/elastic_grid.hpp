// Elastic boxes to solve on: trilinear elements on a grid's nodes, fixed at their lowest x, with a
// modulus for each cell. What a hierarchy is to make easy, with nothing of particles in it.
#pragma once

#include <taut/mpm/multigrid.hpp>

#include <functional>

#include "grid_samples.hpp"

namespace taut::test {

/// Stiffness of a cube of side 1, E = 1, nu = 0.3; corner 4x + 2y + z.
inline Dense unit_cube_stiffness() {
  double const young = 1, poisson = 0.3;
  double const mu = young / (2 * (1 + poisson)),
               lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  Dense k = Dense::Zero(24, 24);
  double const root = std::sqrt(1.0 / 3);
  for (int q = 0; q < 8; ++q) {
    double const x[3] = {(1 + root * (q / 4 * 2 - 1)) / 2, (1 + root * (q / 2 % 2 * 2 - 1)) / 2,
                         (1 + root * (q % 2 * 2 - 1)) / 2};
    Eigen::Matrix<double, 8, 3> g;
    for (int a = 0; a < 8; ++a) {
      int const bit[3] = {a / 4, a / 2 % 2, a % 2};
      double w[3], d[3];
      for (int c = 0; c < 3; ++c) {
        w[c] = bit[c] == 1 ? x[c] : 1 - x[c];
        d[c] = bit[c] == 1 ? 1 : -1;
      }
      g(a, 0) = d[0] * w[1] * w[2];
      g(a, 1) = w[0] * d[1] * w[2];
      g(a, 2) = w[0] * w[1] * d[2];
    }
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) {
            double value = lambda * g(a, r) * g(b, c) + mu * g(a, c) * g(b, r);
            if (r == c) value += mu * g.row(a).dot(g.row(b));
            k(3 * a + r, 3 * b + c) += value / 8;
          }
  }
  return k;
}

/// M + h^2 K of cells^3 cells of `side` / cells metres, in kg: density 1000, a step of 1/24 s.
template <class S, class T>
struct ElasticBox {
  GridLevel<S> grid;
  MatrixLevel<S, T, 2> level;

  ElasticBox(int cells, bool clamped, std::function<double(Place)> const& young, double side = 1) {
    double const dx = side / cells, step = 1.0 / 24;
    grid.assign(leaf_list(box({-5, -2, 1}, {cells - 5, cells - 2, cells + 1})), dx);
    GridNodes<S> const& nodes = grid.nodes();
    std::vector<std::uint8_t> fixed;
    for (int i = 0; clamped && i < nodes.count; ++i) fixed.push_back(nodes.ijk(i, 0) == -5);
    level.resize(nodes, fixed_nodes<S>(fixed));
    auto const& a = level.matrix();
    set_zero(a);
    // Summed in fp64: what a float matrix is given should be exact but for one rounding.
    GridMatrix<S, double, 2> sum;
    sum.resize(nodes);
    set_zero(sum);
    Dense const k = unit_cube_stiffness();
    for (int x = 0; x < cells; ++x)
      for (int y = 0; y < cells; ++y)
        for (int z = 0; z < cells; ++z) {
          Place const low{x - 5, y - 2, z + 1};
          double const scale = step * step * dx * young({x, y, z}), mass = 1000 * dx * dx * dx / 8;
          for (int p = 0; p < 8; ++p) {
            int const i = nodes.node(low[0] + p / 4, low[1] + p / 2 % 2, low[2] + p % 2);
            for (int q = 0; q < 8; ++q)
              for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) {
                  sum.entry(i, StencilRow<2>::place(q / 4 - p / 4, q / 2 % 2 - p / 2 % 2,
                                                    q % 2 - p % 2, r, c)) +=
                      scale * k(3 * p + r, 3 * q + c) + (p == q && r == c ? mass : 0);
                }
          }
        }
    for (int i = 0; i < nodes.count; ++i)
      for (int e = 0; e < StencilRow<2>::numbers; ++e) a.entry(i, e) = T(sum.entry(i, e));
    level.finish();
  }
};

/// Iterations of conjugate gradients with preconditioner `apply(r, z)` until the residual in its
/// own norm has fallen by `tolerance`; `most` at most. The right-hand side is that of a random
/// solution.
template <class Level, class Apply>
int pcg_iterations(Level const& a, Apply const& apply, double tolerance, int most = 300) {
  using S = typename Level::Space;
  using T = typename Level::Scalar;
  int const n = a.size();
  auto p = random_field<S, T>(n, 17);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (a.fixed().extent(0) > 0 && a.fixed()(i) != 0) p(i, c) = 0;
  VectorField<T, S> r("r", n), z("z", n), y("y", n);
  a.product(p, r);
  apply(r, z);
  assign(p, z);
  double rho = flat(r, n).dot(flat(z, n));
  double const first = rho;
  for (int k = 1; k <= most; ++k) {
    a.product(p, y);
    double const alpha = rho / flat(p, n).dot(flat(y, n));
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) r(i, c) -= T(alpha * y(i, c));
    apply(r, z);
    double const next = flat(r, n).dot(flat(z, n));
    if (!(next > tolerance * tolerance * first)) return next >= 0 ? k : most + 1;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) p(i, c) = T(z(i, c) + next / rho * p(i, c));
    rho = next;
  }
  return most + 1;
}

/// By how much one more cycle reduces the error in the energy norm, after `times` of them.
template <class Level, class Apply>
double convergence_factor(Level const& a, Apply const& apply, int times = 15) {
  using S = typename Level::Space;
  using T = typename Level::Scalar;
  int const n = a.size();
  auto e = random_field<S, T>(n, 23);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (a.fixed().extent(0) > 0 && a.fixed()(i) != 0) e(i, c) = 0;
  VectorField<T, S> r("r", n), z("z", n);
  double energy = 0, factor = 0;
  for (int k = 0; k <= times; ++k) {
    a.product(e, r);
    double const before = std::exchange(energy, flat(e, n).dot(flat(r, n)));
    if (k > 0) factor = std::sqrt(energy / before);
    apply(r, z);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) e(i, c) -= z(i, c);
  }
  return factor;
}

}  // namespace taut::test
