// Intersections in the program: what `taut check` says of a result, what `taut run` does with a
// scene that starts with some, and with a step that leaves some.
#include "command_line.hpp"
#include "scene_run.hpp"

#include <taut/apps/program/intersections.hpp>
#include <taut/apps/program/scene_result.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>

#include <limits>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

namespace {

/// Two cubes in free fall; the right one comes 0.1 m nearer per step.
std::string const collision = R"(name = "collision"
gravity = [0, -10, 0]

[time]
step = 0.01
frames = 6

[[object]]
name = "left"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[object]]
name = "right"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
translate = [1.25, 0.3, 0.1]
velocity = { linear = [-10, 0, 0] }
material = { young = 1e5, poisson = 0.4, density = 1000 }
)";

struct Collision : SceneRun {
  explicit Collision(std::string const& text = collision) : SceneRun("collision.toml", text) {}
};

/// A result of two cubes, the smaller one moved along x from frame to frame.
void write_result(std::filesystem::path const& file, std::vector<double> const& places) {
  TetMesh const large = make_shape(BoxShape{}, 2), small = make_shape(BoxShape{{0.2, 0.2, 0.2}}, 2);
  ResultMesh all{large, std::vector<std::int32_t>(large.tets.size(), 0), {"rock", "pebble"}};
  std::size_t const first = large.points.size();
  all.mesh.points.insert(all.mesh.points.end(), small.points.begin(), small.points.end());
  for (Tet tet : small.tets) {
    for (std::int32_t& v : tet) v += static_cast<std::int32_t>(first);
    all.mesh.tets.push_back(tet);
    all.object.push_back(1);
  }
  auto writer = ResultWriter::create(file, all, static_cast<std::int64_t>(places.size()),
                                     ResultWriter::IfExists::refuse, false);
  double time = 0;
  for (double const place : places) {
    auto x = all.mesh.points;
    for (std::size_t v = first; v < x.size(); ++v) x[v][0] += place;
    writer.append(time++, x, {});
  }
}

/// Adds a surface as an object of its own, moved by `away`.
void add_surface(ResultMesh& all, TriangleMesh const& mesh, Point const& away,
                 std::string const& name, ObjectKind kind) {
  auto const first = static_cast<std::int32_t>(all.mesh.points.size());
  auto const number = static_cast<std::int32_t>(all.object_names.size());
  for (Point const& x : mesh.points)
    all.mesh.points.push_back({x[0] + away[0], x[1] + away[1], x[2] + away[2]});
  for (Triangle t : mesh.triangles) {
    for (std::int32_t& v : t) v += first;
    all.triangles.push_back(t);
    all.object.push_back(number);
  }
  all.object_names.push_back(name);
  all.object_kind.push_back(kind);
}

/// A body, a unit cube around the origin.
ResultMesh one_cube() {
  TetMesh const cube = make_shape(BoxShape{}, 2);
  return {cube, std::vector<std::int32_t>(cube.tets.size(), 0), {"cube"}, {}, {ObjectKind::body}};
}

TriangleMesh box_surface(double size) {
  return boundary_surface(make_shape(BoxShape{{size, size, size}}, 2));
}

}  // namespace

