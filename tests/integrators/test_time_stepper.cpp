// Time steps that change their length, what a step returns, and what it leaves where it fails.
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/integrators/direct.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/time_stepper.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <vector>

using namespace taut;
using Catch::Matchers::WithinAbs;

namespace {

/// k/2 |x|^2 for each of its unknowns: every component swings as cos(sqrt(k/m) t). Beyond `breaks`
/// the energy is not a number.
struct Anchor {
  static constexpr int vertices = 1;
  double stiffness;
  double breaks = std::numeric_limits<double>::infinity();
  KOKKOS_FUNCTION double value(int, Vec3<double> const (&x)[1]) const {
    double const energy = 0.5 * stiffness * dot(x[0], x[0]);
    return norm(x[0]) > breaks ? std::numeric_limits<double>::quiet_NaN() : energy;
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int, Vec3<double> const (&x)[1], int) const {
    double const broken = std::numeric_limits<double>::quiet_NaN();
    return (norm(x[0]) > breaks ? broken : stiffness) * x[0];
  }
  KOKKOS_FUNCTION Mat3<double> curvature(int, Vec3<double> const (&)[1], int, int) const {
    return stiffness * identity3<double>();
  }
};

using Anchors = StencilTerm<Anchor, Fp64>;
using Scene = Potential<Inertia<Fp64>, BodyForce<Fp64>, Anchors>;
using Minimiser = Newton<Direct, Identity, SufficientDecrease, DecrementWindow, Fp64>;

/// One unknown of 2 kg.
Scene scene(Anchor const& anchor, double gravity) {
  std::vector<double> const mass{2};
  Unknowns<Fp64> const unknowns(mass, 1);
  return Scene(unknowns, Inertia<Fp64>(unknowns), BodyForce<Fp64>(unknowns, {0, gravity, 0}),
               Anchors(anchor, {{0}}, 1));
}

Minimiser::Params tight() {
  Minimiser::Params params;
  params.stop.tolerance = 1e-13;
  return params;
}

template <class Motion>
State<Fp64> start(Motion const& at, double last_step) {
  State<Fp64> state(1);
  for (int c = 0; c < 3; ++c) {
    state.x(0, c) = at(0.0, c)[0];
    state.v(0, c) = at(0.0, c)[1];
    state.x_last(0, c) = at(-last_step, c)[0];
    state.v_last(0, c) = at(-last_step, c)[1];
  }
  state.last_step = last_step;
  state.steps = 1;
  return state;
}

/// Error after a second of a swing of 3 rad/s, in so many pairs of a long step and a short one.
template <class Stepper>
double swing_error(int pairs) {
  auto const swing = [](double t, int c) {
    return std::array{std::cos(3 * t + c), -3 * std::sin(3 * t + c)};
  };
  auto potential = scene({18}, 0);
  double const mean = 1.0 / (2 * pairs);
  State<Fp64> state = start(swing, 0.6 * mean);
  Stepper stepper(tight());
  for (int k = 0; k < pairs; ++k) {
    stepper.step(potential, state, 1.4 * mean);
    stepper.step(potential, state, 0.6 * mean);
  }
  double worst = 0;
  for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(state.x(0, c) - swing(1, c)[0]));
  return worst;
}

}  // namespace

TEST_CASE("BDF2 with steps that change is exact for constant acceleration") {
  double const g = -9.81;
  auto const fall = [g](double t, int c) {
    return std::array{0.3 * c + 2 * t + (c == 1 ? 0.5 * g * t * t : 0), 2 + (c == 1 ? g * t : 0)};
  };
  auto potential = scene({0}, g);
  State<Fp64> state = start(fall, 0.02);
  Bdf2<Minimiser> stepper(tight());
  double t = 0;
  for (double const h : {0.01, 0.02, 0.045, 0.003, 0.003, 0.01}) {
    stepper.step(potential, state, h);
    t += h;
    CHECK(state.last_step == h);
    for (int c = 0; c < 3; ++c) {
      CHECK_THAT(state.x(0, c), WithinAbs(fall(t, c)[0], 1e-12));
      CHECK_THAT(state.v(0, c), WithinAbs(fall(t, c)[1], 1e-10));
    }
  }
  CHECK_THAT(state.time, WithinAbs(t, 1e-15));
}

TEST_CASE("BDF2 is of second order where steps alternate, implicit Euler of first") {
  double const bdf2 =
      std::log2(swing_error<Bdf2<Minimiser>>(40) / swing_error<Bdf2<Minimiser>>(80));
  CHECK(bdf2 > 1.9);
  CHECK(bdf2 < 2.2);
  using Euler = ImplicitEuler<Minimiser>;
  double const euler = std::log2(swing_error<Euler>(40) / swing_error<Euler>(80));
  CHECK(euler > 0.9);
  CHECK(euler < 1.2);
}

