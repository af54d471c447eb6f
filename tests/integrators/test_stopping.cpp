// When to stop, and whether the error that is predicted then is the error that is there.
#include "oracle.hpp"

#include <taut/integrators/ncg.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <cmath>
#include <limits>
#include <string>

using namespace taut;
using Catch::Matchers::WithinRel;

namespace {

Progress step(double decrement) {
  return {.decrement = decrement, .attainable = decrement, .curvature = 2, .gradient_norm = 1};
}

}  // namespace

TEST_CASE("the decrement window stops when the sum of its steps is small") {
  // 1/2 M (tol L)^2 = 1/2 4 (0.1 0.5)^2 = 5e-3
  DecrementWindow rule({.tolerance = 0.1, .window = 4});
  rule.start({.mass = 4, .length = 0.5, .time_step = 1, .has_inertia = true});
  CHECK(rule.error_estimate() == std::numeric_limits<double>::infinity());
  CHECK(rule.check(step(1e-9)) == Stop::none);  // one step is not a window
  CHECK_THAT(rule.error_estimate(), WithinRel(std::sqrt(2 * 4e-9 / 4), 1e-14));
  CHECK(rule.check(step(1)) == Stop::none);
  for (double const decrement : {5e-2, 4e-3, 1e-3, 1e-3}) {
    CHECK(rule.check(step(decrement)) == Stop::none);  // the 1, or 5.6e-2
  }
  CHECK_THAT(rule.error_estimate(), WithinRel(std::sqrt(2 * 5.6e-2 / 4), 1e-14));
  CHECK(rule.check(step(-1e-9)) == Stop::none);                   // 6e-3 + 1e-9
  CHECK(rule.check(step(1e-9)) == Stop::converged_by_decrement);  // 2e-3 + 2e-9
  rule.forget();
  CHECK(rule.check(step(0)) == Stop::none);

  // A step that was shortened cannot end it, however little is left.
  for (int k = 0; k < 9; ++k) {
    CHECK(rule.check({.decrement = 0, .attainable = 0, .shortened = true}) == Stop::none);
  }
  rule.forget();

  // A step that was cut counts with what it could have gained.
  for (int k = 0; k < 9; ++k) CHECK(rule.check({.decrement = 0, .attainable = 1}) == Stop::none);
  // When nothing more is possible, one figure stands for all that was to come.
  CHECK(rule.check({.decrement = 0, .attainable = 1e-9, .stuck = true}) ==
        Stop::converged_by_decrement);
}

TEST_CASE("what a thousand steps would not bring to the tolerance need not fall") {
  // 1/2 M (tol L)^2 / 1024 = 4.9e-6
  DecrementWindow rule({.tolerance = 0.1, .window = 4});
  Scale scale{.mass = 1, .length = 1};
  rule.start(scale);
  CHECK_THAT(rule.negligible(), WithinRel(5e-3 / 1024, 1e-14));
  for (int k = 0; k < 3; ++k) CHECK(rule.check(step(1e-6)) == Stop::none);
  CHECK(rule.check(step(1e-6)) == Stop::converged_by_decrement);
  rule.forget();
  for (int k = 0; k < 100; ++k) CHECK(rule.check(step(2e-6)) == Stop::none);
  // Not below what round-off allows.
  rule.start(scale);
  for (int k = 0; k < 3; ++k) rule.check(step(1e-6));
  CHECK(rule.check({.attainable = 1e-6, .floor = 1}) == Stop::stalled);
  // Without inertia the curvature that remains may be far smaller.
  scale.has_inertia = false;
  rule.start(scale);
  CHECK(rule.negligible() == 0);
  for (int k = 0; k < 100; ++k) CHECK(rule.check(step(1e-6)) == Stop::none);
}

TEST_CASE("what is left is a geometric series where a long window falls") {
  // The window grows on the plateau; after it each step gains a tenth less than the one before.
  DecrementWindow rule({.tolerance = 1e-9, .window = 8});
  rule.start({.mass = 1, .length = 1});
  for (int k = 0; k < 100; ++k) rule.check(step(1e-4));
  double decrement = 1e-4;
  for (int k = 0; k < 150; ++k) rule.check(step(decrement *= 0.9));
  REQUIRE(rule.window() >= 32);
  double const left = decrement * 0.9 / (1 - 0.9),
               over_eight = decrement * (std::pow(0.9, -8) - 1) / (1 / 0.9 - 1);
  double const estimate = rule.error_estimate();
  CHECK(estimate >= std::sqrt(2 * left));
  CHECK(estimate <= 1.01 * std::sqrt(2 * std::max(left, over_eight)));
}

