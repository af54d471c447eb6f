// Contact in motion: bodies fall, push and come to rest, without a crossing in any step, and where
// they come to rest is a matter of the load alone.
#include "contact_scenes.hpp"

#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::WithinRel;

namespace {

constexpr double gravity = 9.81, density = 1000;
using Elasticity = ElasticTets<Elastic<StableNeoHookean>>;

/// A box that falls on a wider one, which is fixed.
struct FallingBox {
  static constexpr double height = 0.4, depth = 0.2;  ///< of the box, and of what it falls on; m
  Boxes boxes;
  Body<> body;
  std::vector<int> object;
  Surface surface;

  FallingBox(int resolution, double gap, double tilt, double turn = 0.3)
      : boxes({{BoxShape{{0.8, depth, 0.8}}, 4}, {BoxShape{{0.4, height, 0.4}}, resolution}},
              [&](int b, Point const& x) {
                if (b == 0) return Point{x[0], x[1] - depth / 2, x[2]};
                Point const t = turned(x, turn);
                double const c = std::cos(tilt), s = std::sin(tilt), half = height / 2;
                double const lift = half * c + 0.5 * 0.4 * std::sqrt(2.0) * std::abs(s);
                return Point{c * t[0] - s * t[1], s * t[0] + c * t[1] + lift + gap, t[2]};
              }),
        body(boxes.mesh, density) {
    for (int v : body.order.vertices) object.push_back(boxes.object[v]);
    surface = make_surface(boundary_faces(body.rest.tets), object);
    auto const fixed = Kokkos::create_mirror_view(body.unknowns.fixed);
    for (std::size_t v = 0; v < object.size(); ++v) fixed(v) = object[v] == 0;
    assign(body.unknowns.fixed, fixed);
  }
  /// Mean height of the lower face of the box, m.
  double bottom(State<> const& state) const {
    auto const x = to_points(state.x);
    double sum = 0;
    int count = 0;
    for (std::size_t v = 0; v < x.size(); ++v) {
      Point const& rest = boxes.mesh.points[body.order.vertices[v]];
      if (object[v] == 1 && rest[1] < bottom_at_rest() + 1e-9) sum += x[v][1], ++count;
    }
    return sum / count;
  }
  /// How fast any vertex moves up or down, m/s. Without friction the box may go on gliding.
  double fastest(State<> const& state) const {
    double r = 0;
    for (Point const& v : to_points(state.v)) r = std::max(r, std::abs(v[1]));
    return r;
  }
  /// Sets the velocity of the box, m/s.
  void throw_down(State<> const& state, double speed) const {
    auto const v = Kokkos::create_mirror_view(state.v);
    for (std::size_t i = 0; i < object.size(); ++i) v(i, 1) = object[i] == 1 ? -speed : 0;
    assign(state.v, v);
  }
  /// Where the lower box is to be at the end of the next step: `by` m above its rest position.
  void raise(double by) const {
    auto const to = Kokkos::create_mirror_view(body.unknowns.prescribed);
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        to(i, c) = body.rest.points[i][c] + (c == 1 && object[i] == 0 ? by : 0);
      }
    assign(body.unknowns.prescribed, to);
  }

private:
  double bottom_at_rest() const {
    double y = 1e300;
    for (std::size_t v = 0; v < boxes.mesh.points.size(); ++v) {
      if (boxes.object[v] == 1) y = std::min(y, boxes.mesh.points[v][1]);
    }
    return y;
  }
};

/// How far the pins are from where they are to be, m.
double furthest_of_pins(FallingBox const& scene, State<> const& state) {
  auto const x = to_points(state.x), to = to_points(scene.body.unknowns.prescribed);
  double r = 0;
  for (std::size_t v = 0; v < x.size(); ++v)
    for (int c = 0; c < 3; ++c) {
      if (scene.object[v] == 0) r = std::max(r, std::abs(x[v][c] - to[v][c]));
    }
  return r;
}

using GivenContact = Contact<PairEnergy<>, Bvh<>, AdditiveCcd, GivenStiffness>;
using Falling = ImplicitEuler<Ncg<DaiKou, BlockJacobi>>;

}  // namespace