TEST_CASE("a step returns its minimiser's own report") {
  auto potential = scene({18}, -9.81);
  State<Fp64> state(1);
  ImplicitEuler<Minimiser> stepper;
  auto const report = stepper.step(potential, state, 0.1);
  STATIC_REQUIRE(std::same_as<std::decay_t<decltype(report)>, NewtonReport>);
  CHECK(report.linear_iterations > 0);
}

TEST_CASE("a step starts along the direction that its bound was of", "[stepper]") {
  // In mixed precision that is not all of the way to the predictor. Pins land exactly.
  using InMixed = Potential<Inertia<Mixed>, StencilTerm<Anchor, Mixed>>;
  struct Bounded : InMixed {
    using InMixed::InMixed;
    double bound = 1;
    std::array<double, 6> p{};
    double max_step(Positions const&, Vectors const& direction, double) {
      for (int k = 0; k < 6; ++k) p[k] = double(direction(k / 3, k % 3));
      return bound;
    }
  };
  double const bound = GENERATE(0.5, 1.0);
  CAPTURE(bound);
  std::vector<double> const mass{2, 2};
  Unknowns<Mixed> const unknowns(mass, 1);
  Bounded potential(unknowns, Inertia<Mixed>(unknowns),
                    StencilTerm<Anchor, Mixed>(Anchor{0}, {{0}, {1}}, 2));
  potential.bound = bound;
  State<Mixed> state(2);
  for (int k = 0; k < 6; ++k) {
    state.x(k / 3, k % 3) = 0.1 * k;
    state.v(k / 3, k % 3) = 1.0 / (3 + k);
    unknowns.prescribed(k / 3, k % 3) = 0.1 * k + 0.7 / (5 + k);
  }
  unknowns.fixed(1) = 1;
  using Idle = Newton<Direct, Identity, SufficientDecrease, DecrementWindow, Mixed>;
  ImplicitEuler<Idle> stepper(Idle::Params{.budget = {.max_iterations = 0}});
  stepper.step(potential, state, 0.1);
  for (int k = 0; k < 6; ++k) {
    bool const lands = k >= 3 && bound == 1;
    double const to = lands ? unknowns.prescribed(1, k % 3) : 0.1 * k + bound * potential.p[k];
    CHECK(state.x(k / 3, k % 3) == to);
  }
}

TEST_CASE("terms are told the mean mass of what is free", "[stepper]") {
  struct Told : Anchors {
    using Anchors::Anchors;
    double* mean;
    double* all;
    void begin_step(StepStart<Fp64, DefaultSpace> const& start) const {
      *mean = start.mean_mass;
      *all = start.free_mass;
    }
  };
  std::vector<double> const mass{2, 4, 30};
  Unknowns<Fp64> const unknowns(mass, 1);
  Told told(Anchor{1}, {{0}}, 3);
  double mean = 0, all = 0;
  told.mean = &mean;
  told.all = &all;
  Potential<Inertia<Fp64>, Told> potential(unknowns, Inertia<Fp64>(unknowns), told);
  unknowns.fixed(2) = 1;
  State<Fp64> const state(3);
  potential.begin_step(state.x, 1, 1, true);
  CHECK(mean == 3);
  CHECK(all == 6);
  for (int i = 0; i < 3; ++i) unknowns.fixed(i) = 1;
  potential.begin_step(state.x, 1, 1, true);
  CHECK(mean == 0);
}

TEST_CASE("a step that ends in what is not a number leaves the state as it was") {
  auto potential = scene({18, 0.5}, 0);
  State<Fp64> state(1);
  state.x(0, 0) = 0.45;
  state.v(0, 0) = 10;  // the predictor is beyond
  state.x_last(0, 1) = 0.2;
  state.last_step = 0.05;
  state.steps = 3;
  state.time = 0.3;
  Bdf2<Minimiser> stepper;
  auto const report = stepper.step(potential, state, 0.1);
  CHECK(report.stop == Stop::non_finite);
  CHECK(state.x(0, 0) == 0.45);
  CHECK(state.v(0, 0) == 10);
  CHECK(state.x_last(0, 1) == 0.2);
  CHECK(state.last_step == 0.05);
  CHECK(state.steps == 3);
  CHECK(state.time == 0.3);
  CHECK(stepper.reached()(0, 0) > 0.5);
}
