// Sources of material points and boundaries of files, in scenes: what comes out weighs what it
// should and flows on, runs go on bitwise, and mistakes are answered by a sentence.
#include "scene_run.hpp"

#include <taut/apps/program/particle_simulation.hpp>
#include <taut/apps/program/run_identity.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <support/data.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A jet out of a box, without gravity: nothing pushes it.
std::string const jet = R"(name = "jet"

[time]
step = 0.05
frames = 4

[grid]
spacing = 0.1

[[source]]
name = "jet"
shape = { kind = "box", size = [0.3, 0.2, 0.4] }
translate = [0.03, 1, 0.02]
rotate = { axis = [0, 0, 1], angle = 90 }
velocity = [2, 0, 0]
end = 0.12
material = { young = 1e4, poisson = 0.3, density = 700 }
)";

void refused(std::string const& text, std::string const& sentence) {
  SceneRun const run("scene.toml", text);
  CHECK_THROWS_MATCHES(run_command(run.options), Error,
                       MessageMatches(ContainsSubstring(sentence)));
}

double farthest(std::vector<Point> const& a, std::vector<Point> const& b) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t p = 0; p < a.size(); ++p) most = std::max(most, norm(a[p] - b[p]));
  return most;
}

}  // namespace

TEST_CASE("a jet has its mass and flows on as it left its source", "[particles][source]") {
  SceneRun const run("jet.toml", jet);
  REQUIRE(run_command(run.options) == 0);
  // 0.12 s of 2 m/s through what is, turned, 0.3 m high and 0.4 m wide.
  CHECK_THAT(double(run.summary().at("mass_kg")), WithinRel(700 * 0.3 * 0.4 * 2 * 0.12, 1e-12));
  CHECK(run.summary().at("steps_converged") == 4);
  CHECK(check_command(run.options.out) == 0);
  ResultReader const result = run.result();
  Scene const scene = run.scene();
  SceneParticles const all = build_particles(scene);
  CHECK(all.initial() == 0);
  REQUIRE(result.frames() == 5);
  CHECK(result.mesh().growing);
  for (std::int64_t frame = 0; frame < 5; ++frame) {
    double const time = result.times()[static_cast<std::size_t>(frame)];
    REQUIRE(result.particles(frame) == all.count_at(time));
    auto const x = result.positions(frame), v = result.velocities(frame);
    for (std::size_t p = 0; p < result.particles(frame); ++p) {
      Particle const& start = all.list[p];
      double const since = time - all.born[p];
      CHECK(norm(v[p] - Point{2, 0, 0}) < 1e-6);
      CHECK(norm(x[p] - Point{start.x[0] + 2 * since, start.x[1], start.x[2]}) < 1e-7);
    }
  }
  CHECK(result.particles(1) < result.particles(2));
  CHECK(result.particles(3) == result.mesh().particles);
}

TEST_CASE("a run with a source goes on bitwise, and may be prolonged", "[particles][source]") {
  std::string const text =
      replaced(replaced(jet, "end = 0.12", "end = 0.17"), "[time]",
               "gravity = [0, -10, 0]\n\n[[boundary]]\nname = \"wall\"\nshape = { kind = "
               "\"half_space\", point = [0.4, 0, 0], normal = [-1, 0, 0] }\n\n[time]") +
      // What is there from the start is of another model.
      "[[object]]\nname = \"cube\"\nshape = { kind = \"box\", size = [0.3, 0.3, 0.3] }\n"
      "material = { model = \"neo_hookean\", young = 1e5, poisson = 0.3, density = 1000 }\n";
  SceneRun whole("jet.toml", text), first("jet.toml", text, {"time.frames=2"});
  REQUIRE(run_command(whole.options) == 0);
  REQUIRE(run_command(first.options) == 0);
  first.options.scene.changes.overrides = {"time.frames=4"};
  first.options.restart = true;
  REQUIRE(run_command(first.options) == 0);
  ResultReader const a = whole.result(), b = first.result();
  REQUIRE(a.frames() == b.frames());
  for (std::int64_t frame = 0; frame < a.frames(); ++frame) {
    CHECK(a.particles(frame) == b.particles(frame));
    CHECK(a.positions(frame) == b.positions(frame));
    CHECK(a.velocities(frame) == b.velocities(frame));
    for (std::string const& name : particle_scalars())
      CHECK(a.scalar(name, frame) == b.scalar(name, frame));
  }
  CHECK(whole.summary().at("mass_kg") == first.summary().at("mass_kg"));
}