TEST_CASE("a block falls on another, and rests on it without a crossing", "[contact]") {
  bool const inclusive = GENERATE(false, true);
  CAPTURE(inclusive);
  FallingBox const scene(3, 0.02, 0.02);
  Elasticity const elastic(scene.body.rest, lame_parameters(3e5, 0.4));
  Falling stepper;
  State<> state(scene.body.positions());
  double const h = 0.01;
  int contacts = 0;
  auto const fall = [&](auto contact) {
    Potential potential(scene.body.unknowns, Inertia(scene.body.unknowns),
                        BodyForce(scene.body.unknowns, {0, -gravity, 0}), elastic, contact);
    for (int step = 0; step < 40; ++step) {
      auto const report = stepper.step(potential, state, h);
      CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
      REQUIRE(report.converged());
      REQUIRE(intersections(scene.surface, to_points(state.x)) == 0);
      REQUIRE(contact.report(state.x).smallest_gap > 0);
      contacts = std::max(contacts, contact.report(state.x).contacts);
    }
    CHECK(contact.report(state.x).smallest_gap > 0.05);
    CHECK(contact.report(state.x).contacts > 0);
    CHECK(scene.bottom(state) < contact.dhat());
  };
  if (inclusive) {
    fall(Contact<>(scene.body.unknowns, scene.surface, scene.body.rest.points, {}));
  } else {
    fall(GivenContact(scene.body.unknowns, scene.surface, scene.body.rest.points,
                      {.stiffness = {.pressure = 1e5}}));
  }
  CHECK(contacts > 10);
  CHECK(scene.fastest(state) < 0.05);
  CHECK(scene.bottom(state) > 0);
}

TEST_CASE("a block that is thrown down at many times dhat per step does not go through",
          "[contact]") {
  double const speed = GENERATE(10.0, 40.0);
  CAPTURE(speed);
  FallingBox const scene(3, 0.3, 0.4);
  Elasticity const elastic(scene.body.rest, lame_parameters(1e6, 0.4));
  GivenContact const contact(scene.body.unknowns, scene.surface, scene.body.rest.points,
                             {.stiffness = {.pressure = 1e6}});
  Potential potential(scene.body.unknowns, Inertia(scene.body.unknowns),
                      BodyForce(scene.body.unknowns, {0, -gravity, 0}), elastic, contact);
  Falling stepper({.budget = {.max_iterations = 2000}});
  State<> state(scene.body.positions());
  scene.throw_down(state, speed);
  int cuts = 0;
  double smallest = 1;
  for (int step = 0; step < 8; ++step) {
    auto const report = stepper.step(potential, state, 0.01);
    CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
    CHECK(report.converged());
    REQUIRE(intersections(scene.surface, to_points(state.x)) == 0);
    cuts += report.cuts;
    smallest = std::min(smallest, contact.report(state.x).smallest_gap);
  }
  CHECK(cuts > 0);
  CHECK(smallest > 1e-3);
  CHECK(scene.bottom(state) > 0);
}

TEST_CASE("what is pinned pushes and does not cross", "[contact]") {
  FallingBox const scene(2, 0.02, 0);
  Elasticity const elastic(scene.body.rest, lame_parameters(1e5, 0.4));
  GivenContact const contact(scene.body.unknowns, scene.surface, scene.body.rest.points,
                             {.stiffness = {.pressure = 1e5}});
  Potential potential(scene.body.unknowns, Inertia(scene.body.unknowns),
                      BodyForce(scene.body.unknowns, {0, -gravity, 0}), elastic, contact);
  Falling stepper({.budget = {.max_iterations = 2000}});
  State<> state(scene.body.positions());
  double const lift = 0.1;  // per step: several times dhat
  for (int step = 1; step <= 4; ++step) {
    scene.raise(step * lift);
    auto const report = stepper.step(potential, state, 0.02);
    CAPTURE(step, to_string(report.stop), report.iterations, report.cuts);
    CHECK(report.converged());
    REQUIRE(intersections(scene.surface, to_points(state.x)) == 0);
    CHECK(furthest_of_pins(scene, state) == 0);
    CHECK(scene.bottom(state) > step * lift);
  }
}

TEST_CASE("what is pinned by different marks does not cross either", "[contact]") {
  bool const one_mark = GENERATE(false, true);
  CAPTURE(one_mark);
  FallingBox const scene(2, 0.02, 0);
  auto const mark = Kokkos::create_mirror_view(scene.body.unknowns.fixed);
  for (std::size_t v = 0; v < scene.object.size(); ++v) {
    mark(v) = one_mark ? 1 : static_cast<std::uint8_t>(1 + scene.object[v]);
  }
  assign(scene.body.unknowns.fixed, mark);
  Contact<> const contact(scene.body.unknowns, scene.surface, scene.body.rest.points, {});
  Potential potential(scene.body.unknowns, Inertia(scene.body.unknowns), contact);
  Falling stepper({.budget = {.max_iterations = 1000}});
  State<> state(scene.body.positions());
  scene.raise(0.1);
  if (one_mark) {
    CHECK(stepper.step(potential, state, 0.01).converged());
    CHECK(furthest_of_pins(scene, state) == 0);
    return;
  }
  try {
    stepper.step(potential, state, 0.01);
    FAIL("not held up");
  } catch (HeldUp const& held) {
    CHECK(held.by().unknowns.size() == 4);
    int bodies = 0;
    for (int v : held.by().unknowns) bodies |= 1 << scene.object[v];
    CHECK(bodies == 3);
  }
  CHECK(to_points(state.x) == scene.body.rest.points);
}

