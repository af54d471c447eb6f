// Sleep: what rests leaves the steps, exactly where it is, and is awake before anything acts on it.
#include "contact_scenes.hpp"

#include <taut/contact/obstacle.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

using Elasticity = ElasticTets<Elastic<StableNeoHookean>, Fp64>;
using Touch =
    Contact<PairEnergy<>, Bvh<DefaultSpace>, AdditiveCcd, ElasticInclusiveStiffness, Fp64>;
using Ground = Obstacle<HalfSpace, Normalised<LogBarrier>, ElasticInclusiveStiffness, Fp64>;
using Terms = Potential<Inertia<Fp64>, BodyForce<Fp64>, Elasticity, Touch, Ground>;
using Stepper = ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>>;

/// Three cubes over the ground: 0 and 1 side by side and near, 2 far away.
struct Cubes {
  static constexpr double side = 0.4, dhat = 0.02;
  Boxes boxes{{{BoxShape{{side, side, side}}, 2},
               {BoxShape{{side, side, side}}, 2},
               {BoxShape{{side, side, side}}, 2}},
              [](int b, Point const& x) {
                double const at[] = {0, 0.6, 5};
                return Point{x[0] + at[b], x[1] + side / 2 + dhat, x[2]};
              }};
  Body<Fp64> body{boxes.mesh, 1000};
  std::vector<int> object;
  Terms potential{make()};
  State<Fp64> state{body.positions()};
  Stepper stepper;

  explicit Cubes(Sleep<Fp64, DefaultSpace>::Params const& sleep)
      : stepper({.stop = {.tolerance = 1e-8}}, {}, sleep) {}

  Terms make() {
    for (int v : body.order.vertices) object.push_back(boxes.object[v]);
    Surface const surface = make_surface(boundary_faces(body.rest.tets), object);
    return Terms(body.unknowns, Inertia<Fp64>(body.unknowns), BodyForce<Fp64>(body.unknowns),
                 Elasticity(body.rest, lame_parameters(1e5, 0.3)),
                 Touch(body.unknowns, surface, body.rest.points, {.dhat = dhat}),
                 Ground(body.unknowns, surface, body.rest.points, HalfSpace{}, {.dhat = dhat}));
  }
  void pull(Point const& g) {
    potential.term<BodyForce<Fp64>>().set_acceleration({g[0], g[1], g[2]});
  }
  void throw_body(int k, Point const& velocity) {
    for (std::size_t i = 0; i < object.size(); ++i) {
      for (int c = 0; object[i] == k && c < 3; ++c) state.v(i, c) = velocity[c];
    }
  }
  /// Things act from as far away as in another scene: part of a checkpoint.
  void act_as_in(Cubes& other) {
    potential.term<Touch>().set_activation(other.potential.term<Touch>().activation());
    potential.term<Ground>().set_activation(other.potential.term<Ground>().activation());
  }
  MinimiserReport step() { return stepper.step(potential, state, 0.01); }
  /// Of body k.
  std::vector<Point> positions(int k) const {
    std::vector<Point> picked;
    for (std::size_t i = 0; i < object.size(); ++i) {
      if (object[i] == k) picked.push_back({state.x(i, 0), state.x(i, 1), state.x(i, 2)});
    }
    return picked;
  }
  double fastest(int k) const {
    double r = 0;
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; object[i] == k && c < 3; ++c) r = std::max(r, std::abs(state.v(i, c)));
    return r;
  }
};

double apart(std::vector<Point> const& a, std::vector<Point> const& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a[i][c] - b[i][c]));
  return largest;
}

}  // namespace

TEST_CASE("what rests sleeps, and wakes before it is hit", "[sleep]") {
  Cubes scene({.on = true, .speed = 1e-3, .steps = 5}), awake({});
  // The first comes at the second, which rests, and the third rests far away.
  for (Cubes* s : {&scene, &awake}) s->throw_body(0, {1.2, 0, 0});
  int most_asleep = 0, woken = 0;
  double fastest = 0;
  auto const third = scene.positions(2);
  for (int step = 0; step < 30; ++step) {
    CAPTURE(step);
    auto const r = scene.step();
    auto const s = awake.step();
    REQUIRE(r.converged());
    REQUIRE(s.converged());
    CHECK(s.asleep == 0);
    most_asleep = std::max(most_asleep, r.asleep);
    woken += r.woken;
    fastest = std::max(fastest, scene.fastest(1));
    // Sleep has changed nothing: there was nothing to stop.
    for (int k : {0, 1, 2}) CHECK(apart(scene.positions(k), awake.positions(k)) < 1e-7);
    if (step >= 6) CHECK(r.asleep >= 1);
  }
  CHECK(most_asleep == 2);
  CHECK(woken >= 1);
  CHECK(fastest > 0.5);
  CHECK(scene.positions(2) == third);
}

