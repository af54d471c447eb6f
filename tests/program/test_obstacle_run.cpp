// Obstacles in the result of a run: where they are in every frame, what is written of them, and
// that the run goes on with them.
#include "scene_run.hpp"

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinAbs;

namespace {

/// A cube falls on a lift, which carries it up and turns it. Below, a floor moves, and a post
/// stands in a base, which is no matter between obstacles.
std::string const lift = R"(name = "lift"
gravity = [0, -10, 0]

[time]
step = 0.01
frames = 8

[[object]]
name = "cube"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
translate = [0, 0.53, 0]
material = { young = 1e6, poisson = 0.4, density = 1000 }

[[obstacle]]
name = "floor"
shape = { kind = "half_space", point = [0, -1, 0] }
motion = [{ velocity = [0, 0.5, 0] }]

[[obstacle]]
name = "lift"
shape = { kind = "box", size = [2, 0.4, 2], resolution = 1 }
translate = [0, -0.2, 0]
motion = [{ velocity = [0, 1, 0], axis = [0, 1, 0], centre = [0, 0, 0], angular_velocity = 90 }]

[[obstacle]]
name = "post"
shape = { kind = "box", size = [0.2, 0.3, 0.2], resolution = 1 }
translate = [0, -0.7, 0]

[[obstacle]]
name = "base"
shape = { kind = "box", size = [0.6, 0.1, 0.6], resolution = 1 }
translate = [0, -0.8, 0]

[contact]

[output]
obj = true
)";

struct LiftRun : SceneRun {
  explicit LiftRun(std::vector<std::string> overrides = {})
      : SceneRun("lift.toml", lift, std::move(overrides), CheckRun::every_iteration) {}
};

}  // namespace

TEST_CASE("obstacles are in the result where their motion has brought them", "[obstacle]") {
  LiftRun run;
  CHECK(run_command(run.options) == 0);
  CHECK(check_command(run.options.out) == 0);
  Scene const scene = run.scene();
  SceneGeometry const geometry = build_geometry(scene);
  ResultReader const result = run.result();
  REQUIRE(result.frames() == 9);
  CHECK(result.mesh().object_names ==
        std::vector<std::string>{"cube", "floor", "lift", "post", "base"});
  std::size_t const bodies = geometry.mesh.points.size();
  for (std::int64_t frame = 0; frame < result.frames(); ++frame) {
    double const time = result.times()[static_cast<std::size_t>(frame)];
    auto const x = result.positions(frame), v = result.velocities(frame);
    std::size_t vertex = bodies;
    for (ObstacleSurface const& surface : geometry.obstacle_meshes) {
      RigidMap const place = scene.obstacles[surface.obstacle].motion.at(time);
      RigidMap const before = scene.obstacles[surface.obstacle].motion.at(time - scene.step);
      for (Point const& start : surface.mesh.points) {
        Point const there = place(start);
        CAPTURE(frame, vertex);
        REQUIRE(vertex < x.size());
        CHECK_THAT(norm(x[vertex] - there), WithinAbs(0, 1e-12));
        if (frame > 0 && !surface.drawn_only) {
          Point const speed = (1 / scene.step) * (there - before(start));
          CHECK_THAT(norm(v[vertex] - speed), WithinAbs(0, 1e-9));
        }
        ++vertex;
      }
    }
    CHECK(vertex == x.size());
  }
  // The lift, which is now at 0.08 m, has not run through the cube.
  for (std::size_t v = 0; v < bodies; ++v) CHECK(result.positions(8)[v][1] > 0.08);

  // Surfaces beside the result are those of the bodies.
  TriangleMesh const surface = read_obj(run.options.out / "obj" / "frame_00008.obj");
  CHECK(surface.points.size() == bodies);
  CHECK(surface.triangles == boundary_faces(geometry.mesh.tets));
}

TEST_CASE("a run with obstacles goes on bitwise after a restart", "[obstacle]") {
  LiftRun whole, legs({"time.frames=3"});
  check_goes_on(whole, legs);
}

TEST_CASE("a body that starts beyond a half space is refused, naming both", "[obstacle]") {
  LiftRun run({"obstacle.floor.translate=[0, 1.5, 0]"});
  CHECK_THROWS_MATCHES(
      run_command(run.options), Error,
      MessageMatches(ContainsSubstring("of object cube") && ContainsSubstring("obstacle floor") &&
                     ContainsSubstring("obstacle.NAME.translate")));
}

namespace {

/// Two cubes on the ground, 0.1 mm apart, as one puts things down.
std::string const put_down = R"(name = "put_down"
gravity = [0, -9.81, 0]

[time]
step = 1e-3
frames = 40

[[object]]
name = "lower"
shape = { kind = "box", size = [0.2, 0.2, 0.2], resolution = 2 }
translate = [0, 0.1001, 0]
material = { young = 1e8, poisson = 0.4, density = 1000 }

[[object]]
name = "upper"
shape = { kind = "box", size = [0.2, 0.2, 0.2], resolution = 2 }
translate = [0.03, 0.3002, 0]
material = { young = 1e8, poisson = 0.4, density = 1000 }

[[obstacle]]
name = "floor"
shape = { kind = "half_space" }

[contact]
)";

double fastest(ResultReader const& result) {
  double fastest = 0;
  for (Point const& v : result.velocities(result.frames() - 1)) {
    fastest = std::max(fastest, std::hypot(v[0], v[1], v[2]));
  }
  return fastest;
}

}  // namespace

TEST_CASE("what is put down closer than dhat stays there", "[obstacle]") {
  SceneRun run("scene.toml", put_down, {}, CheckRun::every_step);
  CHECK(run_command(run.options) == 0);
  CHECK(run.summary().at("steps_converged") == 40);
  ResultReader const result = run.result();
  // Gaps of a tenth of a millimetre close, and nothing is thrown.
  CHECK(fastest(result) < 0.03);
  auto const first = result.positions(0), last = result.positions(result.frames() - 1);
  for (std::size_t v = 0; v < first.size(); ++v) {
    CHECK(std::abs(last[v][1] - first[v][1]) < 3e-4);
  }
  SceneRun thrown("scene.toml", put_down, {"contact.start_share=0"});
  CHECK(run_command(thrown.options) == 0);
  CHECK(fastest(thrown.result()) > 0.3);
}

TEST_CASE("what was put down goes on bitwise after a restart", "[obstacle]") {
  SceneRun whole("scene.toml", put_down), legs("scene.toml", put_down, {"time.frames=15"});
  check_goes_on(whole, legs);
}
