#include <taut/core/sparse/ritz_value.hpp>

#include <algorithm>
#include <cmath>

namespace taut {

double largest_tridiagonal(std::vector<double> const& diagonal, std::vector<double> const& beside) {
  // Gershgorin's circles hold all eigenvalues.
  std::size_t const n = diagonal.size();
  double low = diagonal[0], high = diagonal[0];
  for (std::size_t i = 0; i < n; ++i) {
    double const radius =
        (i > 0 ? std::abs(beside[i - 1]) : 0) + (i + 1 < n ? std::abs(beside[i]) : 0);
    low = std::min(low, diagonal[i] - radius);
    high = std::max(high, diagonal[i] + radius);
  }
  // Sturm: all eigenvalues are below x where all pivots of T - x are negative.
  auto const all_below = [&](double x) {
    double pivot = diagonal[0] - x;
    for (std::size_t i = 1; i < n && pivot < 0; ++i) {
      pivot = diagonal[i] - x - beside[i - 1] * beside[i - 1] / pivot;
    }
    return pivot < 0;
  };
  for (int k = 0; k < 100 && high > low; ++k) {
    double const x = low + (high - low) / 2;
    if (x <= low || x >= high) break;
    (all_below(x) ? high : low) = x;
  }
  return high;
}

RitzValue largest_ritz_value(std::vector<double> const& diagonal,
                             std::vector<double> const& beside) {
  std::size_t const n = diagonal.size();
  double const value =
      largest_tridiagonal(diagonal, {beside.begin(), beside.begin() + std::ptrdiff_t(n - 1)});
  // The eigenvector row by row, of which the last number tells the residual.
  double before = 0, last = 1, square = 1;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    double const next =
        ((value - diagonal[i]) * last - (i > 0 ? beside[i - 1] * before : 0)) / beside[i];
    before = last;
    last = next;
    square += next * next;
  }
  return {value, beside[n - 1] * std::abs(last) / std::sqrt(square)};
}

RitzValue LanczosByConjugates::add(double alpha, double beta) {
  beta = std::max(beta, 0.0);
  diagonal_.push_back(1 / alpha + beta_ / alpha_);
  beside_.push_back(std::sqrt(beta) / alpha);
  alpha_ = alpha;
  beta_ = beta;
  return largest_ritz_value(diagonal_, beside_);
}

}  // namespace taut