TEST_CASE("the window grows where decrements do not fall, and shrinks where they fall fast") {
  DecrementWindow rule({.tolerance = 0.1, .window = 8});
  rule.start({.mass = 1, .length = 1});
  // So slow a fall would look converged, 8 e-4 < 5e-3, though 1e4 such steps are to come.
  for (int k = 0; k < 200; ++k) CHECK(rule.check(step(1e-4 * (1 - 1e-4 * k))) == Stop::none);
  CHECK(rule.window() == 256);
  double decrement = 1e-4;
  // The last steps tell, once they fall by far.
  for (int k = 0; k < 40; ++k) rule.check(step(decrement *= 0.7));
  CHECK(rule.window() == 8);

  // Without inertia it takes the length of the window to tell.
  rule.start({.mass = 1, .length = 1, .time_step = 1, .has_inertia = false});
  for (int k = 0; k < 200; ++k) rule.check(step(1e-4 * (1 - 1e-4 * k)));
  CHECK(rule.window() == 256);
  decrement = 1e-4;
  for (int k = 0; k < 40; ++k) rule.check(step(decrement *= 0.7));
  CHECK(rule.window() == 256);
  for (int k = 0; k < 360; ++k) rule.check(step(decrement *= 0.7));
  CHECK(rule.window() == 8);

  // A fall by half in 4 steps of 8 is enough, and nothing is slower for it.
  rule.start({.mass = 1, .length = 1});
  decrement = 1;
  int steps = 0;
  for (Stop stop = Stop::none; stop == Stop::none; ++steps)
    stop = rule.check(step(decrement *= 0.8));
  CHECK(rule.window() == 8);
  double sum = 0;
  for (int k = 0; k < 8; ++k) sum += std::pow(0.8, steps - k);
  CHECK(sum < 5e-3);
  CHECK(sum / 0.8 > 5e-3);
}

TEST_CASE("what round-off costs is never promised") {
  DecrementWindow rule({.tolerance = 1e-3, .window = 1});
  rule.start({.mass = 2, .length = 1});
  auto const with = [](double decrement, double floor) {
    return Progress{.decrement = decrement, .attainable = decrement, .floor = floor};
  };
  CHECK(rule.check(with(1e-10, 1e-4)) == Stop::converged_by_decrement);
  CHECK(rule.error_estimate() == 1e-4);
  CHECK(rule.check(with(1e-6, 2e-3)) == Stop::none);      // 1e-3, more than noise
  CHECK(rule.check(with(1e-10, 2e-3)) == Stop::stalled);  // 1e-5
  CHECK(rule.error_estimate() == 2e-3);
}

TEST_CASE("without inertia the curvature scales the estimate") {
  DecrementWindow rule({.tolerance = 0.1, .window = 1});
  rule.start({.mass = 4, .length = 0.5, .time_step = 1, .has_inertia = false});
  rule.check({.decrement = 1, .attainable = 1, .curvature = 50});
  CHECK_THAT(rule.error_estimate(), WithinRel(std::sqrt(2.0 / (50 * 4)), 1e-14));
  rule.check({.decrement = 1, .attainable = 1, .curvature = 8});
  CHECK_THAT(rule.error_estimate(), WithinRel(std::sqrt(2.0 / (8 * 4)), 1e-14));
}

TEST_CASE("the paper's rule compares with the first step") {
  EnergyDrop rule({.tolerance = 1e-2});
  rule.start({});
  CHECK(rule.check(step(5)) == Stop::none);
  CHECK(rule.check(step(6e-2)) == Stop::none);
  CHECK(rule.check(step(4e-2)) == Stop::converged_by_energy_drop);
  rule.start({});
  CHECK(rule.check(step(4e-2)) == Stop::none);

  EnergyDrop patient({.tolerance = 1e-2, .min_iterations = 2});
  patient.start({});
  patient.check(step(1));
  CHECK(patient.check(step(0)) == Stop::none);
  CHECK(patient.check(step(0)) == Stop::converged_by_energy_drop);
}

