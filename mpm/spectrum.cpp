#include <taut/mpm/spectrum.hpp>

#include <algorithm>

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

}  // namespace taut
