// The commands that say what there is: scenes, methods, and the plan of a scene.
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

namespace taut {

std::vector<std::filesystem::path> scene_folders() {
  std::vector<std::filesystem::path> folders;
  if (char const* own = std::getenv("TAUT_SCENES_DIR")) folders.emplace_back(own);
  std::error_code none;
  auto const program = std::filesystem::read_symlink("/proc/self/exe", none);
  if (!none) folders.push_back(program.parent_path().parent_path() / "share/taut/scenes");
  folders.emplace_back(TAUT_SCENES_SOURCE_DIR);
  std::erase_if(folders, [](auto const& f) { return !std::filesystem::is_directory(f); });
  return folders;
}

namespace {
std::map<std::string, std::filesystem::path> built_in_scenes() {
  std::map<std::string, std::filesystem::path> scenes;
  for (auto const& folder : scene_folders()) {
    for (auto const& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".toml") {
        scenes.emplace(entry.path().stem().string(), entry.path());
      }
    }
  }
  return scenes;
}
}  // namespace

std::filesystem::path find_scene(std::string const& name) {
  if (std::filesystem::is_regular_file(name)) return name;
  auto const scenes = built_in_scenes();
  if (auto const found = scenes.find(name); found != scenes.end()) return found->second;
  if (scenes.empty()) throw Error("scene \"{}\": there is no such file", name);
  std::vector<std::string_view> names;
  for (auto const& [known, path] : scenes) names.push_back(known);
  throw Error(
      "scene \"{}\": no file has this path and no built-in scene this name; nearest: \"{}\"", name,
      nearest(name, names));
}

int scenes_command() {
  for (auto const& [name, path] : built_in_scenes()) {
    fmt::print("{:<18} {}\n", name, read_scene_title(path).description);
  }
  return 0;
}

int methods_command() {
  fmt::print("solver.method\n");
  for (MethodTitle const& m : method_titles()) fmt::print("  {:<11} {}\n", m.name, m.description);
  for (SolverKey const& key : solver_keys()) {
    if (key.choices.empty() || key.name == "method") continue;
    fmt::print("solver.{} (default {})\n", key.name, std::get<std::string>(key.fallback));
    for (auto const& choice : key.choices) fmt::print("  {}\n", choice);
    fmt::print("    {}\n", key.help);
  }
  return 0;
}

int plan_command(SceneArguments const& arguments) {
  Scene const scene = load_scene(find_scene(arguments.scene), arguments.changes);
  SceneGeometry const geometry = build_geometry(scene);
  SolverOptions const& solver = scene.solver;
  double const h = scene.step, edge = mean_edge_length(geometry.mesh);

  fmt::print("{}: {}\n", scene.name, scene.description);
  fmt::print("  {} vertices, {} tets, {} object{}; mean edge {:.4g} m\n",
             geometry.mesh.points.size(), geometry.mesh.tets.size(), geometry.objects.size(),
             geometry.objects.size() == 1 ? "" : "s", edge);
  fmt::print("terms of the potential\n");
  if (scene.scheme == TimeScheme::quasi_static) {
    fmt::print("  (no inertia: the solve is quasi-static, each step is an equilibrium)\n");
  } else {
    fmt::print("  inertia       lumped mass, {} with h = {:.4g} s\n",
               scene.scheme == TimeScheme::bdf2 ? "BDF2 (second order)"
                                                : "implicit Euler (first order, dissipative)",
               h);
  }
  bool const forces = !geometry.forces.empty();
  bool const gravity = scene.gravity != Point{};
  if (gravity || forces) {
    fmt::print("  body force    {}{}{}\n", gravity ? "gravity" : "",
               gravity && forces ? " and " : "", forces ? "forces of the scene" : "");
  } else {
    fmt::print("  (no body force: no gravity, no [[force]])\n");
  }
  std::set<std::string> models;
  double stiffest = 0, softest = 1e300, slowest_wave = 1e300, fastest_wave = 0;
  for (MaterialParameters const& m : geometry.materials) {
    models.insert(m.model);
    stiffest = std::max(stiffest, m.young);
    softest = std::min(softest, m.young);
    slowest_wave = std::min(slowest_wave, std::sqrt(m.young / m.density));
    fastest_wave = std::max(fastest_wave, std::sqrt(m.young / m.density));
  }
  for (std::string const& model : models) {
    bool const inverts =
        ElasticModels::with(model, []<class Model>() { return Model::allows_inversion; });
    bool const rotation = ElasticModels::with(model, []<class Model>() { return Model::use.d1; });
    fmt::print("  elastic tets  {}: {}{}\n", model,
               rotation ? "needs the polar decomposition of F"
                        : "invariants alone, no polar decomposition",
               inverts ? "" : "; steps are bounded so that J > 0");
  }
  if (!geometry.pins.empty()) {
    std::size_t pinned = 0;
    for (Pin const& pin : geometry.pins) pinned += pin.vertices.size();
    fmt::print("  pins          {} vertices leave the unknowns while they are held\n", pinned);
  }
  fmt::print("  (no contact: this version has elastic terms alone)\n");

  fmt::print("minimiser\n");
  fmt::print("  method        {}\n", solver.text("method"));
  fmt::print("  metric        {}, refreshed {}\n", solver.text("preconditioner"),
             solver.text("refresh"));
  fmt::print("  precision     {}\n", solver.text("precision"));
  fmt::print("  curvature     {}\n", solver.text("curvature"));
  fmt::print(
      "  stop          {} at {:.3g}: an estimated error of {:.3g} m, {:.3g} m/s; at most {} "
      "iterations\n",
      solver.text("stopping"), solver.number("tolerance"), solver.number("tolerance") * edge,
      solver.number("tolerance") * edge / h, solver.integer("max_iterations"));
  // How many elements a wave crosses per step says how global a step is.
  double const courant = fastest_wave * h / edge;
  fmt::print("advice\n");
  fmt::print("  the fastest wave crosses {:.2g} elements per step{}\n", courant,
             courant < 1 ? ": an explicit method would do" : "");
  if (courant > 30 && solver.text("preconditioner") == "block_jacobi") {
    fmt::print(
        "  that is stiff: measure `taut chart {} --methods "
        "dk,dk:preconditioner=schwarz_32,newton`\n",
        arguments.scene);
  }
  if (stiffest > 100 * softest) {
    fmt::print(
        "  stiffness varies by {:.1e}: the error estimate of a local preconditioner is "
        "optimistic, compare with newton\n",
        stiffest / softest);
  }
  fmt::print("  memory: about {:.2g} GB\n", 1e-9 * memory_needed(geometry, solver));
  for (std::string const& warning : geometry.warnings) fmt::print("warning: {}\n", warning);
  return 0;
}

}  // namespace taut