TEST_CASE("gradient norms are absolute or relative") {
  Progress progress = step(1);
  GradientNorm absolute({.tolerance = 1e-2});
  absolute.start({.mass = 1, .length = 3});
  progress.gradient_norm = 0.031;
  CHECK(absolute.check(progress) == Stop::none);
  progress.gradient_norm = 0.029;
  CHECK(absolute.check(progress) == Stop::converged_by_gradient);

  GradientNorm relative({.tolerance = 1e-2, .relative = true});
  relative.start({.mass = 1, .length = 3});
  progress.gradient_norm = 7;
  CHECK(relative.check(progress) == Stop::none);
  progress.gradient_norm = 0.071;
  CHECK(relative.check(progress) == Stop::none);
  progress.gradient_norm = 0.069;
  CHECK(relative.check(progress) == Stop::converged_by_gradient);
}

TEST_CASE("where two islands become one, rules stay relative to the larger first step") {
  EnergyDrop drop({.tolerance = 1e-2}), part = drop;
  drop.start({}), part.start({});
  drop.check(step(1));
  part.check(step(8));
  join_rule(drop, part);
  resume_rule(drop, {});
  CHECK(std::isinf(drop.error_estimate()));  // the window begins anew
  CHECK(drop.check(step(0.09)) == Stop::none);
  CHECK(drop.check(step(0.07)) == Stop::converged_by_energy_drop);

  using Either = AnyOf<GradientNorm, DecrementWindow>;
  Either::Params params;
  std::get<0>(params.rules) = {.tolerance = 1e-2, .relative = true};
  Either norm(params), other = norm;
  norm.start({}), other.start({});
  Progress progress = step(1);
  progress.gradient_norm = 2;
  norm.check(progress);
  progress.gradient_norm = 5;
  other.check(progress);
  join_rule(norm, other);
  resume_rule(norm, {});
  progress.gradient_norm = 0.06;
  CHECK(norm.check(progress) == Stop::none);
  progress.gradient_norm = 0.04;
  CHECK(norm.check(progress) == Stop::converged_by_gradient);
  // Nothing to be relative to: it begins anew.
  DecrementWindow window, more = window;
  window.start({}), more.start({});
  join_rule(window, more);
  resume_rule(window, {});
  CHECK(std::isinf(window.error_estimate()));
}

TEST_CASE("any of several rules stops, and each can be switched off") {
  using Rules = AnyOf<DecrementWindow, EnergyDrop>;
  Rules::Params params;
  params.rules = {{.tolerance = 0, .window = 1}, {.tolerance = 1e-2}};
  Rules rule(params);
  rule.start({.mass = 2});
  CHECK(rule.check(step(1)) == Stop::none);
  CHECK_THAT(rule.error_estimate(), WithinRel(1.0, 1e-14));
  CHECK(rule.check(step(1e-3)) == Stop::converged_by_energy_drop);
}

TEST_CASE("the predicted error is the error") {
  // Rigid motion, which a norm of P^-1 g would not see, is in all of these: the targets are far
  // away.
  std::string const beta = GENERATE("dk", "prp+", "hs", "hz");
  double const tolerance = GENERATE(1e-2, 1e-3, 1e-5);
  bool const has_inertia = GENERATE(true, false);
  CAPTURE(beta, tolerance, has_inertia);
  using Method = Ncg<AnyBeta, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;
  Method::Params params;
  params.beta = AnyBeta(beta);
  params.stop.tolerance = tolerance;
  params.budget.max_iterations = 5000;

  toy::Chain<toy::Barrier> chain({.size = 60, .has_inertia = has_inertia, .pinned = 1});
  auto const x = chain.start();
  auto const report = Method(params).minimise(chain, x);
  CHECK(report.stop == Stop::converged_by_decrement);
  CHECK(report.error_estimate_m < tolerance * chain.scale().length);
  // Never much worse than predicted; often far better, as CG ends abruptly on so few unknowns.
  CHECK(toy::distance_to_minimum(chain, x) < 3 * report.error_estimate_m);
}
