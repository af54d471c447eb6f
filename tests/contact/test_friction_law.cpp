// The smoothed law of friction: against differences, at its seam, and what it loses to round-off.
#include <taut/contact/friction_coefficients.hpp>
#include <taut/contact/friction_law.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <limits>
#include <random>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Wide = long double;

double slope(double y) {
  SlipState<double> const s = evaluate_slip(Vec3<double>{y, 0, 0});
  return s.slope_ratio * s.y;
}

Vec3<double> random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Vec3<double> const v{normal(random), normal(random), normal(random)};
  return (1 / norm(v)) * v;
}

}  // namespace

TEST_CASE("the law is Coulomb's beyond the smoothing, and once differentiable across it",
          "[friction]") {
  for (double y : {1e-9, 0.01, 0.3, 0.77, 0.999, 1.001, 1.5, 40.0}) {
    CAPTURE(y);
    double const step = 1e-6 * y;
    double const difference = (friction_energy(y + step) - friction_energy(y - step)) / (2 * step);
    CHECK_THAT(slope(y), WithinRel(difference, 1e-8));
    double const curvature = (slope(y + step) - slope(y - step)) / (2 * step);
    CHECK_THAT(evaluate_slip(Vec3<double>{0, y, 0}).curvature, WithinAbs(curvature, 1e-8));
  }
  CHECK(friction_energy(0.0) == 0);
  CHECK(slope(0) == 0);
  CHECK(slope(1) == 1);
  CHECK(slope(1e9) == 1);
  double const below = std::nextafter(1.0, 0.0);
  CHECK_THAT(friction_energy(below), WithinRel(friction_energy(1.0), 1e-15));
  CHECK_THAT(slope(below), WithinRel(1, 1e-15));
}

TEST_CASE("a load t of the limit is held at the creep 1 - sqrt(1 - t)", "[friction]") {
  // docs: F20. tan(theta) = .5 on mu = .51, .6 and 1.
  double const creep[3] = {0.86, 0.59, 0.29}, mu[3] = {0.51, 0.6, 1.0};
  for (int k = 0; k < 3; ++k) {
    double const t = 0.5 / mu[k], y = 1 - std::sqrt(1 - t);
    CHECK_THAT(slope(y), WithinRel(t, 1e-14));
    CHECK_THAT(y, WithinAbs(creep[k], 0.005));
  }
}

TEMPLATE_TEST_CASE("changes of energy have errors relative to themselves", "[friction]", double,
                   float) {
  using T = TestType;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-7, 2), size(-8, 1);
  double worst = 0;
  int crossings = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    // From anywhere, or close to the seam, in any direction.
    double const from =
        trial % 3 == 0 ? 1 + 1e-3 * exponent(random) : std::pow(10, exponent(random));
    Vec3<double> const at = from * random_direction(random);
    Vec3<double> const by = (from * std::pow(10, size(random))) * random_direction(random);
    Vec3<T> before, step;
    for (int c = 0; c < 3; ++c) before[c] = T(at[c]), step[c] = T(by[c]);
    Vec3<T> const after = before + step;
    // What is exact: from `before`, by `step`.
    Vec3<Wide> b, s;
    for (int c = 0; c < 3; ++c) b[c] = before[c], s[c] = step[c];
    Vec3<Wide> const a = b + s;
    Wide const exact = friction_energy_change(b, a, s);
    Wide const apart = friction_energy(norm(a)) - friction_energy(norm(b));
    crossings += (norm(a) < 1) != (norm(b) < 1);
    // The wide change itself, where it does not cancel.
    if (std::abs(apart) > 1e-6L * friction_energy(norm(b))) {
      REQUIRE(std::abs(exact - apart) < 1e-11L * std::abs(apart));
    }
    // A step that turns the slip changes the energy by less than its first order: relative to that.
    Wide const first = evaluate_slip(b).slope_ratio * norm(b) * norm(s) + 1e-30L;
    Wide const error = std::abs(Wide(friction_energy_change(before, after, step)) - exact);
    worst = std::max(worst, double(error / std::max(std::abs(exact), first)));
  }
  CHECK(crossings > 500);
  CHECK(worst < 8 * double(std::numeric_limits<T>::epsilon()));
}

TEMPLATE_TEST_CASE("form and Hessian are one, and positive semi-definite", "[friction]", double,
                   float) {
  using T = TestType;
  double const tolerance = 64 * double(std::numeric_limits<T>::epsilon());
  std::mt19937 random(6);
  std::uniform_real_distribution<double> exponent(-30, 3);
  for (int trial = 0; trial < 5000; ++trial) {
    Vec3<double> const n = random_direction(random);
    Vec3<double> const across = cross(n, random_direction(random));
    double const y = trial % 50 == 0 ? 0 : std::pow(10, exponent(random));
    Vec3<double> const r = (y / norm(across)) * across;
    Vec3<double> p = random_direction(random);
    p = p - dot(n, p) * n;
    Vec3<T> nt, rt, pt;
    for (int c = 0; c < 3; ++c) nt[c] = T(n[c]), rt[c] = T(r[c]), pt[c] = T(p[c]);
    auto const s = evaluate_slip(rt);
    Sym3<T> const h = friction_hessian(s, nt);
    double const size = double(s.slope_ratio);
    double const form = double(friction_form(s, pt));
    CAPTURE(y, trial);
    CHECK(form >= 0);
    CHECK_THAT(double(quadratic(h, pt)), WithinAbs(form, tolerance * size));
    CHECK_THAT(double(quadratic(h, nt)), WithinAbs(0, tolerance * size));
    // Eigenvalues: f'/y across, f'' along.
    if (y > 1e-15) {
      Vec3<T> const along = (T(1) / s.y) * rt, side = cross(nt, along);
      CHECK_THAT(double(quadratic(h, along)), WithinAbs(double(s.curvature), tolerance * size));
      CHECK_THAT(double(quadratic(h, side)), WithinAbs(size, tolerance * size));
    }
  }
}

TEST_CASE("coefficients are by pairs of objects, and refused where they make no sense",
          "[friction]") {
  FrictionCoefficients mu(0.3);
  mu.set(1, 4, 0.7).set(2, 2, 0);
  CHECK(mu(0, 1) == 0.3);
  CHECK(mu(4, 1) == 0.7);
  CHECK(mu(1, 4) == 0.7);
  CHECK(mu(2, 2) == 0);
  CHECK(mu(9, 4) == 0.3);
  CHECK(mu(-1, 4) == 0.3);
  auto const matrix = mu.in_space<SerialSpace>();
  for (int a = -1; a < 7; ++a)
    for (int b = -1; b < 7; ++b) CHECK(matrix(a, b) == mu(a, b));
  CHECK_THROWS_WITH(FrictionCoefficients(-0.1), ContainsSubstring("a coefficient of -0.1"));
  CHECK_THROWS_WITH(FrictionCoefficients(std::nan("")), ContainsSubstring("finite number"));
  CHECK_THROWS_WITH(mu.set(0, 3, std::numeric_limits<double>::infinity()),
                    ContainsSubstring("between objects 0 and 3"));
  CHECK_THROWS_WITH(mu.set(-2, 3, 0.1), ContainsSubstring("no object -2"));
  CHECK(mu(0, 3) == 0.3);
}
