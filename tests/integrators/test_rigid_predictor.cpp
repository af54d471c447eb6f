// Where a step of bodies that turn starts: the rigid motion in closed form, the share that the last
// step kept, who is left alone; and that steps end where they did, sooner.
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <cmath>
#include <vector>

using namespace taut;
using Catch::Matchers::WithinAbs;

namespace {

using Tets = ElasticTets<Elastic<FixedCorotated>, Fp64>;
using Scene = Potential<Inertia<Fp64>, Tets>;
using Minimiser = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;
using Field = VectorField<double, DefaultSpace>;

/// Two boxes side by side, a body each.
TetMesh two_boxes() {
  TetMesh mesh = make_shape(BoxShape{{1, 0.4, 0.3}}, 4);
  int const n = static_cast<int>(mesh.points.size());
  TetMesh const one = mesh;
  for (Point const& x : one.points) mesh.points.push_back({x[0], x[1] + 2, x[2]});
  for (auto const& tet : one.tets)
    mesh.tets.push_back({tet[0] + n, tet[1] + n, tet[2] + n, tet[3] + n});
  return mesh;
}

struct Boxes : Body<Fp64> {
  explicit Boxes() : Body<Fp64>(two_boxes(), 1000) {}
  int half() const { return unknowns.size() / 2; }
  Scene scene(double young) const {
    return Scene(unknowns, Inertia<Fp64>(unknowns), Tets(rest, lame_parameters(young, 0.3)));
  }
  State<Fp64> state() const {
    State<Fp64> state(unknowns.size());
    for (int i = 0; i < unknowns.size(); ++i)
      for (int c = 0; c < 3; ++c) state.x(i, c) = rest.points[i][c];
    return state;
  }
  Vec3<double> at_rest(int i) const {
    Point const& x = rest.points[i];
    return {x[0], x[1], x[2]};
  }
  double centre(int i) const { return i < half() ? 0 : 2; }
  /// From x, of the body of unknown i, about the z axis through its centre.
  Vec3<double> turned(int i, Vec3<double> const& x, double angle) const {
    double const y = x[1] - centre(i), c = std::cos(angle), s = std::sin(angle);
    return {x[0] * c - y * s, x[0] * s + y * c + centre(i), x[2]};
  }
  /// The same straight on, by wh where the body turns by atan(wh), and by `drift` along z.
  Vec3<double> straight(int i, Vec3<double> const& x, double wh, double drift = 0) const {
    return {x[0] - wh * (x[1] - centre(i)), x[1] + wh * x[0], x[2] + drift};
  }
};

Vec3<double> get(Field const& a, int i) { return {a(i, 0), a(i, 1), a(i, 2)}; }
void set(Field const& a, int i, Vec3<double> const& to) {
  for (int c = 0; c < 3; ++c) a(i, c) = to[c];
}
double distance(Field const& a, int i, Vec3<double> const& b) { return norm(get(a, i) - b); }

}  // namespace

TEST_CASE("a body that turns starts from the rigid motion closest to its predictor") {
  Boxes boxes;
  auto scene = boxes.scene(1e5);
  State<Fp64> const state = boxes.state();
  Field const y("y", boxes.unknowns.size());
  double const wh = 0.3, drift = 0.2;
  for (int i = 0; i < state.size(); ++i) {
    // The second one goes on without turning.
    set(y, i, boxes.straight(i, boxes.at_rest(i), i < boxes.half() ? wh : 0, drift));
  }
  RigidPredictor<Fp64, DefaultSpace> predictor;
  predictor.start(scene, state, y);
  for (int i = 0; i < state.size(); ++i) {
    Vec3<double> to = boxes.turned(i, boxes.at_rest(i), i < boxes.half() ? std::atan(wh) : 0);
    to[2] += drift;
    CHECK_THAT(distance(y, i, to), WithinAbs(0, 1e-14));
  }
}

