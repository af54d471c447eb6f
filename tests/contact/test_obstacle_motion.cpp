// Obstacles in motion and what falls onto them: every vertex stays inside, bodies rest where the
// load alone puts them, bounce as bars do, and push with the force that they are pushed with.
#include "obstacle_scenes.hpp"

#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/materials/fixed_corotated.hpp>
#include <taut/materials/stable_neo_hookean.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double gravity = 9.81, density = 1000, pi = 3.14159265358979323846;
using Default = Normalised<LogBarrier>;
using Elasticity = ElasticTets<Elastic<StableNeoHookean>>;
template <class Shape, class Rule = GivenStiffness>
using ObstacleOf = Obstacle<Shape, Default, Rule>;
using Stepper = ImplicitEuler<Ncg<DaiKou, BlockJacobi>>;

/// One block, placed by `place`.
struct Block {
  Body<> body;
  Surface surface;

  template <class Place>
  Block(BoxShape const& shape, int resolution, Place const& place)
      : body(Boxes({{shape, resolution}}, [&](int, Point const& x) { return place(x); }).mesh,
             density),
        surface(make_surface(boundary_faces(body.rest.tets),
                             std::vector<int>(body.rest.points.size(), 0))) {}

  double mass() const {
    double sum = 0;
    auto const m = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body.unknowns.mass);
    for (std::size_t v = 0; v < m.extent(0); ++v) sum += m(v);
    return sum;
  }
  /// Of a field, weighted by mass: the centre of mass, or its velocity.
  template <class Field>
  Vec3<double> mean(Field const& field) const {
    auto const m = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body.unknowns.mass);
    Vec3<double> sum{0, 0, 0};
    auto const points = to_points(field);
    for (std::size_t v = 0; v < points.size(); ++v) {
      sum = sum + double(m(v)) * Vec3<double>{points[v][0], points[v][1], points[v][2]};
    }
    return (1 / mass()) * sum;
  }
  /// Lets it go with this velocity of its middle (of its rest shape), spinning by `spin`, rad/s.
  void let_go(State<> const& state, Vec3<double> const& velocity, Vec3<double> const& spin) const {
    Vec3<double> const middle = mean(state.x);
    auto const v = Kokkos::create_mirror_view(state.v);
    auto const x = to_points(state.x);
    for (std::size_t i = 0; i < x.size(); ++i) {
      Vec3<double> const at{x[i][0] - middle[0], x[i][1] - middle[1], x[i][2] - middle[2]};
      Vec3<double> const go = velocity + cross(spin, at);
      for (int c = 0; c < 3; ++c) v(i, c) = go[c];
    }
    assign(state.v, v);
  }
};

Block block_above(int resolution, double gap, double tilt, Point const& size = {0.4, 0.4, 0.4}) {
  return Block({size}, resolution, [&](Point const& x) {
    double const c = std::cos(tilt), s = std::sin(tilt);
    double const lift = 0.5 * size[1] * c + 0.5 * size[0] * std::abs(s) + gap;
    return Point{c * x[0] - s * x[1], s * x[0] + c * x[1] + lift, x[2]};
  });
}

template <class Obstacle>
auto potential_of(Block const& block, double modulus, double poisson, Obstacle const& obstacle) {
  return Potential(block.body.unknowns, Inertia(block.body.unknowns),
                   BodyForce(block.body.unknowns, {0, -gravity, 0}),
                   Elasticity(block.body.rest, lame_parameters(modulus, poisson)), obstacle);
}

/// The share of dhat that is left where P |g'| balances a pressure, by bisection.
double resting_share(double pressure_over_stiffness) {
  double low = 0, high = 1;
  for (int k = 0; k < 100; ++k) {
    double const x = 0.5 * (low + high);
    (-evaluate_barrier<Default>(x, 1.0).slope > pressure_over_stiffness ? low : high) = x;
  }
  return low;
}

}  // namespace

