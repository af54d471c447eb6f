// The scenes of meshes that come with the program: each loads and builds in full and in its small
// version. Those of material points are run in test_particle_scenes.cpp.

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/contact/intersection.hpp>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <set>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::string text_of(std::filesystem::path const& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::filesystem::path> all_scene_files() {
  std::vector<std::filesystem::path> files;
  for (auto const& entry : std::filesystem::directory_iterator(test::scene_folder()))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}
std::vector<std::filesystem::path> scene_files() {
  std::vector<std::filesystem::path> files = all_scene_files();
  std::erase_if(files, [](auto const& file) {
    return text_of(file).find("\n[grid]\n") != std::string::npos;
  });
  return files;
}

bool needs_data(std::filesystem::path const& file) {
  return text_of(file).find("mesh = \"meshes/") != std::string::npos;
}

/// The papers' heaps and twists, whose size is what is shown.
bool is_large(std::string const& name) {
  return name.starts_with("forty_eight") || name.starts_with("eight") || name == "noodles" ||
         name.starts_with("mat_twist") || name == "rods_twist";
}

void require_consistent(Scene const& scene, SceneGeometry geometry) {
  check_mesh(geometry.mesh, scene.name);
  std::size_t const points = geometry.mesh.points.size(), tets = geometry.mesh.tets.size();
  REQUIRE(geometry.start.size() == points);
  REQUIRE(geometry.velocity.size() == points);
  REQUIRE(geometry.object_of_tet.size() == tets);
  REQUIRE(geometry.material_of_tet.size() == tets);
  std::set<std::int32_t> const used(geometry.material_of_tet.begin(),
                                    geometry.material_of_tet.end());
  REQUIRE(used.size() == geometry.materials.size());
  for (Pin const& pin : geometry.pins) {
    REQUIRE(std::is_sorted(pin.vertices.begin(), pin.vertices.end()));
    REQUIRE(pin.vertices.back() < static_cast<std::int32_t>(points));
    REQUIRE(pin.vertices.size() < points);
  }
  for (Force const& force : geometry.forces)
    REQUIRE((force.force.empty() || force.force.size() == force.vertices.size()));
  REQUIRE(geometry.warnings.empty());
}

/// What starts closer than it may: intersections of the surfaces of bodies and obstacles, and
/// vertices beyond a half space.
std::vector<std::string> collisions(Scene const& scene, SceneGeometry const& geometry) {
  std::vector<std::string> names;
  std::vector<Point> points = geometry.start;
  std::vector<std::int32_t> body(points.size());
  for (ObjectPart const& part : geometry.objects) {
    std::fill_n(body.begin() + part.first_vertex, part.vertices,
                static_cast<std::int32_t>(names.size()));
    names.push_back(part.name);
  }
  std::vector<Triangle> triangles = boundary_faces(geometry.mesh.tets);
  for (ObstacleSurface const& surface : geometry.obstacle_meshes) {
    if (surface.drawn_only) continue;
    auto const first = static_cast<std::int32_t>(points.size());
    for (Triangle triangle : surface.mesh.triangles) {
      for (std::int32_t& v : triangle) v += first;
      triangles.push_back(triangle);
    }
    points.insert(points.end(), surface.mesh.points.begin(), surface.mesh.points.end());
    body.resize(points.size(), static_cast<std::int32_t>(names.size()));
    names.push_back(scene.obstacles[surface.obstacle].name);
  }
  std::vector<std::string> found;
  for (Intersection const& i :
       IntersectionTest({triangles, edges_of(triangles), body}).find(points))
    found.push_back(i.text(names));
  for (SceneObstacle const& obstacle : scene.obstacles) {
    auto const* half = std::get_if<HalfSpaceShape>(&obstacle.geometry);
    if (half == nullptr) continue;
    Point const on_plane = obstacle.placement(half->point);
    Point const normal = obstacle.placement(half->point + half->normal) - on_plane;
    for (Point const& x : geometry.start)
      if (!(dot(normal, x - on_plane) > 1e-3)) found.push_back(obstacle.name);
  }
  return found;
}

double lowest(SceneGeometry const& geometry, std::size_t object) {
  double low = std::numeric_limits<double>::infinity();
  ObjectPart const& part = geometry.objects.at(object);
  for (std::int32_t v = 0; v < part.vertices; ++v)
    low = std::min(low, geometry.start[static_cast<std::size_t>(part.first_vertex + v)][1]);
  return low;
}
double highest(SceneGeometry const& geometry, std::size_t object) {
  double high = -std::numeric_limits<double>::infinity();
  ObjectPart const& part = geometry.objects.at(object);
  for (std::int32_t v = 0; v < part.vertices; ++v)
    high = std::max(high, geometry.start[static_cast<std::size_t>(part.first_vertex + v)][1]);
  return high;
}
double volume(SceneGeometry const& geometry, std::size_t object) {
  double sum = 0;
  ObjectPart const& part = geometry.objects.at(object);
  for (std::int32_t t = 0; t < part.tets; ++t)
    sum += six_volume(geometry.mesh,
                      geometry.mesh.tets[static_cast<std::size_t>(part.first_tet + t)]) /
           6;
  return sum;
}

}  // namespace

