// Friction in motion: what a block does on a slope and along a table, and what friction does to
// energy and momentum (docs/benchmarks: F20).
#include "sliding_block.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double h = 0.01, g = SlidingBlock::g;

void run(SlidingBlock& scene, SlidingBlock::Stepper& stepper, int steps) {
  for (int step = 0; step < steps; ++step) {
    auto const report = stepper.step(scene.potential, scene.state, h);
    CAPTURE(step, to_string(report.stop), report.iterations);
    REQUIRE(report.converged());
  }
}

}  // namespace

TEST_CASE("a block on a slope slips where tan(theta) > mu, and creeps as the law says otherwise",
          "[friction]") {
  double const mu = GENERATE(0.3, 0.49, 0.51, 0.6, 1.0), angle = std::atan(0.5), speed = 0.01;
  CAPTURE(mu);
  SlidingBlock scene({.mu = mu, .stick_speed = speed});
  SlidingBlock::Stepper stepper({.stop = {.tolerance = 1e-5}});
  run(scene, stepper, 30);  // comes to rest on the level
  CHECK(std::abs(scene.mean(scene.state.v)[0]) < 1e-4);
  scene.tilt(angle);
  run(scene, stepper, 30);
  double const before = scene.mean(scene.state.v)[0];
  int const steps = 10;
  run(scene, stepper, steps);
  double const after = scene.mean(scene.state.v)[0];
  CHECK_THAT(scene.mean(scene.state.v)[2], WithinAbs(0, 0.1 * speed));
  if (mu < 0.5) {
    double const acceleration = g * (std::sin(angle) - mu * std::cos(angle));
    CHECK_THAT((after - before) / (steps * h), WithinAbs(acceleration, 1e-3 * g));
  } else {
    double const creep = speed * (1 - std::sqrt(1 - 0.5 / mu));
    CHECK(before < speed);
    CHECK_THAT(after, WithinRel(creep, 0.02));
  }
}

TEST_CASE("a block thrown along a table stops after v^2 / (2 mu g), and loses energy on the way",
          "[friction]") {
  double const mu = 0.5, speed = 1;
  SlidingBlock scene({.mu = mu});
  SlidingBlock::Stepper stepper({.stop = {.tolerance = 1e-5}});
  run(scene, stepper, 30);
  double const from = scene.mean(scene.state.x)[0];
  scene.throw_with({speed, 0, 0});
  double const kinetic = 0.5 * SlidingBlock::weight * speed * speed;
  double energy = scene.energy(), heat = 0;
  double const start = energy;
  for (int step = 0; step < 35; ++step) {
    run(scene, stepper, 1);
    double const now = scene.energy();
    CAPTURE(step);
    CHECK(now - energy < 2e-4 * kinetic);
    energy = now;
    heat += scene.friction.report(scene.state.x).work;
    CHECK(scene.friction.report(scene.state.x).work >= 0);
  }
  CHECK(std::abs(scene.mean(scene.state.v)[0]) < 0.01);
  // Implicit Euler moves with the velocity at the end of each step: v h / 2 less.
  double const distance = speed * speed / (2 * mu * g) - speed * h / 2;
  CHECK_THAT(scene.mean(scene.state.x)[0] - from, WithinRel(distance, 0.03));
  // What is lost is heat of friction, but for what the scheme damps.
  CHECK(heat < start - energy);
  CHECK(heat > 0.8 * kinetic);
}

TEST_CASE("an impact slows the slide by mu times its normal impulse, one step later",
          "[friction]") {
  int const passes = GENERATE(1, 2);
  CAPTURE(passes);
  double const mu = 0.3, along = 3, down = 1;
  SlidingBlock scene({.mu = mu, .gap = 0.05});
  SlidingBlock::Stepper stepper({.stop = {.tolerance = 1e-5}}, {.passes = passes});
  scene.throw_with({along, -down, 0});
  // Momentum over mass: of the block as it would be with all of the impulse, less what it is.
  auto const missing = [&](int steps) {
    auto const v = scene.mean(scene.state.v);
    return v[0] - (along - mu * (v[1] + down + g * h * steps));
  };
  double most = 0;
  int step = 0;
  for (; step < 12; ++step) {
    run(scene, stepper, 1);
    most = std::max(most, std::abs(missing(step + 1)));
  }
  double const impulse = scene.mean(scene.state.v)[1] + down + g * h * step;
  REQUIRE(impulse > 1.2 * down);
  CHECK(std::abs(missing(step)) < 0.1 * mu * impulse);
  if (passes == 1) {
    CHECK(most > 0.3 * mu * impulse);
  } else {
    CHECK(most < 0.1 * mu * impulse);
  }
}

TEST_CASE("without friction, and without contact, nothing holds a block", "[friction]") {
  double const angle = std::atan(0.5);
  SlidingBlock scene({.mu = 0});
  SlidingBlock::Stepper stepper({.stop = {.tolerance = 1e-5}});
  run(scene, stepper, 30);
  scene.tilt(angle);
  run(scene, stepper, 20);
  CHECK_THAT(scene.mean(scene.state.v)[0], WithinRel(g * std::sin(angle) * 20 * h, 1e-3));
  CHECK(scene.friction.report(scene.state.x).contacts == 0);
}

TEST_CASE("a step of no pass is refused", "[friction]") {
  CHECK_THROWS_WITH(SlidingBlock::Stepper({}, {.passes = 0}), ContainsSubstring("1 pass or more"));
}