TEST_CASE("bodies and obstacles must not meet, obstacles among themselves may", "[intersections]") {
  ResultMesh all = one_cube();
  auto const found_with = [](ResultMesh const& mesh) {
    ObjectIntersections const surface(mesh);
    auto const found = surface.find(mesh.mesh.points);
    for (Intersection const& i : found) CHECK(surface.with_obstacle(i));
    return found.empty() ? "" : surface.count(found) + ": " + surface.text(found.front());
  };
  SECTION("apart") {
    add_surface(all, box_surface(1), {1.25, 0, 0}, "wall", ObjectKind::obstacle);
    CHECK(found_with(all).empty());
  }
  SECTION("crossing") {
    add_surface(all, box_surface(1), {0.7, 0.1, 0.05}, "wall", ObjectKind::obstacle);
    CHECK_THAT(found_with(all),
               ContainsSubstring(" of cube with wall): edge ") && ContainsSubstring(" crosses "));
  }
  SECTION("touching") {
    add_surface(all, box_surface(1), {1, 0, 0}, "wall", ObjectKind::obstacle);
    CHECK_THAT(found_with(all), ContainsSubstring(" of cube with wall): edge "));
  }
  SECTION("a body inside a closed obstacle") {
    add_surface(all, box_surface(3), {0, 0, 0}, "shell", ObjectKind::obstacle);
    CHECK_THAT(found_with(all), ContainsSubstring("1 intersection (1 of cube with shell): cube is "
                                                  "inside shell: its vertex "));
  }
  SECTION("an obstacle inside a body") {
    add_surface(all, box_surface(0.2), {0, 0, 0}, "core", ObjectKind::obstacle);
    CHECK_THAT(found_with(all), ContainsSubstring("1 intersection (1 of core with cube): core is "
                                                  "inside cube: its vertex "));
  }
  SECTION("an open obstacle has no inside, but an edge and a side") {
    TriangleMesh open = box_surface(3);
    open.triangles.pop_back();
    add_surface(all, open, {0, 0, 0}, "shell", ObjectKind::obstacle);
    CHECK(found_with(all).empty());
    all = one_cube();
    add_surface(all, open, {1.9, 0.1, 0}, "shell", ObjectKind::obstacle);
    CHECK_THAT(found_with(all), ContainsSubstring(" of cube with shell): edge "));
  }
  SECTION("obstacles that cross, that hold each other and that cross themselves") {
    add_surface(all, box_surface(1), {5, 0, 0}, "one", ObjectKind::obstacle);
    add_surface(all, box_surface(1), {5.3, 0.1, 0.2}, "other", ObjectKind::obstacle);
    add_surface(all, box_surface(0.2), {4.9, 0, 0}, "within", ObjectKind::obstacle);
    TriangleMesh twice = box_surface(1);
    auto const count = static_cast<std::int32_t>(twice.points.size());
    for (std::int32_t v = 0; v < count; ++v) {
      Point const x = twice.points[static_cast<std::size_t>(v)];
      twice.points.push_back({x[0] + 0.4, x[1] + 0.1, x[2]});
    }
    auto const triangles = twice.triangles;
    for (auto const& [a, b, c] : triangles)
      twice.triangles.push_back({a + count, b + count, c + count});
    add_surface(all, twice, {9, 0, 0}, "doubled", ObjectKind::obstacle);
    CHECK(found_with(all).empty());
  }
  SECTION("a picture of an obstacle is in nobody's way") {
    add_surface(all, box_surface(1), {0.7, 0.1, 0.05}, "wall", ObjectKind::drawn_only);
    add_surface(all, box_surface(3), {0, 0, 0}, "room", ObjectKind::drawn_only);
    // Not even where it is not finite.
    all.mesh.points.back()[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(found_with(all).empty());
  }
}

TEST_CASE("check looks for bodies in obstacles, as the result says what is one",
          "[intersections]") {
  ScratchFolder const folder;
  auto const file = folder.write("place", "").parent_path() / "result.vtkhdf";
  ResultMesh all = one_cube();
  add_surface(all, box_surface(1), {2, 0.1, 0.05}, "wall", ObjectKind::obstacle);
  add_surface(all, box_surface(1), {2.2, 0, 0}, "post", ObjectKind::obstacle);
  add_surface(all, box_surface(9), {0, 0, 0}, "room", ObjectKind::drawn_only);
  auto writer = ResultWriter::create(file, all, 2, ResultWriter::IfExists::refuse, false);
  for (int k = 0; k < 2; ++k) {
    auto x = all.mesh.points;
    // The wall, its points behind the body's, is pushed through the body.
    std::size_t const first = one_cube().mesh.points.size();
    for (std::size_t v = 0; v < box_surface(1).points.size(); ++v) x[first + v][0] -= 1.3 * k;
    writer.append(k, x, {});
  }
  Outcome const outcome = taut_with("check " + file.string());
  INFO(outcome.text);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.text,
             !ContainsSubstring("frame 0 ") &&
                 ContainsSubstring("frame 1 (1 s): 0 inverted elements, 0 values not finite, ") &&
                 ContainsSubstring(" of cube with wall)\n  edge ") &&
                 ContainsSubstring("2 frames of 144 tets: 1 with faults; "));
}