TEST_CASE("what a body kept of its own motion in the last step, it starts with") {
  Boxes boxes;
  auto scene = boxes.scene(1e5);
  double const wh = 0.3, h = 0.01;
  for (double const kept : {0.0, 0.3, 1.0}) {
    // Both turned in the last step, from rest position to `kept` of the way from the rigid motion
    // to the predictor, and would do the same again.
    State<Fp64> state = boxes.state();
    state.last_step = h;
    Field const y("y", state.size()), from("from", state.size());
    for (int i = 0; i < state.size(); ++i) {
      Vec3<double> const x = boxes.at_rest(i), to = boxes.straight(i, x, wh),
                         z = boxes.turned(i, x, std::atan(wh));
      set(state.x_last, i, x);
      set(state.v_last, i, (1 / h) * (to - x));
      set(state.x, i, z + kept * (to - z));
      set(y, i, boxes.straight(i, get(state.x, i), wh));
    }
    assign(from, y);
    RigidPredictor<Fp64, DefaultSpace> predictor;
    predictor.start(scene, state, y);
    for (int i = 0; i < state.size(); ++i) {
      Vec3<double> const z = boxes.turned(i, get(state.x, i), std::atan(wh));
      CHECK_THAT(distance(y, i, z + kept * (get(from, i) - z)), WithinAbs(0, 1e-13));
    }
  }
}

TEST_CASE("a body of which anything is fixed keeps its predictor, and all do where it is off") {
  Boxes boxes;
  boxes.unknowns.fixed(0) = 1;
  auto scene = boxes.scene(1e5);
  State<Fp64> const state = boxes.state();
  Field const y("y", state.size()), from("from", state.size());
  for (int i = 0; i < state.size(); ++i) set(from, i, boxes.straight(i, boxes.at_rest(i), 0.3));
  assign(y, from);
  auto const kept = [&](int i) { return distance(y, i, get(from, i)) == 0; };
  RigidPredictor<Fp64, DefaultSpace> off({.on = false}), on;
  off.start(scene, state, y);
  for (int i = 0; i < state.size(); ++i) CHECK(kept(i));
  on.start(scene, state, y);
  for (int i = 0; i < boxes.half(); ++i) CHECK(kept(i));
  CHECK(!kept(boxes.half()));
}

TEST_CASE("unknowns that nothing connects are no body") {
  Boxes boxes;
  Potential<Inertia<Fp64>> points(boxes.unknowns, Inertia<Fp64>(boxes.unknowns));
  State<Fp64> const state = boxes.state();
  Field const y("y", state.size());
  auto const to = [&](int i) { return boxes.straight(i, boxes.at_rest(i), 0.3); };
  for (int i = 0; i < state.size(); ++i) set(y, i, to(i));
  RigidPredictor<Fp64, DefaultSpace> predictor;
  predictor.start(points, state, y);
  for (int i = 0; i < state.size(); ++i) CHECK(distance(y, i, to(i)) == 0);
}

TEST_CASE("steps of stiff bodies that turn end where they did, in fewer iterations") {
  Boxes boxes;
  int iterations[2] = {};
  State<Fp64> states[2];
  double const h = 0.02, w = 8;
  for (int on = 0; on < 2; ++on) {
    auto scene = boxes.scene(1e8);
    State<Fp64> state = boxes.state();
    for (int i = 0; i < state.size(); ++i) {
      Vec3<double> const x = boxes.at_rest(i);
      set(state.v, i, boxes.straight(i, x, w) - x);
    }
    Minimiser::Params params;
    params.stop.tolerance = 1e-6;
    ImplicitEuler<Minimiser> stepper(params, {}, {}, {.on = on == 1});
    for (int k = 0; k < 4; ++k) {
      auto const report = stepper.step(scene, state, h);
      CHECK(report.converged());
      iterations[on] += report.iterations;
    }
    states[on] = state;
  }
  CHECK(iterations[1] < iterations[0]);
  for (int i = 0; i < states[0].size(); ++i)
    for (int c = 0; c < 3; ++c) CHECK_THAT(states[1].x(i, c), WithinAbs(states[0].x(i, c), 4e-6));
}
