// The smallest positive root of a cubic, against roots that are chosen.
#include <taut/core/math/cubic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

using namespace taut;
using Catch::Matchers::WithinRel;

TEST_CASE("where a cubic first vanishes", "[math]") {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  CHECK(smallest_positive_root(1, 0, 0, 0) == infinity);
  CHECK(smallest_positive_root(1, 1, 1, 1) == infinity);
  CHECK(smallest_positive_root(0, 1, 0, 0) == 0);
  CHECK(smallest_positive_root(1, std::nan(""), 0, 0) == 0);
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 100000; ++k) {
    // Roots of known size; the polynomial is scaled to be positive at 0.
    double const size = std::pow(10.0, 6 * uniform(rng));
    double r[3] = {size * uniform(rng), size * uniform(rng), size * uniform(rng)};
    if (k % 10 == 0) r[1] = r[0];  // double roots: touched, perhaps not crossed
    double const s = -r[0] * r[1] * r[2] > 0 ? 1 : -1;
    double const a = -s * r[0] * r[1] * r[2], b = s * (r[0] * r[1] + r[1] * r[2] + r[2] * r[0]),
                 c = -s * (r[0] + r[1] + r[2]);
    double expected = infinity;
    for (double root : r) expected = root > 0 ? std::min(expected, root) : expected;
    double const found = smallest_positive_root(a, b, c, s);
    double const at_most = size * std::pow(10.0, 2 * uniform(rng));
    double const near = smallest_positive_root(a, b, c, s, at_most);
    CHECK((found <= at_most ? near == found : near > at_most));
    if (k % 10 == 0 && found > expected * (1 + 1e-6)) {
      // A double root may be missed by rounding, where the polynomial only touches zero.
      CHECK_THAT(r[0], WithinRel(expected, 1e-6));
      continue;
    }
    CHECK_THAT(found, WithinRel(expected, 1e-6));
  }
}

TEST_CASE("a root is found whatever round-off has left in the other coefficients", "[math]") {
  // A body that moves along one axis has volumes linear in the step, but for coefficients of any
  // small size, whose stationary points and other roots are anywhere up to 1e60.
  CHECK_THAT(smallest_positive_root(2.1e-6, -0.21, 7e-47, 3e-59), WithinRel(1e-5, 1e-14));
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  auto const size = [&](double smallest) {
    return std::pow(10.0, smallest * (0.5 + 0.5 * uniform(rng)));
  };
  int finite = 0;
  for (int k = 0; k < 100000; ++k) {
    double const a = size(-10), b = size(-15) * uniform(rng), c = size(-60) * uniform(rng),
                 d = size(-60) * uniform(rng);
    long double const t = smallest_positive_root(a, b, c, d);
    if (t == std::numeric_limits<double>::infinity()) {
      CHECK((b >= 0 || c > 0 || d > 0));
      continue;
    }
    ++finite;
    auto const value = [&](long double s) { return a + s * (b + s * (c + s * d)); };
    long double const terms = a + t * (std::abs(b) + t * (std::abs(c) + t * std::abs(d)));
    if (!(value(t) > -1e-15L * terms && value(t * (1 + 1e-12L)) < 1e-11L * terms)) {
      FAIL(a << ' ' << b << ' ' << c << ' ' << d << ": " << t);
    }
  }
  CHECK(finite > 50000);
}