TEST_CASE("a scene's obstacles come behind its bodies in the result", "[intersections]") {
  ScratchFolder const folder;
  Scene const scene = load_scene(folder.write("scene.toml", collision + R"(
[[obstacle]]
name = "floor"
shape = { kind = "half_space", point = [0, -2, 0] }

[[obstacle]]
name = "block"
shape = { kind = "box", size = [1, 1, 1], resolution = 1 }
translate = [5, 0, 0]

[contact]
)"));
  SceneGeometry const geometry = build_geometry(scene);
  ResultMesh const result = result_mesh(scene, geometry);
  CHECK(result.object_names == std::vector<std::string>{"left", "right", "floor", "block"});
  CHECK(result.object_kind == std::vector<ObjectKind>{ObjectKind::body, ObjectKind::body,
                                                      ObjectKind::drawn_only,
                                                      ObjectKind::obstacle});
  CHECK(result.mesh.tets == geometry.mesh.tets);
  REQUIRE(result.object.size() == result.mesh.tets.size() + result.triangles.size());
  std::size_t const bodies = geometry.mesh.points.size();
  CHECK(std::equal(geometry.start.begin(), geometry.start.end(), result.mesh.points.begin()));
  for (std::size_t t = 0; t < result.triangles.size(); ++t) {
    bool const floor = result.object[result.mesh.tets.size() + t] == 2;
    for (std::int32_t const v : result.triangles[t]) {
      REQUIRE(static_cast<std::size_t>(v) >= bodies);
      Point const& x = result.mesh.points.at(static_cast<std::size_t>(v));
      double const from_centre = std::max({std::abs(x[0] - 5), std::abs(x[1]), std::abs(x[2])});
      CHECK(std::abs(floor ? x[1] + 2 : from_centre - 0.5) < 1e-12);
    }
  }
  CHECK(std::count(result.object.begin(), result.object.end(), 3) == 24);
}

TEST_CASE("a scene that starts with a body in an obstacle is refused, naming both",
          "[intersections]") {
  auto const [obstacle, what] = GENERATE(
      std::pair<std::string, std::string>{
          R"(shape = { kind = "box", size = [9, 9, 9], resolution = 1 })",
          "(1 of left with trap, 1 of right with trap); the first: left is inside trap"},
      std::pair<std::string, std::string>{
          R"(shape = { kind = "sphere", radius = 0.2, resolution = 3 })",
          "(1 of left with trap); the first: trap is inside left"},
      std::pair<std::string, std::string>{
          R"(shape = { kind = "box", size = [0.3, 9, 0.3], resolution = 1 })",
          "of left with trap); the first: edge "});
  Collision scene(collision + "\n[[obstacle]]\nname = \"trap\"\n" + obstacle + "\n[contact]\n");
  CHECK_THROWS_MATCHES(
      run_command(scene.options), Error,
      MessageMatches(ContainsSubstring("collision.toml: the scene starts with ") &&
                     ContainsSubstring(what) &&
                     ContainsSubstring("object.NAME.translate or obstacle.NAME.translate")));
  CHECK_FALSE(std::filesystem::exists(scene.options.out));
}

TEST_CASE("check names what intersects, where and when", "[intersections]") {
  ScratchFolder const folder;
  auto const file = folder.write("place", "").parent_path() / "result.vtkhdf";
  SECTION("nothing") {
    write_result(file, {2, 1, -1});
    Outcome const outcome = taut_with("check " + file.string());
    CHECK(outcome.status == 0);
    CHECK(outcome.text == "3 frames of " + std::to_string(2 * 144) + " tets: clean\n");
  }
  SECTION("through the side, touching it from outside, inside") {
    write_result(file, {2, 0.5, 0.6, 0.01, 0.5, 0.5});
    Outcome const outcome = taut_with("check " + file.string());
    INFO(outcome.text);
    CHECK(outcome.status == 1);
    CHECK_THAT(outcome.text,
               !ContainsSubstring("frame 0 ") &&
                   ContainsSubstring("frame 1 (1 s): 0 inverted elements, 0 values not finite, ") &&
                   ContainsSubstring(" of pebble with rock)\n  edge ") &&
                   ContainsSubstring(" more\nframe 2 (2 s)") && ContainsSubstring(" touches ") &&
                   ContainsSubstring("frame 3 (3 s): 0 inverted elements, 0 values not finite, 1 "
                                     "intersection (1 of pebble with rock)\n  pebble is inside "
                                     "rock: its vertex ") &&
                   ContainsSubstring("6 frames of 288 tets: 5 with faults; ") &&
                   ContainsSubstring(" intersections in 5 of them\n"));
    // Later frames have their count, and no list.
    std::string const tail = outcome.text.substr(outcome.text.find("frame 4 "));
    CHECK(std::count(tail.begin(), tail.end(), '\n') == 3);

    Outcome const left_out = taut_with("check --no-intersections " + file.string());
    CHECK(left_out.status == 0);
    CHECK(left_out.text == "6 frames of 288 tets: clean, not looked for intersections\n");
  }
  SECTION("a frame that is not finite is said not to be looked at") {
    write_result(file, {2, std::numeric_limits<double>::quiet_NaN(), 0.5});
    Outcome const outcome = taut_with("check " + file.string());
    CHECK(outcome.status == 1);
    CHECK_THAT(outcome.text, ContainsSubstring("values not finite, not looked for intersections") &&
                                 ContainsSubstring("frame 2 (2 s)"));
  }
}

TEST_CASE("the most frequent pairs of objects are named, the others counted", "[intersections]") {
  TetMesh const cube = make_shape(BoxShape{}, 1);
  TetMesh all;
  std::vector<std::int32_t> object;
  std::vector<std::string> const names{"a", "b", "c", "d"};
  for (int k = 0; k < 4; ++k) {
    auto const first = static_cast<std::int32_t>(all.points.size());
    for (Point const& x : cube.points) all.points.push_back({x[0] + 0.2 * k, x[1] + 0.1 * k, x[2]});
    for (Tet tet : cube.tets) {
      for (std::int32_t& v : tet) v += first;
      all.tets.push_back(tet);
      object.push_back(k);
    }
  }
  ObjectIntersections const surface(ResultMesh{all, object, names});
  auto const found = surface.find(all.points);
  CHECK_THAT(surface.count(found), ContainsSubstring("and 3 more pairs of objects)"));
  CHECK_THAT(surface.first_few(found, 2),
             ContainsSubstring("  and " + std::to_string(found.size() - 2) + " more\n"));
  CHECK(surface.first_few({found.front()}, 2) == "  " + surface.text(found.front()) + "\n");
}

TEST_CASE("a piece of an object inside another piece of it is found", "[intersections]") {
  TetMesh pieces = make_shape(BoxShape{}, 2);
  std::size_t const first = pieces.points.size();
  TetMesh const small = make_shape(BoxShape{{0.2, 0.2, 0.2}}, 1);
  pieces.points.insert(pieces.points.end(), small.points.begin(), small.points.end());
  for (Tet tet : small.tets) {
    for (std::int32_t& v : tet) v += static_cast<std::int32_t>(first);
    pieces.tets.push_back(tet);
  }
  std::vector<std::int32_t> const object(pieces.tets.size(), 0);
  ObjectIntersections const surface(ResultMesh{pieces, object, {"all"}});
  auto const found = surface.find(pieces.points);
  CHECK(surface.count(found) == "1 intersection (1 of all with itself)");
}

TEST_CASE("a scene that starts intersecting is warned of, or refused where steps are checked",
          "[intersections]") {
  bool const inside = GENERATE(false, true);
  std::string const text =
      inside ? replaced(replaced(collision, "[1.25, 0.3, 0.1]", "[0.1, 0, 0]"),
                        "name = \"right\"\nshape = { kind = \"box\", size = [1, 1, 1]",
                        "name = \"right\"\nshape = { kind = \"box\", size = [0.2, 0.2, 0.2]")
             : replaced(collision, "[1.25, 0.3, 0.1]", "[0.95, 0.3, 0.1]");
  Collision scene(text);
  scene.options.scene.changes.overrides = {"time.frames=1", "object.right.velocity.linear=[0,0,0]"};
  std::string const what = inside ? "1 of left with right); the first: right is inside left"
                                  : "of left with right); the first: edge ";
  SECTION("not checked") {
    CHECK(run_command(scene.options) == 0);
    auto const warnings = scene.summary().at("warnings");
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0].get<std::string>(),
               ContainsSubstring("the scene starts with ") && ContainsSubstring(what));
  }
  SECTION("checked") {
    scene.options.check = CheckRun::every_step;
    CHECK_THROWS_MATCHES(
        run_command(scene.options), Error,
        MessageMatches(ContainsSubstring("collision.toml: the scene starts with ") &&
                       ContainsSubstring(what) && ContainsSubstring("object.NAME.translate")));
    CHECK_FALSE(std::filesystem::exists(scene.options.out));
  }
}