TEST_CASE("one contact rests where K b' balances the load, whatever the time step", "[contact]") {
  // A weight at the corner of a triangle, whose other two corners are held, over a large one.
  std::vector<Point> const rest{{-3, 0, -2},   {0, 0, 4},       {3, 0, -2},
                                {0, 0.009, 0}, {0.3, 0.5, 0.4}, {-0.3, 0.5, 0.4}};
  Surface const surface = make_surface({{0, 1, 2}, {3, 4, 5}}, {0, 0, 0, 1, 1, 1});
  double const mass = 2, dhat = 0.01, wanted = 1e4;  // K, N/m
  double const pressure = wanted * 4 * dhat / vertex_areas(surface, rest)[3];
  Unknowns<Fp64> unknowns(std::vector<double>(6, mass), dhat);
  auto const fixed = Kokkos::create_mirror_view(unknowns.fixed);
  for (int v = 0; v < 6; ++v) fixed(v) = v != 3;
  assign(unknowns.fixed, fixed);
  assign(unknowns.prescribed, soups::to_field<double, DefaultSpace>(rest));

  // K |b'(d)| = m g, by bisection: |b'| falls with d.
  double low = 0, high = dhat;
  for (int k = 0; k < 100; ++k) {
    double const d = 0.5 * (low + high);
    double const push = -wanted * evaluate_barrier<Normalised<LogBarrier>>(d, dhat).slope;
    (push > mass * gravity ? low : high) = d;
  }
  REQUIRE(low > 0.1 * dhat);
  REQUIRE(low < 0.8 * dhat);

  double const h = GENERATE(0.01, 0.0025);
  CAPTURE(h);
  using Term = Contact<PairEnergy<>, Bvh<>, AdditiveCcd, GivenStiffness, Fp64>;
  Term const contact(unknowns, surface, rest,
                     {.dhat = dhat, .start_share = 0, .stiffness = {.pressure = pressure}});
  Potential potential(unknowns, Inertia(unknowns), BodyForce(unknowns, {0, -gravity, 0}), contact);
  ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>> stepper(
      {.stop = {.tolerance = 1e-9}});
  State<Fp64> state(soups::to_field<double, DefaultSpace>(rest));
  for (int step = 0; step < std::lround(3 / h); ++step) {
    REQUIRE(stepper.step(potential, state, h).stop != Stop::non_finite);
  }
  CHECK(contact.report(state.x).contacts == 1);
  CHECK_THAT(to_points(state.x)[3][1], WithinRel(low, 1e-5));
}

TEST_CASE("a body rests at one gap, whatever the time step, and nearly so on a finer mesh",
          "[contact]") {
  double const dhat = 0.03;
  auto const resting_gap = [&](int resolution, double h) {
    FallingBox const scene(resolution, 0.6 * dhat, 0);
    // Stiff, so that it lands as a whole.
    Elasticity const elastic(scene.body.rest, lame_parameters(1e6, 0.3));
    GivenContact const contact(scene.body.unknowns, scene.surface, scene.body.rest.points,
                               {.dhat = dhat, .stiffness = {.pressure = 1e5}});
    Potential potential(scene.body.unknowns, Inertia(scene.body.unknowns),
                        BodyForce(scene.body.unknowns, {0, -gravity, 0}), elastic, contact);
    Falling stepper({.stop = {.tolerance = 1e-4}});
    State<> state(scene.body.positions());
    for (int step = 0; step < std::lround(0.6 / h); ++step) stepper.step(potential, state, h);
    CHECK(scene.fastest(state) < 0.03);
    return scene.bottom(state);
  };
  double const gap = resting_gap(2, 0.04);
  CHECK(gap > 0.2 * dhat);
  CHECK(gap < 0.9 * dhat);
  CHECK_THAT(resting_gap(2, 0.01), WithinRel(gap, 0.01));
  CHECK_THAT(resting_gap(4, 0.04), WithinRel(gap, 0.15));
}