TEST_CASE("a source that moves lets out what moves along", "[particles][source]") {
  SceneRun const run("jet.toml",
                     jet + "motion = [{ end = 1, velocity = [0, 1, 0.5] }]\nstart = 0.02\n");
  Scene const scene = run.scene();
  SceneParticles const all = build_particles(scene);
  for (std::size_t p = 0; p < all.list.size(); ++p) {
    double const t = all.born[p];
    CHECK(t >= 0.02);
    CHECK(norm(all.list[p].v - Vec3<double>{2, 1, 0.5}) < 1e-12);
    // On the side that the flow leaves through, where that is then.
    CHECK_THAT(all.list[p].x[0], WithinAbs(0.03 + 0.1, 1e-12));
    CHECK(std::abs(all.list[p].x[1] - (1 + t)) <= 0.15 + 1e-12);
    CHECK(std::abs(all.list[p].x[2] - (0.02 + 0.5 * t)) <= 0.2 + 1e-12);
  }
  double mass = 0;
  for (Particle const& p : all.list) mass += p.mass;
  CHECK_THAT(mass, WithinRel(700 * 0.3 * 0.4 * 2 * 0.1, 1e-12));
}

TEST_CASE("a boundary of a file holds as its shape does", "[particles][boundary]") {
  // A slab that turns and rises, as a box and as triangles, and as an OpenVDB file of these.
  std::string const text = R"(name = "cube"
gravity = [0, -10, 0]

[time]
step = 0.01
frames = 3

[grid]
spacing = 0.1

[[object]]
name = "cube"
shape = { kind = "box", size = [0.4, 0.4, 0.4] }
translate = [0, 0.17, 0]
material = { young = 1e5, poisson = 0.3, density = 1000 }

[[boundary]]
name = "table"
shape = { kind = "box", size = [1.06, 0.26, 1.06] }
translate = [0.013, -0.114, 0.017]
motion = [{ end = 1, velocity = [0, 0.4, 0], axis = [0, 1, 0], centre = [0, 0, 0], angular_velocity = 90 }]
)";
  auto const end = [](SceneRun const& run) {
    Scene const scene = run.scene();
    auto const simulation = ParticleSimulation::create(scene, build_particles(scene));
    for (int n = 0; n < 3; ++n) CHECK(simulation->step().converged());
    auto x = simulation->positions();
    x.resize(simulation->particle_count());
    return x;
  };
  SceneRun const box("cube.toml", text);
  SceneRun const file("cube.toml",
                      replaced(text, "shape = { kind = \"box\", size = [1.06, 0.26, 1.06] }",
                               "mesh = \"table.obj\"\nscale = 0.01"));
  TriangleMesh mesh;
  for (int v = 0; v < 8; ++v)
    mesh.points.push_back({v & 1 ? 53.0 : -53.0, v & 2 ? 13.0 : -13.0, v & 4 ? 53.0 : -53.0});
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  auto const folder = std::filesystem::path(file.options.scene.scene).parent_path();
  write_obj(folder / "table.obj", mesh);
  auto const x = end(box), y = end(file);
  CHECK(farthest(x, y) < 1e-9);
  // It has been turned and raised.
  Scene const scene = box.scene();
  SceneParticles const start = build_particles(scene);
  double lifted = 0;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (start.list[p].x[1] < 0) lifted = std::max(lifted, x[p][1] - start.list[p].x[1]);
  CHECK(lifted > 0.004);

  // A run of another wall is another run.
  RunIdentity const before = run_identity({}, scene, start);
  auto const identity = [&] {
    Scene const now = file.scene();
    return run_identity({}, now, build_particles(now));
  };
  RunIdentity const of_file = identity();
  CHECK(of_file == identity());
  CHECK(of_file != before);
  mesh.points[0][0] -= 1;
  write_obj(folder / "table.obj", mesh);
  CHECK(of_file != identity());

  mesh.triangles.pop_back();
  write_obj(folder / "table.obj", mesh);
  CHECK_THROWS_MATCHES(
      run_command(file.options), Error,
      MessageMatches(ContainsSubstring("boundary.table") && ContainsSubstring("table.obj")));
}