TEST_CASE("a checked run ends before the first step that intersects", "[intersections]") {
  // The gap of 0.25 m is closed in the third step.
  int const every = GENERATE(1, 3);
  Collision scene;
  scene.options.check = CheckRun::every_step;
  scene.options.scene.changes.overrides = {"output.every=" + std::to_string(every)};
  CHECK_THROWS_MATCHES(run_command(scene.options), Error,
                       MessageMatches(ContainsSubstring("step 3 at 0.03 s leaves ") &&
                                      ContainsSubstring(" of left with right); the first: edge ") &&
                                      ContainsSubstring("The state before it is the last frame")));
  CHECK(scene.summary().at("ended") == "stopped by an error");
  CHECK(scene.summary().at("frames") == 2);
  CHECK(scene.summary().at("intersections") == "in 1 of 3 steps looked at");
  CHECK(scene.result().frames() == (every == 1 ? 3 : 2));
  CHECK(scene.result().times().back() == 0.02);
  std::string const report = read_file(scene.options.out / "report.jsonl");
  CHECK(std::count(report.begin(), report.end(), '\n') == 2);
  CHECK(check_command(scene.options.out) == 0);
  auto const last_good = scene.result().positions(scene.result().frames() - 1);

  // It goes on from there without the check, as a run that never had one.
  scene.options.restart = true;
  CHECK_THROWS_MATCHES(run_command(scene.options), Error,
                       MessageMatches(ContainsSubstring("step 3 at 0.03 s leaves ")));
  scene.options.check = CheckRun::off;
  CHECK(run_command(scene.options) == 0);
  CHECK(scene.summary().at("intersections") == "in 2 of 4 steps looked at");
  CHECK(check_command(scene.options.out) == 1);
  Collision other;
  other.options.scene.changes = scene.options.scene.changes;
  CHECK(run_command(other.options) == 0);
  REQUIRE(scene.result().frames() == other.result().frames());
  for (int k = 0; k < other.result().frames(); ++k)
    CHECK(scene.result().positions(k) == other.result().positions(k));
  if (every == 1) CHECK(last_good == other.result().positions(2));
}

