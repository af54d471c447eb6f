// Where the minimum of a chain is, by Newton's method and block elimination in plain serial code.
#pragma once

#include "toy_objectives.hpp"

#include <cmath>
#include <vector>

namespace taut::toy {

/// Cramer's rule.
inline Mat3<double> inverse(Mat3<double> const& a) {
  return (1 / determinant(a)) * transpose(cofactor(a));
}

/// Solves H s = -g for a block tridiagonal H, by elimination from the front.
inline std::vector<Vec3<double>> newton_step(BlockCsr<DefaultSpace, double> const& h,
                                             std::vector<Vec3<double>> const& g) {
  int const n = static_cast<int>(g.size());
  std::vector<Mat3<double>> pivot(g.size());
  std::vector<Vec3<double>> s(g.size());
  for (int i = 0; i < n; ++i) {
    pivot[i] = h.block(h.find(i, i));
    s[i] = -g[i];
    if (i == 0) continue;
    Mat3<double> const factor = h.block(h.find(i, i - 1)) * inverse(pivot[i - 1]);
    pivot[i] = pivot[i] - factor * h.block(h.find(i - 1, i));
    s[i] = s[i] - factor * s[i - 1];
  }
  for (int i = n - 1; i >= 0; --i) {
    if (i + 1 < n) s[i] = s[i] - h.block(h.find(i, i + 1)) * s[i + 1];
    s[i] = inverse(pivot[i]) * s[i];
  }
  return s;
}

/// The minimum of the chain next to x, to round-off.
template <class Bond>
typename Chain<Bond>::Positions minimum(Chain<Bond> const& chain,
                                        typename Chain<Bond>::Positions const& x) {
  int const n = chain.size();
  typename Chain<Bond>::Positions const at("minimum", n);
  typename Chain<Bond>::Field const g("gradient", n), p("step", n);
  assign(at, x);
  auto hessian = chain.pattern(x);
  for (int iteration = 0; iteration < 200; ++iteration) {
    chain.gradient(at, g);
    chain.assemble(at, hessian);
    std::vector<Vec3<double>> gradient(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) gradient[i] = {g(i, 0), g(i, 1), g(i, 2)};
    auto const step = newton_step(hessian, gradient);
    double largest = 0;
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) {
        p(i, c) = step[i][c];
        largest = std::max(largest, std::abs(step[i][c]));
      }
    }
    double alpha = std::min(1.0, 0.9 * chain.max_step(at, p, 2.0));
    while (largest > 1e-8 && chain.difference(at, p, alpha) > 0) alpha /= 2;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) at(i, c) += alpha * p(i, c);
    if (largest < 1e-13) break;
  }
  return at;
}

/// Mass-weighted rms distance of x to the minimum next to it, m. `chain` is the fp64 twin of what
/// was minimised.
template <class Bond, class Positions>
double distance_to_minimum(Chain<Bond> const& chain, Positions const& x) {
  typename Chain<Bond>::Positions const y("x", chain.size());
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) y(i, c) = x(i, c);
  auto const best = minimum(chain, y);
  double sum = 0;
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) sum += chain.mass()(i) * square(y(i, c) - best(i, c));
  return std::sqrt(sum / chain.scale().mass);
}

}  // namespace taut::toy
