// The scenes that come with the program: each loads and builds in full and in its small version.

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "scene_text.hpp"

using namespace taut;

namespace {

std::vector<std::filesystem::path> scene_files() {
  std::vector<std::filesystem::path> files;
  for (auto const& entry : std::filesystem::directory_iterator(test::scene_folder()))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

bool needs_data(std::filesystem::path const& file) { return file.stem() == "drag_armadillo"; }

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
    REQUIRE(pin.vertices.size() < points / 2);
  }
  for (Force const& force : geometry.forces)
    REQUIRE((force.force.empty() || force.force.size() == force.vertices.size()));
  REQUIRE(geometry.warnings.empty());
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
    if (!needs_data(file)) CHECK(small_work <= 20000);
    if (!needs_data(file)) CHECK(geometry.mesh.tets.size() <= 20000);
  }
  for (char const* name :
       {"drag", "drag_pose_a", "drag_pose_b", "drag_pose_c", "drag_pose_d", "drag_pose_e",
        "drag_pose_f", "drag_pose_g", "stretch_twist", "hanging_bar", "cantilever",
        "twisting_column", "scrambled_flat", "scrambled_random", "bimaterial", "stiffness_sweep"})
    CHECK(names.count(name) == 1);
}

TEST_CASE("the default scene and its poses cannot end with inverted elements") {
  for (auto const& file : scene_files()) {
    if (!file.stem().string().starts_with("drag") || needs_data(file)) continue;
    INFO(file);
    std::string const model = load_scene(file).objects.at(0).material.model;
    for (MaterialModel const& known : material_models())
      CHECK_FALSE((known.name == model && known.allows_inversion));
  }
}

TEST_CASE("no scene tunes the solver") {
  for (auto const& file : scene_files()) {
    std::ifstream stream(file);
    std::string const text{std::istreambuf_iterator<char>(stream), {}};
    INFO(file);
    CHECK(text.find("solver") == std::string::npos);
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