TEST_CASE("a block falls on a plane, and rests on it", "[obstacle]") {
  Block const block = block_above(3, 0.02, 0.02);
  HalfSpace const plane{};
  auto const fall = [&](auto const& obstacle) {
    auto potential = potential_of(block, 3e5, 0.4, obstacle);
    Stepper stepper;
    State<> state(block.body.positions());
    double fastest = 0;
    for (int step = 0; step < 40; ++step) {
      auto const report = stepper.step(potential, state, 0.01);
      CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
      REQUIRE(report.converged());
      REQUIRE(least_distance(plane, {}, block.surface, to_points(state.x)) > 0);
    }
    for (Point const& v : to_points(state.v)) fastest = std::max(fastest, std::abs(v[1]));
    CHECK(fastest < 0.05);
    CHECK(obstacle.report(state.x).smallest_gap > 0.05);
    CHECK(obstacle.report(state.x).contacts > 10);
    // It carries the weight.
    double const weight = block.mass() * gravity;
    Vec3<double> const force = obstacle.report(state.x).force;
    CHECK_THAT(force[1], WithinRel(weight, 0.1));
    CHECK(std::abs(force[0]) < 1e-9 * weight);
  };
  fall(ObstacleOf<HalfSpace, ElasticInclusiveStiffness>(block.body.unknowns, block.surface,
                                                        block.body.rest.points, plane, {}));
  fall(ObstacleOf<HalfSpace>(block.body.unknowns, block.surface, block.body.rest.points, plane,
                             {.stiffness = {.pressure = 1e5}}));
}

TEST_CASE("a block that is thrown at a plane at many dhat per step stays above it", "[obstacle]") {
  double const speed = GENERATE(10.0, 40.0);
  Block const block = block_above(3, 0.3, 0.4);
  HalfSpace const plane{};
  ObstacleOf<HalfSpace, ElasticInclusiveStiffness> const obstacle(
      block.body.unknowns, block.surface, block.body.rest.points, plane, {});
  auto potential = potential_of(block, 1e6, 0.4, obstacle);
  Stepper stepper({.budget = {.max_iterations = 2000}});
  State<> state(block.body.positions());
  block.let_go(state, {0, -speed, 0}, {0, 0, 0});
  int cuts = 0;
  double smallest = 1;
  for (int step = 0; step < 8; ++step) {
    auto const report = stepper.step(potential, state, 0.01);
    CAPTURE(speed, step, to_string(report.stop), report.iterations, report.cuts);
    CHECK(report.converged());
    REQUIRE(least_distance(plane, {}, block.surface, to_points(state.x)) > 0);
    cuts += report.cuts;
    smallest = std::min(smallest, obstacle.report(state.x).smallest_gap);
  }
  CHECK(cuts > 0);
  CHECK(smallest > 1e-4);
  CHECK(block.mean(state.v)[1] > 0);
}

TEST_CASE("the momentum of a body changes by the force of the plane and its weight", "[obstacle]") {
  Block const block = block_above(2, 0.002, 0);
  ObstacleOf<HalfSpace> const obstacle(block.body.unknowns, block.surface, block.body.rest.points,
                                       {{0, 0, 0}, {0.1, 1, 0}}, {.stiffness = {.pressure = 1e5}},
                                       [&] {
                                         RigidPose pose;  // below the lowest corner
                                         pose.translation = {0, -0.03, 0};
                                         return pose;
                                       }());
  auto potential = potential_of(block, 1e5, 0.4, obstacle);
  Stepper stepper({.stop = {.tolerance = 1e-6}});
  State<> state(block.body.positions());
  double const h = 0.005, m = block.mass();
  double largest = 0, error = 0;
  for (int step = 0; step < 40; ++step) {
    Vec3<double> const before = block.mean(state.v);
    REQUIRE(stepper.step(potential, state, h).converged());
    Vec3<double> const force = obstacle.report(state.x).force;
    Vec3<double> const change = (m / h) * (block.mean(state.v) - before);
    error = std::max(error, norm(change - force - Vec3<double>{0, -gravity * m, 0}));
    largest = std::max(largest, norm(force));
  }
  CAPTURE(error, largest);
  CHECK(largest > 2 * gravity * m);
  CHECK(error < 1e-3 * largest);
}

