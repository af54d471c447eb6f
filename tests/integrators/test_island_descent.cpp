// What a minimiser by islands makes of bodies that are joined within a minimisation, of bounds, and
// of rules: on chains of springs, which act on each other only if the test says so.
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>

#include <catch2/catch_test_macros.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

using namespace taut;

namespace {

/// k/2 (|a - b|^2 - 1)^2
struct Spring {
  static constexpr int vertices = 2;
  double k = 3e3;
  KOKKOS_FUNCTION static double excess(Vec3<double> const& d) { return dot(d, d) - 1; }
  KOKKOS_FUNCTION double value(int, Vec3<double> const (&x)[2]) const {
    double const e = excess(x[0] - x[1]);
    return 0.5 * k * e * e;
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int, Vec3<double> const (&x)[2], int a) const {
    Vec3<double> const d = x[0] - x[1];
    return ((a == 0 ? 2 : -2) * k * excess(d)) * d;
  }
  KOKKOS_FUNCTION Mat3<double> curvature(int, Vec3<double> const (&x)[2], int a, int b) const {
    Vec3<double> const d = x[0] - x[1];
    double const sign = a == b ? 1 : -1, e = excess(d);
    return sign * ((4 * k) * outer(d, d) + (e > 0 ? 2 * k * e : 0) * identity3<double>());
  }
};

using Springs = Potential<Inertia<Fp64>, StencilTerm<Spring, Fp64>>;

/// Chains that are all alike. From the regrouping `joined_from` on, what is near is all of them.
struct Chains : Springs {
  static constexpr int links = 12;
  int regroupings = 0, joined_from = std::numeric_limits<int>::max();
  std::vector<double> asked;  ///< of max_step
  State<Fp64> state;

  explicit Chains(int count)
      : Chains(Unknowns<Fp64>(std::vector<double>(count * links, 1.0), 1), count) {}
  Chains(Unknowns<Fp64> const& unknowns, int count)
      : Springs(unknowns, Inertia<Fp64>(unknowns),
                StencilTerm<Spring, Fp64>(Spring(), elements(count), count * links)),
        state(count * links) {
    for (int i = 0; i < count * links; ++i) {
      state.x(i, 0) = i % links;
      state.v(i, 1) = 20 * std::sin(1.0 + i % links);
    }
  }
  static std::vector<std::array<int, 2>> elements(int count) {
    std::vector<std::array<int, 2>> all;
    for (int i = 0; i < count * links; ++i) {
      if (i % links > 0) all.push_back({i - 1, i});
    }
    return all;
  }
  std::int64_t pattern_version(Positions const&) { return ++regroupings; }
  void link(typename Bodies<DefaultSpace>::Indices const& label) {
    for (int b = 0; regroupings >= joined_from && b < bodies().count; ++b) label(b) = 0;
  }
  double max_step(Positions const& x, Vectors const& p, double at_most) {
    return max_step(x, p, at_most, 0);
  }
  double max_step(Positions const&, Vectors const&, double at_most, double) {
    asked.push_back(at_most);
    return at_most;
  }
};

/// The largest difference of positions, m.
double apart(Chains const& a, Chains const& b) {
  double largest = 0;
  for (int i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(a.state.x(i, c) - b.state.x(i, c)));
    }
  return largest;
}

}  // namespace

TEST_CASE("islands that are joined go on as each would, where they are alike", "[islands]") {
  using Method = Ncg<FletcherReeves, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;
  ImplicitEuler<Method> stepper({.stop = {.tolerance = 0}, .budget = {.max_iterations = 9}});
  Chains alone(2), joined(2);
  joined.joined_from = 5;
  auto const report = stepper.step(alone, alone.state, 0.05);
  CHECK(stepper.step(joined, joined.state, 0.05).islands == 2);
  CHECK(report.iterations == 9);
  CHECK(report.islands == 2);
  REQUIRE(report.restarts.curvature == 0);
  CHECK(apart(alone, joined) < 1e-12);
}

TEST_CASE("islands that stop by a rule of the gradient say how far off they are", "[islands]") {
  using Rough = Ncg<DaiKou, BlockJacobi, SufficientDecrease, GradientNorm, Fp64>;
  using Exact = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;
  Chains rough(2), exact(2);
  auto const report =
      ImplicitEuler<Rough>({.stop = {.tolerance = 0.02}}).step(rough, rough.state, 0.05);
  CHECK(report.stop == Stop::converged_by_gradient);
  CHECK(report.iterations > 2);
  CHECK(ImplicitEuler<Exact>({.stop = {.tolerance = 1e-10}})
            .step(exact, exact.state, 0.05)
            .converged());
  REQUIRE(apart(rough, exact) > 1e-7);
  CHECK(report.error_estimate_m > 0.1 * apart(rough, exact));
}

TEST_CASE("islands ask for the bound that the line search keeps", "[islands]") {
  using Method = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;
  double const fraction = 0.5;
  ImplicitEuler<Method> stepper({.line_search = {.bound = {.fraction = fraction}}});
  Chains chains(2);
  auto const report = stepper.step(chains, chains.state, 0.05);
  CHECK(report.converged());
  // The first is that of the start.
  REQUIRE(chains.asked.size() > 2);
  for (std::size_t k = 1; k < chains.asked.size(); ++k) CHECK(chains.asked[k] >= 1 / fraction);
  CHECK(static_cast<int>(chains.asked.size()) <= 1 + report.iterations);

  ImplicitEuler<Method> boundless(
      {.line_search = {.bound = {.fraction = std::numeric_limits<double>::infinity()}}});
  Chains free(2);
  CHECK(boundless.step(free, free.state, 0.05).converged());
  CHECK(free.asked.size() == 1);
}