TEST_CASE("every scene loads and builds, in full and small") {
  std::set<std::string> names;
  for (auto const& file : scene_files()) {
    INFO(file);
    if (needs_data(file) && std::getenv("TAUT_DATA_DIR") == nullptr) continue;
    Scene const full = load_scene(file);
    CHECK(full.name == file.stem());
    CHECK(full.description.size() > 20);
    CHECK(read_scene_title(file).description == full.description);
    CHECK(names.insert(full.name).second);
    SceneGeometry const geometry = build_geometry(full);
    require_consistent(full, geometry);

    Scene const small = load_scene(file, {.small = true, .overrides = {}});
    SceneGeometry const small_geometry = build_geometry(small);
    require_consistent(small, small_geometry);
    std::size_t const full_work = geometry.mesh.tets.size() * static_cast<std::size_t>(full.frames);
    std::size_t const small_work =
        small_geometry.mesh.tets.size() * static_cast<std::size_t>(small.frames);
    CHECK(small_work < full_work);
    CAPTURE(small_work, geometry.mesh.tets.size());
    if (needs_data(file)) continue;
    CHECK(small_work <= 60000);
    CHECK(geometry.mesh.tets.size() <= (is_large(full.name) ? 220000u : 20000u));
  }
  for (char const* name : {"drag",
                           "drag_pose_a",
                           "drag_pose_b",
                           "drag_pose_c",
                           "drag_pose_d",
                           "drag_pose_e",
                           "drag_pose_f",
                           "drag_pose_g",
                           "stretch_twist",
                           "hanging_bar",
                           "cantilever",
                           "twisting_column",
                           "scrambled_flat",
                           "scrambled_random",
                           "bimaterial",
                           "stiffness_sweep",
                           "eight_letters",
                           "forty_eight_letters",
                           "forty_eight_letters_gentle",
                           "noodles",
                           "squeeze",
                           "mat_twist",
                           "mat_twist_long",
                           "rods_twist",
                           "slope",
                           "card_house",
                           "stack_1e6",
                           "funnel",
                           "fast_ball",
                           "drop_stiff"})
    CHECK(names.count(name) == 1);
}

TEST_CASE("the dragged letter and its poses cannot end with inverted elements") {
  for (auto const& file : scene_files()) {
    if (!file.stem().string().starts_with("drag") || needs_data(file)) continue;
    INFO(file);
    std::string const model = load_scene(file).objects.at(0).material.model;
    for (MaterialModel const& known : material_models())
      CHECK_FALSE((known.name == model && known.allows_inversion));
  }
}

TEST_CASE("no scene tunes the solver") {
  for (auto const& file : all_scene_files()) {
    INFO(file);
    CHECK(text_of(file).find("solver") == std::string::npos);
  }
}

TEST_CASE("the armadillo scene has the paper's 214 fixed vertices and forces") {
  if (std::getenv("TAUT_DATA_DIR") == nullptr) SKIP("needs TAUT_DATA_DIR");
  SceneGeometry const geometry =
      build_geometry(load_scene(test::scene_folder() / "drag_armadillo.toml"));
  CHECK(geometry.mesh.points.size() == 13230);
  CHECK(geometry.mesh.tets.size() == 54985);
  CHECK(geometry.pins.at(0).vertices.size() == 214);
  // Frames 0 to 79 of 0.04 s pull, frame 80 on falls.
  double const h = 0.04;
  CHECK(geometry.forces.at(0).window.covers_step(80 * h, h));
  CHECK_FALSE(geometry.forces.at(0).window.covers_step(81 * h, h));
  CHECK_FALSE(geometry.forces.at(1).window.covers_step(80 * h, h));
  CHECK(geometry.forces.at(1).window.covers_step(81 * h, h));
}

TEST_CASE("no scene starts with bodies or obstacles in each other, in full or small") {
  for (auto const& file : scene_files()) {
    INFO(file);
    if (needs_data(file) && std::getenv("TAUT_DATA_DIR") == nullptr) continue;
    for (bool const small : {false, true}) {
      Scene const scene = load_scene(file, {.small = small, .overrides = {}});
      bool const starts_at_rest =
          std::all_of(scene.objects.begin(), scene.objects.end(), [](SceneObject const& object) {
            return std::holds_alternative<std::monostate>(object.start);
          });
      if (!starts_at_rest) continue;
      CAPTURE(small);
      CHECK(collisions(scene, build_geometry(scene)) == std::vector<std::string>{});
    }
  }
}