TEST_CASE("a block tumbles within a ball, a box and a cylinder and never leaves", "[obstacle]") {
  auto const tumble = [](auto const& shape) {
    Block const block({{0.3, 0.4, 0.5}}, 3, [](Point const& x) { return x; });
    RigidPose const pose = sample_pose();
    ObstacleOf<std::decay_t<decltype(shape)>, ElasticInclusiveStiffness> const obstacle(
        block.body.unknowns, block.surface, block.body.rest.points, shape, {}, pose);
    auto potential = potential_of(block, 2e5, 0.4, obstacle);
    Stepper stepper({.budget = {.max_iterations = 2000}});
    State<> state(block.body.positions());
    block.let_go(state, {6, 3, -5}, {8, -9, 10});
    int contacts = 0, unconverged = 0;
    for (int step = 0; step < 80; ++step) {
      auto const report = stepper.step(potential, state, 0.01);
      unconverged += !report.converged();
      CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
      REQUIRE(least_distance(shape, pose, block.surface, to_points(state.x)) > 0);
      contacts += obstacle.report(state.x).contacts > 0;
    }
    CHECK(contacts > 20);
    CHECK(unconverged == 0);
  };
  Vec3<double> const middle = transpose_times(sample_pose().rotation, -sample_pose().translation);
  SECTION("ball") { tumble(InsideBall{middle, 0.6}); }
  SECTION("box") { tumble(InsideBox{middle, {1.0, 0.9, 1.1}}); }
  SECTION("cylinder") { tumble(InsideCylinder{middle, {1, 2, 3}, 0.5, 1.2}); }
}

TEST_CASE("a plane that moves by many dhat per step pushes what is above it", "[obstacle]") {
  Block const block = block_above(3, 0.01, 0);
  HalfSpace const plane{};
  ObstacleOf<HalfSpace, ElasticInclusiveStiffness> const obstacle(
      block.body.unknowns, block.surface, block.body.rest.points, plane, {});
  auto potential = potential_of(block, 1e5, 0.4, obstacle);
  Stepper stepper({.budget = {.max_iterations = 4000}});
  State<> state(block.body.positions());
  RigidPose pose;
  int portions = 0;
  for (int step = 1; step <= 5; ++step) {
    pose.translation[1] += 0.2;  // some five times dhat
    pose.rotation = turn_matrix({{0, 0, 1}, 0.05}) * pose.rotation;
    obstacle.move_to(pose);
    CHECK(obstacle.motion_left(state.x) > 0.1);
    auto const report = stepper.step(potential, state, 0.02);
    CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
    CHECK(report.converged());
    CHECK(obstacle.motion_left(state.x) == 0);
    for (int k = 0; k < 9; ++k) CHECK(obstacle.pose().rotation.a[k] == pose.rotation.a[k]);
    REQUIRE(least_distance(plane, pose, block.surface, to_points(state.x)) > 0);
    portions += report.restarts.prescribed;
  }
  CHECK(portions > 5);
  CHECK(block.mean(state.x)[1] > 1);
}

TEST_CASE("a drum turns with a block in it", "[obstacle]") {
  // A box, the faces of which come round, and a cylinder, the side of which does not move.
  auto const turn = [](auto const& shape, double rate) {
    Block const block({{0.3, 0.3, 0.3}}, 2, [](Point const& x) { return x; });
    ObstacleOf<std::decay_t<decltype(shape)>, ElasticInclusiveStiffness> const obstacle(
        block.body.unknowns, block.surface, block.body.rest.points, shape, {});
    auto potential = potential_of(block, 1e5, 0.4, obstacle);
    Stepper stepper({.budget = {.max_iterations = 4000}});
    State<> state(block.body.positions());
    double const h = 0.02;
    int unconverged = 0;
    for (int step = 1; step <= 60; ++step) {
      RigidPose pose;
      pose.rotation = turn_matrix({{0, 0, 1}, step * h * rate});
      obstacle.move_to(pose);
      auto const report = stepper.step(potential, state, h);
      unconverged += !report.converged();
      CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
      REQUIRE(obstacle.motion_left(state.x) == 0);
      REQUIRE(least_distance(shape, pose, block.surface, to_points(state.x)) > 0);
    }
    CHECK(unconverged == 0);
  };
  SECTION("box") { turn(InsideBox{{0, 0, 0}, {0.8, 0.8, 0.8}}, 3); }
  SECTION("cylinder") { turn(InsideCylinder{{0, 0, 0}, {0, 0, 1}, 0.45, 0.8}, 6); }
}