TEST_CASE("steps are as short as the asked error wants them", "[particles]") {
  // Free fall: implicit Euler is off by g h^2 / 2 a step.
  std::string const text = R"(name = "stone"
gravity = [0, -10, 0]

[time]
step = 0.05
frames = 4

[grid]
spacing = 0.1
cfl = 10
crossing = 10

[[object]]
name = "stone"
shape = { kind = "box", size = [0.2, 0.2, 0.2] }
material = { young = 1e5, poisson = 0.3, density = 1000 }
)";
  auto const fall = [&](std::string const& grid) {
    SceneRun const run("stone.toml", replaced(text, "cfl = 10", "cfl = 10\n" + grid));
    REQUIRE(run_command(run.options) == 0);
    auto const result = run.result();
    auto const start = result.positions(0), x = result.positions(4);
    double worst = 0;
    for (std::size_t p = 0; p < x.size(); ++p)
      worst = std::max(worst, std::abs(x[p][1] - (start[p][1] - 5 * 0.2 * 0.2)));
    return std::pair(int(run.summary().at("grid_steps")), worst);
  };
  auto const [coarse_steps, coarse] = fall("halvings = 3");
  auto const [fine_steps, fine] = fall("time_error = 2e-4");
  CHECK(coarse_steps == 4);
  CHECK_THAT(coarse, WithinRel(0.05, 1e-3));  // g h t / 2
  // 2e-4 m = g h^2 / 2: 6.3 ms, and nine tenths of that.
  CHECK(fine_steps > 30);
  CHECK(fine_steps < 60);
  CHECK(fine < 0.0064);
  refused(replaced(text, "cfl = 10", "cfl = 10\ntime_error = 1e-12\nhalvings = 2"),
          "more than grid.time_error asks for");
}

TEST_CASE("what a boundary holds is no error of a step", "[particles]") {
  // A soft cube on a tray that is pulled away: nodes in the tray go with it at once.
  std::string const text = R"(name = "tray"
gravity = [0, 0, 0]

[time]
step = 0.02
frames = 1

[grid]
spacing = 0.1
time_error = 4e-4

[[object]]
name = "cube"
shape = { kind = "box", size = [0.4, 0.4, 0.4] }
translate = [0, 0.2, 0]
material = { young = 100, poisson = 0.3, density = 1000 }

[[boundary]]
name = "tray"
shape = { kind = "half_space" }
motion = [{ end = 1, velocity = [1, 0, 0] }]
)";
  SceneRun const run("tray.toml", text);
  REQUIRE(run_command(run.options) == 0);
  CHECK(int(run.summary().at("grid_steps")) <= 2);
}