TEST_CASE("an iteration that intersects leaves the state before its step as the last frame",
          "[intersections]") {
  // What spins needs iterations, of which the third step's are the first to intersect.
  std::string const spin = "object.left.velocity={ axis = [1, 0, 0], angular_velocity = 100 }";
  Collision scene;
  scene.options.check = CheckRun::every_iteration;
  scene.options.scene.changes.overrides = {"output.every=4", spin};
  CHECK_THROWS_MATCHES(run_command(scene.options), Error,
                       MessageMatches(ContainsSubstring("step 3 at 0.02 s: iteration ") &&
                                      ContainsSubstring("The state before it is the last frame")));
  CHECK(scene.summary().at("intersections") == "in 1 of 3 steps looked at");
  CHECK(scene.result().times() == std::vector<double>{0, 0.02});
  Collision other;
  other.options.scene.changes.overrides = {"time.frames=2", spin};
  CHECK(run_command(other.options) == 0);
  CHECK(scene.result().positions(1) == other.result().positions(2));

  scene.options.restart = true;
  scene.options.check = CheckRun::off;
  CHECK(run_command(scene.options) == 0);
  CHECK(scene.result().frames() == 3);
}

TEST_CASE("the summary says of how many steps it knows intersections", "[intersections]") {
  Collision scene;
  auto const leg = [&](int frames, CheckRun check) {
    scene.options.scene.changes.overrides = {"time.frames=" + std::to_string(frames)};
    scene.options.check = check;
    CHECK(run_command(scene.options) == 0);
    scene.options.restart = true;
    return scene.summary().at("intersections").get<std::string>();
  };
  SECTION("looked for from the second step on") {
    CHECK(leg(1, CheckRun::off) == "not looked for");
    CHECK(leg(2, CheckRun::every_step) == "none in 1 of 2 steps");
  }
  SECTION("no more looked for") {
    CHECK(leg(2, CheckRun::every_step) == "none");
    CHECK(leg(4, CheckRun::off) == "none in 2 of 4 steps");
  }
}

TEST_CASE("a run without an intersection is the same with the check", "[intersections]") {
  Collision plain, checked;
  for (Collision* scene : {&plain, &checked})
    scene->options.scene.changes.overrides = {"time.frames=2"};
  checked.options.check = CheckRun::every_step;
  CHECK(run_command(plain.options) == 0);
  CHECK(run_command(checked.options) == 0);
  CHECK(plain.result().positions(2) == checked.result().positions(2));
  CHECK(plain.result().velocities(2) == checked.result().velocities(2));
}

TEST_CASE("the option is told from its words", "[intersections]") {
  ScratchFolder const folder;
  std::string const scene = folder.write("collision.toml", collision).string();
  std::string const out = " --out " + (folder.write("x", "").parent_path() / "out").string();
  says("run --check every-step " + scene + out, 1, "step 3 at 0.03 s leaves ");
  says("run --check sometimes " + scene + out, 105, "every-step");
  says("run --help", 0, "every-step");
}