TEST_CASE("a body on the ground sleeps until it is pulled otherwise, fixed or pushed", "[sleep]") {
  Cubes scene({.on = true, .speed = 2e-3, .steps = 8});
  scene.pull({0, -9.81, 0});
  int step = 0, asleep = 0;
  for (; step < 400 && asleep < 3; ++step) asleep = scene.step().asleep;
  CAPTURE(step);
  REQUIRE(asleep == 3);
  auto const at_rest = scene.positions(0);
  auto r = scene.step();
  CHECK(r.asleep == 3);
  CHECK(r.iterations == 0);
  CHECK(r.converged());
  CHECK(scene.positions(0) == at_rest);
  CHECK(scene.fastest(0) == 0);

  SECTION("gravity turns") {
    scene.pull({0, 9.81, 0});
    r = scene.step();
    CHECK(r.asleep == 0);
    CHECK(scene.fastest(0) > 0.02);
  }
  SECTION("a force pulls at one of them") {
    BodyForce<Fp64>::Forces const forces("forces", scene.object.size());
    for (std::size_t i = 0; i < scene.object.size(); ++i)
      forces(i, 1) = scene.object[i] == 2 ? 50 : 0;
    scene.potential.term<BodyForce<Fp64>>().set_forces(forces);
    r = scene.step();
    CHECK(r.asleep == 2);
    CHECK(scene.fastest(2) > 0.02);
    CHECK(scene.fastest(0) == 0);
  }
  SECTION("one is fixed, which wakes it; then moved, which wakes all") {
    auto const& unknowns = scene.body.unknowns;
    for (std::size_t i = 0; i < scene.object.size(); ++i)
      for (int c = 0; c < 3; ++c) unknowns.prescribed(i, c) = scene.state.x(i, c);
    for (std::size_t i = 0; i < scene.object.size(); ++i) unknowns.fixed(i) = scene.object[i] == 2;
    CHECK(scene.step().asleep == 2);
    for (std::size_t i = 0; i < scene.object.size(); ++i) unknowns.prescribed(i, 1) += 0.01;
    CHECK(scene.step().asleep == 0);
  }
  SECTION("one is thrown") {
    scene.throw_body(2, {0, 0.5, 0});
    r = scene.step();
    CHECK(r.asleep == 2);
    CHECK(scene.fastest(2) > 0.3);
  }
}

TEST_CASE("a pin that is released right after a body fell asleep wakes it", "[sleep]") {
  int const steps = 5;
  Cubes scene({.on = true, .speed = 1e-3, .steps = steps});
  scene.pull({0, -9.81, 0});
  auto const& unknowns = scene.body.unknowns;
  for (std::size_t i = 0; i < scene.object.size(); ++i) {
    for (int c = 0; c < 3; ++c) unknowns.prescribed(i, c) = scene.state.x(i, c);
    unknowns.fixed(i) = scene.object[i] == 2;
  }
  // It falls asleep at the end of the last of these: no step has seen it asleep.
  for (int step = 0; step < steps; ++step) CHECK(scene.step().asleep == 0);
  SECTION("released") {
    for (std::size_t i = 0; i < scene.object.size(); ++i) unknowns.fixed(i) = 0;
    scene.step();
    CHECK(scene.fastest(2) > 0.02);
  }
  SECTION("held on") {
    scene.step();
    scene.step();
    CHECK(scene.stepper.sleep().record().noted[2] == 1);
    CHECK(scene.fastest(2) == 0);
  }
}

TEST_CASE("a load that begins right after a body fell asleep wakes it", "[sleep]") {
  int const steps = 5;
  Cubes scene({.on = true, .speed = 1e-3, .steps = steps});
  for (int step = 0; step < steps; ++step) CHECK(scene.step().asleep == 0);
  scene.pull({0, 9.81, 0});
  CHECK(scene.step().asleep == 0);
  CHECK(scene.fastest(2) > 0.02);
}

TEST_CASE("a restarted run sleeps on bitwise", "[sleep]") {
  Sleep<Fp64, DefaultSpace>::Params const params{.on = true, .speed = 2e-3, .steps = 8};
  // The state three steps before all are asleep, to go on from.
  Cubes whole(params), again(params);
  whole.pull({0, -9.81, 0});
  again.pull({0, -9.81, 0});
  struct Saved {
    State<Fp64> state;
    Sleep<Fp64, DefaultSpace>::Record sleep;
  };
  auto const copy = [](State<Fp64> const& from, State<Fp64>& to) {
    assign(to.x, from.x);
    assign(to.v, from.v);
    assign(to.x_last, from.x_last);
    assign(to.v_last, from.v_last);
    to.time = from.time;
    to.last_step = from.last_step;
    to.steps = from.steps;
  };
  std::vector<Saved> saved;
  int asleep = 0;
  for (int step = 0; step < 400 && asleep < 3; ++step) {
    asleep = whole.step().asleep;
    saved.push_back({State<Fp64>(whole.state.size()), whole.stepper.sleep().record()});
    copy(whole.state, saved.back().state);
  }
  REQUIRE(asleep == 3);
  Saved const& from = saved[saved.size() - 4];
  copy(from.state, again.state);
  again.stepper.sleep().restore(from.sleep);
  again.act_as_in(whole);
  for (int step = 0; step < 3; ++step) asleep = again.step().asleep;
  CHECK(asleep == 3);
  for (int k : {0, 1, 2}) CHECK(whole.positions(k) == again.positions(k));
  // And stands still from then on, in both.
  whole.step(), again.step();
  for (int k : {0, 1, 2}) CHECK(whole.positions(k) == again.positions(k));

  // A restart in a step that pulls otherwise: what sleeps knows how it was pulled at before.
  Cubes third(params);
  copy(whole.state, third.state);
  third.stepper.sleep().restore(whole.stepper.sleep().record());
  third.act_as_in(whole);
  for (Cubes* s : {&whole, &third}) {
    s->pull({0, 9.81, 0});
    CHECK(s->step().asleep == 0);
    CHECK(s->fastest(0) > 0.02);
  }
  for (int k : {0, 1, 2}) CHECK(whole.positions(k) == third.positions(k));
}

TEST_CASE("sleep without a speed is refused", "[sleep]") {
  using Sleeper = Sleep<Fp64, DefaultSpace>;
  CHECK_THROWS_WITH(Sleeper({.on = true}), ContainsSubstring("positive speed"));
  CHECK_THROWS_WITH(Sleeper({.on = true, .speed = 1, .steps = 0}), ContainsSubstring("1 step"));
}