TEST_CASE("the ten contact tests have the shapes, gaps and numbers of the paper's set") {
  struct Test {
    std::string name;
    double lower, upper;  ///< volume, m^3
    double gap;           ///< m
  };
  for (Test const& test : {Test{"wedge_wedge", 3, 3, 1}, Test{"wedge_spike", 3, 1, 0.5},
                           Test{"spike_spike", 1, 1, 0.5}, Test{"crack_spike", 7, 1, 1.5},
                           Test{"crack_wedge", 7, 3, 0.5}, Test{"edge_spike", 4 * 64, 1, 2},
                           Test{"cube_spike", 512, 0.125, 2.5}, Test{"cube_wedge", 4096, 3, 1},
                           Test{"edge_cube", 4, 1, 0.2}, Test{"cliff_cube", 19.0 / 12, 1, 0.2}}) {
    INFO(test.name);
    Scene const scene = load_scene(test::scene_folder() / ("unit_" + test.name + ".toml"));
    SceneGeometry const geometry = build_geometry(scene);
    REQUIRE(geometry.objects.size() == 2);
    CHECK(geometry.objects[0].name == "lower");
    CHECK_THAT(volume(geometry, 0), WithinRel(test.lower, 1e-12));
    CHECK_THAT(volume(geometry, 1), WithinRel(test.upper, 1e-12));
    CHECK_THAT(lowest(geometry, 1) - highest(geometry, 0), WithinAbs(test.gap, 1e-12));
    CHECK(geometry.pins.at(0).vertices.size() ==
          static_cast<std::size_t>(geometry.objects[0].vertices));
    CHECK(scene.step == 0.04);
    CHECK(scene.frames == 300);
    for (SceneObject const& object : scene.objects) {
      CHECK(object.material.young == 1e5);
      CHECK(object.material.poisson == 0.4);
      CHECK(object.material.density == 100);
      CHECK(object.material.model ==
            (test.name == "crack_wedge" ? "stable_neo_hookean" : "neo_hookean"));
    }
  }
}

TEST_CASE("the letters stand as the paper's do, and its twists turn as far as they should") {
  SceneGeometry const eight =
      build_geometry(load_scene(test::scene_folder() / "eight_letters.toml"));
  REQUIRE(eight.objects.size() == 8);
  for (std::size_t k = 0; k < 8; ++k) {
    double const centre = 1.5 * static_cast<double>(k / 2);
    CHECK_THAT(lowest(eight, k), WithinAbs(centre - 0.5625, 1e-12));
    CHECK_THAT(volume(eight, k), WithinRel(0.5625, 1e-9));
  }
  CHECK(load_scene(test::scene_folder() / "forty_eight_letters.toml").objects.size() == 48);
  CHECK(load_scene(test::scene_folder() / "forty_eight_letters_gentle.toml").gravity ==
        Point{0, -0.5, 0});

  auto const turned = [](std::string const& name, std::size_t pin, double t) {
    Scene const scene = load_scene(test::scene_folder() / (name + ".toml"));
    double angle = 0;
    for (MotionPhase const& phase : scene.pins.at(pin).motion.phases)
      angle += phase.angular_velocity *
               std::max(0.0, std::min(t, phase.window.end) - phase.window.start);
    return angle / (2 * std::numbers::pi);
  };
  CHECK_THAT(turned("mat_twist", 0, 10), WithinAbs(2, 1e-12));
  CHECK_THAT(turned("mat_twist", 1, 10), WithinAbs(-2, 1e-12));
  CHECK_THAT(turned("mat_twist", 0, 20), WithinAbs(0, 1e-12));
  CHECK_THAT(turned("mat_twist_long", 0, 2880 * 0.04), WithinAbs(8, 1e-12));
  CHECK_THAT(turned("rods_twist", 1, 500 * 0.04), WithinAbs(-4, 1e-12));
}

TEST_CASE("the walls of the squeeze close in from all six sides and open again") {
  Scene const scene = load_scene(test::scene_folder() / "squeeze.toml");
  REQUIRE(scene.obstacles.size() == 6);
  auto const box = [&](double t) {
    Point sum{};
    for (SceneObstacle const& wall : scene.obstacles) {
      auto const& half = std::get<HalfSpaceShape>(wall.geometry);
      sum = sum +
            -dot(half.normal, wall.motion.at(t)(half.point)) *
                Point{std::abs(half.normal[0]), std::abs(half.normal[1]), std::abs(half.normal[2])};
    }
    return sum;
  };
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK_THAT(box(0)[a], WithinAbs((Point{2.4, 1.35, 2.4})[a], 1e-12));
    CHECK_THAT(box(4.2)[a], WithinAbs((Point{1.15, 0.75, 1.15})[a], 1e-12));
    CHECK(box(5.4)[a] > 3.5);
  }
}
