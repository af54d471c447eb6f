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
  /// About the z axis through (0, 0, 0) or (0, 2, 0), of either body.
  Vec3<double> turned(int i, double angle) const {
    Point const& x = rest.points[i];
    double const centre = i < half() ? 0 : 2, y = x[1] - centre;
    return {x[0] * std::cos(angle) - y * std::sin(angle),
            x[0] * std::sin(angle) + y * std::cos(angle) + centre, x[2]};
  }
  /// What vertices do that go straight on for h at w rad/s, and by `drift` along z.
  Vec3<double> straight(int i, double wh, double drift) const {
    Point const& x = rest.points[i];
    double const y = x[1] - (i < half() ? 0 : 2);
    return {x[0] - wh * y, x[1] + wh * x[0], x[2] + drift};
  }
};

double distance(Field const& a, int i, Vec3<double> const& b) {
  return norm(Vec3<double>{a(i, 0) - b[0], a(i, 1) - b[1], a(i, 2) - b[2]});
}

}  // namespace

TEST_CASE("a body that turns starts from the rigid motion closest to its predictor") {
  Boxes boxes;
  auto scene = boxes.scene(1e5);
  State<Fp64> const state = boxes.state();
  Field const y("y", boxes.unknowns.size());
  double const wh = 0.3, drift = 0.2;
  for (int i = 0; i < state.size(); ++i) {
    // The second one goes on without turning.
    Vec3<double> const to = boxes.straight(i, i < boxes.half() ? wh : 0, drift);
    for (int c = 0; c < 3; ++c) y(i, c) = to[c];
  }
  RigidPredictor<Fp64, DefaultSpace> predictor;
  predictor.start(scene, state, y);
  for (int i = 0; i < state.size(); ++i) {
    Vec3<double> to = boxes.turned(i, i < boxes.half() ? std::atan(wh) : 0);
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
    for (int i = 0; i < state.size(); ++i) {
      Vec3<double> const z = boxes.turned(i, std::atan(wh)), to = boxes.straight(i, wh, 0);
      for (int c = 0; c < 3; ++c) {
        state.x_last(i, c) = state.x(i, c);
        state.v_last(i, c) = (to[c] - state.x(i, c)) / h;
        state.x(i, c) = z[c] + kept * (to[c] - z[c]);
      }
    }
    Field const y("y", state.size()), from("from", state.size());
    for (int i = 0; i < state.size(); ++i) {
      double const centre = i < boxes.half() ? 0 : 2;
      y(i, 0) = state.x(i, 0) - wh * (state.x(i, 1) - centre);
      y(i, 1) = state.x(i, 1) + wh * state.x(i, 0);
      y(i, 2) = state.x(i, 2);
    }
    assign(from, y);
    RigidPredictor<Fp64, DefaultSpace> predictor;
    predictor.start(scene, state, y);
    for (int i = 0; i < state.size(); ++i) {
      double const centre = i < boxes.half() ? 0 : 2, angle = std::atan(wh);
      double const r[2] = {state.x(i, 0), state.x(i, 1) - centre};
      Vec3<double> const z{r[0] * std::cos(angle) - r[1] * std::sin(angle),
                           r[0] * std::sin(angle) + r[1] * std::cos(angle) + centre, state.x(i, 2)};
      Vec3<double> expected;
      for (int c = 0; c < 3; ++c) expected[c] = z[c] + kept * (from(i, c) - z[c]);
      CHECK_THAT(distance(y, i, expected), WithinAbs(0, 1e-13));
    }
  }
}

TEST_CASE("a body of which anything is fixed keeps its predictor, and all do where it is off") {
  Boxes boxes;
  boxes.unknowns.fixed(0) = 1;
  auto scene = boxes.scene(1e5);
  State<Fp64> const state = boxes.state();
  Field const y("y", state.size()), from("from", state.size());
  for (int i = 0; i < state.size(); ++i) {
    Vec3<double> const to = boxes.straight(i, 0.3, 0);
    for (int c = 0; c < 3; ++c) y(i, c) = from(i, c) = to[c];
  }
  auto const kept = [&](int i) {
    return y(i, 0) == from(i, 0) && y(i, 1) == from(i, 1) && y(i, 2) == from(i, 2);
  };
  RigidPredictor<Fp64, DefaultSpace> off({.on = false}), on;
  off.start(scene, state, y);
  for (int i = 0; i < state.size(); ++i) CHECK(kept(i));
  on.start(scene, state, y);
  for (int i = 0; i < boxes.half(); ++i) CHECK(kept(i));
  CHECK(!kept(boxes.half()));
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
      double const centre = i < boxes.half() ? 0 : 2;
      state.v(i, 0) = -w * (state.x(i, 1) - centre);
      state.v(i, 1) = w * state.x(i, 0);
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