TEST_CASE("pins do not go through an obstacle, and say what holds them up", "[obstacle]") {
  Block const block = block_above(2, 0.05, 0);
  Block held = block;
  held.body.fix([](Point const&) { return true; });
  ObstacleOf<HalfSpace> const obstacle(held.body.unknowns, held.surface, held.body.rest.points, {},
                                       {.stiffness = {.pressure = 1e5}});
  auto potential = potential_of(held, 1e5, 0.4, obstacle);
  Stepper stepper;
  State<> state(held.body.positions());
  auto const to = Kokkos::create_mirror_view(held.body.unknowns.prescribed);
  for (std::size_t v = 0; v < held.body.rest.points.size(); ++v)
    for (int c = 0; c < 3; ++c) to(v, c) = held.body.rest.points[v][c] - (c == 1 ? 0.04 : 0);
  assign(held.body.unknowns.prescribed, to);
  stepper.step(potential, state, 0.01);
  CHECK_THAT(least_distance(HalfSpace{}, {}, held.surface, to_points(state.x)),
             WithinRel(0.01, 1e-9));
  for (std::size_t v = 0; v < held.body.rest.points.size(); ++v) to(v, 1) -= 0.02;
  assign(held.body.unknowns.prescribed, to);
  CHECK_THROWS_AS(stepper.step(potential, state, 0.01), HeldUp);
  CHECK(least_distance(HalfSpace{}, {}, held.surface, to_points(state.x)) > 0);
}

TEST_CASE("a weight on a plane rests where P g' balances it, whatever the time step",
          "[obstacle]") {
  std::vector<Point> const rest{{0, 0.009, 0}, {0.3, 0.5, 0.4}, {-0.3, 0.5, 0.4}};
  Surface const surface = make_surface({{0, 1, 2}}, {0, 0, 0});
  double const mass = 2, dhat = 0.01, pressure = 5e3;
  Unknowns<Fp64> unknowns(std::vector<double>(3, mass), dhat);
  auto const fixed = Kokkos::create_mirror_view(unknowns.fixed);
  for (int v = 0; v < 3; ++v) fixed(v) = v != 0;
  assign(unknowns.fixed, fixed);
  auto const x0 = soups::to_field<double, DefaultSpace>(rest);
  assign(unknowns.prescribed, x0);
  double const area = shown_areas(surface, rest)[0];
  double const share = resting_share(mass * gravity / area / pressure);
  REQUIRE(share > 0.1);
  REQUIRE(share < 0.8);

  double const h = GENERATE(0.01, 0.0025);
  CAPTURE(h);
  using Term = Obstacle<HalfSpace, Default, GivenStiffness, Fp64>;
  Term const obstacle(unknowns, surface, rest, {},
                      {.dhat = dhat, .start_share = 0, .stiffness = {.pressure = pressure}});
  Potential potential(unknowns, Inertia(unknowns), BodyForce(unknowns, {0, -gravity, 0}), obstacle);
  ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>> stepper(
      {.stop = {.tolerance = 1e-9}});
  State<Fp64> state(x0);
  for (int step = 0; step < std::lround(2 / h); ++step) {
    REQUIRE(stepper.step(potential, state, h).stop != Stop::non_finite);
  }
  CHECK(obstacle.report(state.x).contacts == 1);
  CHECK_THAT(to_points(state.x)[0][1] / dhat, WithinRel(share, 1e-5));
}