TEST_CASE("the grid and the surface are written on request", "[particles][output]") {
  SceneRun const run("jet.toml", jet, {"output.vdb=true", "output.every=2"});
  REQUIRE(run_command(run.options) == 0);
  auto const folder = run.options.out / "vdb";
  CHECK(std::filesystem::exists(folder / "frame_00000.vdb"));
  CHECK_FALSE(std::filesystem::exists(folder / "frame_00003.vdb"));
  Solid const solid = solid_in_level_set(folder / "frame_00004.vdb");
  auto const result = run.result();
  std::int64_t const last = result.frames() - 1;
  auto const x = result.positions(last);
  for (std::size_t p = 0; p < result.particles(last); ++p)
    CHECK(solid.holds({x[p][0], x[p][1], x[p][2]}));
  CHECK(solid.volume > 0.3 * 0.4 * 2 * 0.12);
  CHECK(solid.volume < 3 * 0.3 * 0.4 * 2 * 0.12);
}

TEST_CASE("snow falls on boards", "[particles][source][scenes]") {
  SceneRun run("boards.toml", read_file(scene_folder() / "boards.toml"),
               {"time.frames=2", "time.step=0.02"});
  run.options.scene.changes.small = true;
  REQUIRE(run_command(run.options) == 0);
  CHECK(run.summary().at("steps_converged") == 2);
  CHECK(run.summary().at("steps_with_inverted_elements") == 0);
  ResultReader const result = run.result();
  CHECK(result.particles(0) < result.particles(1));
  CHECK(result.particles(1) < result.particles(2));
}

TEST_CASE("sauce is poured over a turkey", "[particles][source][scenes]") {
  data_file("meshes/hot/turkey.obj");
  SceneRun run("sauce.toml", read_file(scene_folder() / "sauce.toml"), {"time.frames=3"});
  run.options.scene.changes.small = true;
  REQUIRE(run_command(run.options) == 0);
  CHECK(run.summary().at("steps_converged") == 3);
  CHECK(run.summary().at("steps_with_inverted_elements") == 0);
  // What has left the source at 0.5 m/s; its cloud is not even at such times.
  double const mass = 2700 * 3.14159265358979 * 0.09 * 0.09 * 0.5 * 0.125;
  CHECK_THAT(double(run.summary().at("mass_kg")), WithinRel(mass, 0.15));
}

TEST_CASE("mistakes with sources are answered by a sentence", "[particles][source]") {
  refused(replaced(jet, "velocity = [2, 0, 0]", "velocity = [0, 0, 0]"),
          "source.jet.velocity is 0: nothing would come out");
  refused(replaced(jet, "kind = \"box\", size = [0.3, 0.2, 0.4]",
                   "kind = \"torus\", radius = 1, tube_radius = 0.2"),
          "take a box, a sphere or a cylinder");
  refused(replaced(jet, "kind = \"box\", size = [0.3, 0.2, 0.4]", "kind = \"half_space\""),
          "source.jet.shape.kind is 'half_space'");
  refused(replaced(jet, "end = 0.12", "start = 5"), "nothing comes out of the sources in 0.2 s");
  refused(replaced(jet, "end = 0.12", "start = 0.2\nend = 0.1"), "source.jet.end is 0.1");
  refused(replaced(jet, "end = 0.12", "end = 0.12\nper_cell = 1e-4"), "has no room for a particle");
  refused(replaced(jet, "end = 0.12", "per_cel = 8"), "the nearest is 'per_cell'");
  refused(jet +
              "\n[[boundary]]\nname = \"wall\"\nshape = { kind = \"half_space\", point = [0.1, 0, "
              "0], normal = [-1, 0, 0] }\n",
          "source jet is in boundary wall: at ");
  refused(jet +
              "\n[[object]]\nname = \"stone\"\nshape = { kind = \"sphere\", radius = 0.2 }\n"
              "translate = [0, 1, 0]\nmaterial = { young = 1e5, poisson = 0.3, density = 1000 }\n",
          "object stone is in source jet");
  refused(jet + "\n[[boundary]]\nname = \"jet\"\nshape = { kind = \"half_space\" }\n",
          "the name 'jet' is taken");
  refused(replaced(jet, "[[source]]", "[[sauce]]"), "unknown key 'sauce'");
}
