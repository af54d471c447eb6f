// The kernels as functions: partition of unity, reproduction of linear functions, derivatives,
// smoothness across cells, and the numbers of the reference.
#include <taut/mpm/spline.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <support/data.hpp>

#include <cmath>

namespace taut {
namespace {

using Catch::Matchers::WithinAbs;

template <class K>
struct Axis {
  double base;
  double w[K::width], d[K::width];
  explicit Axis(double x) : base(base_node<K>(x)) { K::weights(x - base - K::start, w, d); }
  /// The weight of node i, zero where it is not seen.
  double of(int i) const {
    int const a = i - static_cast<int>(base);
    return a >= 0 && a < K::width ? w[a] : 0;
  }
  double slope_of(int i) const {
    int const a = i - static_cast<int>(base);
    return a >= 0 && a < K::width ? d[a] : 0;
  }
};

TEMPLATE_TEST_CASE("a spline is a partition of unity that reproduces linear functions",
                   "[mpm][spline]", LinearSpline, QuadraticSpline, CubicSpline) {
  for (int k = -400; k <= 400; ++k) {
    double const x = 0.0173 * k;
    Axis<TestType> const at(x);
    double one = 0, place = 0, zero = 0, unit = 0, second = 0;
    for (int a = 0; a < TestType::width; ++a) {
      double const node = at.base + a;
      REQUIRE(at.w[a] >= 0);
      REQUIRE(std::abs(node - x) <= 0.5 * TestType::width + 1e-12);
      one += at.w[a];
      place += at.w[a] * node;
      zero += at.d[a];
      unit += at.d[a] * node;
      second += at.w[a] * (node - x) * (node - x);
    }
    CHECK_THAT(one, WithinAbs(1, 1e-15));
    CHECK_THAT(place, WithinAbs(x, 2e-15 * (1 + std::abs(x))));
    CHECK_THAT(zero, WithinAbs(0, 1e-15));
    CHECK_THAT(unit, WithinAbs(1, 2e-15 * (1 + std::abs(x))));
    if (TestType::inertia > 0) CHECK_THAT(second, WithinAbs(TestType::inertia, 1e-14));
  }
}

TEMPLATE_TEST_CASE("the slope of a spline is its derivative, also across cells", "[mpm][spline]",
                   LinearSpline, QuadraticSpline, CubicSpline) {
  double const h = 1e-5;
  for (int k = -100; k <= 100; ++k) {
    double const x = 0.0173 * k + 0.0004;
    Axis<TestType> const at(x), up(x + h), down(x - h);
    if (TestType::width == 2 && up.base != down.base) continue;  // a kink
    for (int i = static_cast<int>(at.base) - 1; i <= at.base + TestType::width; ++i) {
      CHECK_THAT((up.of(i) - down.of(i)) / (2 * h), WithinAbs(at.slope_of(i), 2e-5));
    }
  }
  // Where a particle changes its cell nothing jumps but the slope of the linear one.
  for (double x : {0.0, 0.5, 1.0, -0.5, -3.0}) {
    Axis<TestType> const left(x - 1e-9), right(x + 1e-9);
    for (int i = static_cast<int>(left.base) - 1; i <= left.base + TestType::width; ++i) {
      CHECK_THAT(left.of(i), WithinAbs(right.of(i), 3e-9));
      if (TestType::width > 2) CHECK_THAT(left.slope_of(i), WithinAbs(right.slope_of(i), 5e-9));
    }
  }
}

TEMPLATE_TEST_CASE("weights of a particle in fp32 are those in fp64", "[mpm][spline]", LinearSpline,
                   QuadraticSpline, CubicSpline) {
  for (int k = 0; k < 64; ++k) {
    double const t = k / 64.0;
    Weights<TestType, double> const wide({t, 1 - t, 0.5 * t});
    Weights<TestType, float> const narrow({float(t), float(1 - t), float(0.5 * t)});
    for (int a = 0; a < TestType::width; ++a)
      for (int b = 0; b < TestType::width; ++b)
        for (int c = 0; c < TestType::width; ++c) {
          CHECK_THAT(double(narrow.weight(a, b, c)), WithinAbs(wide.weight(a, b, c), 2e-7));
          for (int i = 0; i < 3; ++i) {
            CHECK_THAT(double(narrow.gradient(a, b, c)[i]),
                       WithinAbs(wide.gradient(a, b, c)[i], 4e-7));
          }
        }
  }
}

TEST_CASE("quadratic weights agree with the reference's", "[mpm][spline]") {
  auto const all = test::hot_vectors("bspline");
  REQUIRE(all.size() >= 3);
  for (auto const& one : all) {
    double const dx = one.at("dx");
    Vec3<double> t;
    for (int c = 0; c < 3; ++c) {
      double const x = double(one.at("X")[c]) / dx, base = base_node<QuadraticSpline>(x);
      // A place on a node is one by a hair, and may be given to either cell.
      int const shift = static_cast<int>(base) - int(one.at("base")[c]);
      REQUIRE(std::abs(shift) <= 1);
      t[c] = x - base - QuadraticSpline::start;
      double w[3], d[3];
      QuadraticSpline::weights(t[c], w, d);
      for (int a = 0; a < 3; ++a) {
        int const reference = a + shift;
        if (reference < 0 || reference > 2) {
          CHECK_THAT(w[a], WithinAbs(0, 1e-12));
          continue;
        }
        CHECK_THAT(w[a], WithinAbs(one.at("w")[c][reference], 1e-12));
        CHECK_THAT(d[a] / dx, WithinAbs(one.at("dw_dx")[c][reference], 1e-9 / dx));
      }
    }
    Weights<QuadraticSpline, double> const at(t);
    double sum = 0;
    for (double const w : one.at("W27")) sum += w;
    CHECK_THAT(sum, WithinAbs(1, 1e-12));
    CHECK_THAT(at.weight(1, 1, 1), WithinAbs(one.at("W27")[13], 1e-12));
  }
}

}  // namespace
}  // namespace taut