TEST_CASE("a block on a plane rests at one gap, whatever the time step and the mesh",
          "[obstacle]") {
  double const dhat = 0.03, pressure = 2e4, height = 0.4;
  auto const resting_gap = [&](int resolution, double h) {
    Block const block = block_above(resolution, 0.7 * dhat, 0, {0.4, height, 0.4});
    ObstacleOf<HalfSpace> const obstacle(
        block.body.unknowns, block.surface, block.body.rest.points, {},
        {.dhat = dhat, .start_share = 0, .stiffness = {.pressure = pressure}});
    // Stiff, so that it stands as a whole.
    auto potential = potential_of(block, 1e7, 0.3, obstacle);
    Stepper stepper({.stop = {.tolerance = 1e-5}});
    State<> state(block.body.positions());
    for (int step = 0; step < std::lround(0.6 / h); ++step) stepper.step(potential, state, h);
    double sum = 0;
    int count = 0;
    auto const x = to_points(state.x);
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (block.body.rest.points[v][1] < 0.7 * dhat + 1e-9) sum += x[v][1], ++count;
    }
    return sum / count;
  };
  double const expected = dhat * resting_share(density * gravity * height / pressure);
  REQUIRE(expected > 0.2 * dhat);
  REQUIRE(expected < 0.7 * dhat);
  double const coarse = resting_gap(2, 0.02), fine = resting_gap(4, 0.02),
               often = resting_gap(2, 0.01);
  CAPTURE(expected, coarse, fine, often);
  CHECK_THAT(coarse, WithinRel(expected, 0.01));
  CHECK_THAT(fine, WithinRel(expected, 0.01));
  CHECK_THAT(often, WithinRel(expected, 0.01));
}

TEST_CASE("an elastic bar bounces off a plane after a wave has gone up and down it", "[obstacle]") {
  // A bar that does not bulge (Poisson's ratio 0) hits a wall: it is in contact for 2 L / c and
  // leaves as fast as it came.
  double const length = 1, speed = 0.2, modulus = 1e6, dhat = 1e-3, h = 4e-4;
  double const c = std::sqrt(modulus / density);
  Block const bar = block_above(24, 1e-3, 0, {1.0 / 24, length, 1.0 / 24});
  ObstacleOf<HalfSpace> const obstacle(bar.body.unknowns, bar.surface, bar.body.rest.points, {},
                                       {.dhat = dhat, .stiffness = {.pressure = modulus}});
  auto const bounce = [&](auto stepper) {
    Potential potential(
        bar.body.unknowns, Inertia(bar.body.unknowns), BodyForce(bar.body.unknowns, {0, 0, 0}),
        ElasticTets<Elastic<FixedCorotated>>(bar.body.rest, {modulus / 2, 0}), obstacle);
    State<> state(bar.body.positions());
    bar.let_go(state, {0, -speed, 0}, {0, 0, 0});
    double first = 0, last = 0, impulse = 0;
    while (state.time < 0.075) {
      REQUIRE(stepper.step(potential, state, h).stop != Stop::non_finite);
      double const force = obstacle.report(state.x).force[1];
      impulse += force * h;
      if (force > 0) last = state.time;
      if (force > 0 && first == 0) first = state.time;
    }
    struct Bounce {
      double time, speed, impulse;
    };
    return Bounce{last - first, bar.mean(state.v)[1], impulse};
  };
  double const expected = 2 * length / c;
  auto const second = bounce(Bdf2<Ncg<DaiKou, BlockJacobi>>({.stop = {.tolerance = 1e-5}}));
  auto const first = bounce(ImplicitEuler<Ncg<DaiKou, BlockJacobi>>({.stop = {.tolerance = 1e-5}}));
  CAPTURE(expected, second.time, second.speed, second.impulse, first.time, first.speed,
          first.impulse);
  CHECK_THAT(second.time, WithinRel(expected, 0.05));
  CHECK_THAT(second.speed, WithinRel(speed, 0.05));
  // What an implicit Euler step of h / (L / c) = 1 / 79 dissipates is a tenth of the speed.
  CHECK_THAT(first.time, WithinRel(expected, 0.1));
  CHECK(first.speed < second.speed);
  CHECK(first.speed > 0.8 * speed);
  CHECK_THAT(second.impulse, WithinRel(bar.mass() * (speed + second.speed), 0.02));
}
