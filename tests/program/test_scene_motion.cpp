// Rigid motions against closed forms, and the script of cube_40 against its frame-by-frame
// increments.

#include <taut/apps/program/scene_geometry.hpp>

#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <cmath>
#include <numbers>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::WithinAbs;

namespace {

void check_point(Point const& actual, Point const& expected, double margin = 1e-12) {
  for (std::size_t a = 0; a < 3; ++a) CHECK_THAT(actual[a], WithinAbs(expected[a], margin));
}

constexpr double pi = std::numbers::pi;

}  // namespace

TEST_CASE("a rotation is right-handed and keeps its axis") {
  RigidMap const quarter = rotation_about({0, 0, 1}, pi / 2, {1, 0, 0});
  check_point(quarter({2, 0, 5}), {1, 1, 5});
  check_point(quarter({1, 0, -3}), {1, 0, -3});
  Point const axis = (1 / std::sqrt(3.0)) * Point{1, 1, 1};
  check_point(rotation_about(axis, 2 * pi / 3, {})({1, 2, 3}), {3, 1, 2});
}

TEST_CASE("phases compose in order of time") {
  RigidMotion motion;
  CHECK(motion.at(7)({1, 2, 3}) == Point{1, 2, 3});
  motion.phases.push_back({.window = {1, 3}, .velocity = {2, 0, 0}});
  motion.phases.push_back({.window = {4, 6},
                           .velocity = {0, 0, 0.5},
                           .axis = {0, 0, 1},
                           .centre = {4, 0, 0},
                           .angular_velocity = pi / 4,
                           .angular_acceleration = pi / 4});
  Point const rest{1, 0, 0};
  CHECK(motion.at(0.5)(rest) == rest);
  check_point(motion.at(2)(rest), {3, 0, 0});
  check_point(motion.at(3.5)(rest), {5, 0, 0});
  double const angle = pi / 4 + pi / 8;  // after one second of the second phase
  check_point(motion.at(5)(rest), {4 + std::cos(angle), std::sin(angle), 0.5});
  check_point(motion.at(6)(rest), {3, 0, 1});  // pi/2 + pi/2
  check_point(motion.at(60)(rest), {3, 0, 1});
}

TEST_CASE("the centre of rotation travels with the velocity") {
  RigidMotion const motion{{{.velocity = {3, 0, 0}, .axis = {0, 1, 0}, .angular_velocity = pi}}};
  check_point(motion.at(2)({0, 1, 0}), {6, 1, 0});
  check_point(motion.at(1)({1, 0, 0}), {3 - 1, 0, 0});
}

TEST_CASE("windows belong to steps by the middle of the step") {
  Window const window{0, 3.2};
  double const h = 0.04;
  int steps = 0;
  double t = 0;
  for (int n = 0; n < 200; ++n) {
    t += h;  // with the round-off of a simulation's clock
    steps += window.covers_step(t, h);
  }
  CHECK(steps == 80);
  CHECK_FALSE(Window{1, 2}.covers_step(1, 0.1));
  CHECK(Window{1, 2}.covers_step(1.1, 0.1));
}

TEST_CASE("stretch_twist follows the increments of the cube_40 script") {
  Scene const scene = load_scene(test::scene_folder() / "stretch_twist.toml");
  SceneGeometry const geometry = build_geometry(scene);
  Pin const& bottom = geometry.pins.at(0);
  Pin const& top = geometry.pins.at(1);
  Point x{0.75, 0.75, -0.25};
  double const h = scene.step;
  for (int frame = 0; frame < 1100; ++frame) {
    if (frame < 70) x[1] -= 0.05 * h;
    if (frame >= 70 && frame < 500) x[1] += 0.05 * h;
    if (frame >= 500) {
      double const angle = (frame - 500) * 1e-5 * pi;  // about y: z towards x
      double const dx = x[0] - 0.5, dz = x[2] + 0.5;
      x[0] = 0.5 + std::cos(angle) * dx + std::sin(angle) * dz;
      x[2] = -0.5 - std::sin(angle) * dx + std::cos(angle) * dz;
    }
    double const t = (frame + 1) * h;
    REQUIRE(top.window.covers_step(t, h));
    if (frame % 50 == 49) check_point(top.at({0.75, 0.75, -0.25}, t), x, 1e-9);
  }
  CHECK(bottom.at({0.25, 0.25, -0.25}, 40) == Point{0.25, 0.25, -0.25});
}
