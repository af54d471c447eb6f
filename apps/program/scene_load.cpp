#include <taut/apps/program/particle_methods.hpp>
#include <taut/apps/program/scene.hpp>
#include <taut/apps/program/scene_document.hpp>
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <map>

namespace taut {
namespace {

void read_time(Section const& time, Scene& scene) {
  time.allow({"step", "frames", "integrator"});
  constexpr std::array<std::string_view, 3> schemes{"implicit_euler", "bdf2", "quasi_static"};
  std::string const scheme = time.choice("integrator", schemes, "implicit_euler");
  for (std::size_t i = 0; i < schemes.size(); ++i)
    if (schemes[i] == scheme) scene.scheme = static_cast<TimeScheme>(i);
  scene.step = time.number("step", {.min = 0, .max = 1e6, .open_min = true, .unit = "s"});
  scene.frames = time.integer("frames", {.min = 1, .max = 1e9, .unit = "time steps"});
}

OutputOptions read_output(Section const& section) {
  section.allow({"every", "obj", "vdb", "check"});
  OutputOptions output;
  output.every = section.integer("every", {.min = 1, .max = 1e9, .unit = "frames"}, output.every);
  output.obj = section.flag("obj", output.obj);
  output.vdb = section.flag("vdb", output.vdb);
  output.check = section.flag("check", output.check);
  return output;
}

Sweep read_sweep(Section const& section) {
  section.allow({"key", "values"});
  Sweep sweep{section.text("key"), {}};
  std::string const path = section.path("values");
  for (SceneValue const& value : read_list(section.at("values"), path))
    sweep.values.push_back(read_number(value, path, any_number));
  if (sweep.values.empty()) throw Error("{}.values is empty: give at least one", section.where());
  return sweep;
}

/// Copies have names that the file does not show, and results name objects and obstacles alike.
void require_own_names(Scene const& scene) {
  std::map<std::string_view, std::string_view> taken;  // by whom
  auto const take = [&](std::string const& name, std::string const& where) {
    auto const [other, is_new] = taken.emplace(name, where);
    if (!is_new)
      throw Error("{}: the name '{}' is taken by {}: give it a name of its own", where, name,
                  other->second);
  };
  for (SceneObject const& object : scene.objects) take(object.name, object.where);
  for (SceneObstacle const& obstacle : scene.obstacles) take(obstacle.name, obstacle.where);
}

void warn_of_resolution(Scene& scene) {
  auto const is_shape = [](auto const& part) {
    return std::holds_alternative<ProceduralShape>(part.geometry);
  };
  if (scene.resolution == 1 || std::any_of(scene.objects.begin(), scene.objects.end(), is_shape) ||
      std::any_of(scene.obstacles.begin(), scene.obstacles.end(), is_shape))
    return;
  scene.warnings.push_back(
      fmt::format("{}: resolution = {} changes nothing: all meshes of the scene are files",
                  scene.file.string(), scene.resolution));
}

/// What scenes of all kinds have at their end.
void read_rest(Section const& root, Scene& scene) {
  if (auto const solver = root.section("solver")) scene.solver = SolverOptions(*solver);
  if (auto const output = root.section("output")) scene.output = read_output(*output);
  if (auto const sweep = root.section("sweep")) scene.sweep = read_sweep(*sweep);
  if (scene.output.vdb && !scene.particles)
    throw Error(
        "{}: output.vdb writes the grid of material points, and a scene of meshes has none: leave "
        "it out, or use output.obj",
        root.at("output").place);
}

/// A scene with a table [grid].
Scene resolve_particles(Section const& root, Scene scene) {
  for (char const* key : {"obstacle", "pin", "force", "contact"}) {
    SceneValue const* found = root.find(key);
    if (found == nullptr) continue;
    throw Error(
        "{}: {} is for meshes, and this scene has a [grid], which makes its objects material "
        "points: use [[boundary]], or leave [grid] out",
        found->place, key);
  }
  if (scene.scheme != TimeScheme::implicit_euler)
    throw Error(
        "{}: time.integrator: material points are stepped by implicit_euler alone: their grid has "
        "no past; leave the key out",
        root.at("time").place);
  scene.particles = read_particle_scene(root, scene);
  read_rest(root, scene);
  auto const solver = root.section("solver");
  // One cycle per iteration answers to stiffness: L-BFGS learns the rest.
  if (!solver || solver->find("method") == nullptr) scene.solver.set("method", "lbfgs");
  std::string const& precision = scene.solver.text("precision");
  if (precision != "fp64")
    throw Error(
        "{}: solver.precision = \"{}\" is compiled for meshes alone: material points take fp64",
        root.place(), precision);
  if (solver) refuse_without_effect(*solver, scene.solver);
  return scene;
}

/// It names the folder of the result and stands in tables.
std::string read_name(Section const& root, std::filesystem::path const& file) {
  std::string const name = root.text("name", file.stem().string());
  bool const odd = std::any_of(name.begin(), name.end(), [](unsigned char c) {
    return c == '/' || c == '\\' || c < 0x20 || c == 0x7f;
  });
  if (odd || name.empty() || name == "." || name == "..")
    throw Error("{}: name is '{}', which cannot be the name of a folder: choose another",
                root.place(), name);
  return name;
}

Scene resolve(SceneValue const& document, std::filesystem::path const& file) {
  Section const root(document, "");
  root.allow({"name", "description", "base", "gravity", "resolution", "time", "object", "obstacle",
              "pin", "force", "contact", "solver", "output", "small", "sweep", "grid", "boundary",
              "source"});
  Scene scene;
  scene.file = file;
  scene.name = read_name(root, file);
  scene.description = root.text("description", "");
  scene.gravity = root.point("gravity", "m/s^2", scene.gravity);
  scene.resolution =
      root.number("resolution", {.min = 0, .max = 1e3, .open_min = true}, scene.resolution);
  read_time(Section(root.at("time"), "time"), scene);
  if (root.find("grid") != nullptr) return resolve_particles(root, std::move(scene));
  if (SceneValue const* boundary = root.find("boundary"))
    throw Error(
        "{}: a [[boundary]] holds the nodes of a grid, which a scene of meshes does not have: add "
        "a table [grid], or make it an [[obstacle]]",
        boundary->place);
  if (SceneValue const* source = root.find("source"))
    throw Error(
        "{}: a [[source]] lets out material points, which a scene of meshes does not have: add a "
        "table [grid], or leave it out",
        source->place);
  for (Section const& object : root.list("object"))
    for (SceneObject& copy : read_object(object, scene)) scene.objects.push_back(std::move(copy));
  if (scene.objects.empty())
    throw Error("{}: the scene has no objects: add an [[object]]", root.place());
  for (Section const& obstacle : root.list("obstacle"))
    scene.obstacles.push_back(read_obstacle(obstacle, scene));
  require_own_names(scene);
  warn_of_resolution(scene);
  for (Section const& pin : root.list("pin")) scene.pins.push_back(read_pin(pin, scene));
  for (Section const& force : root.list("force")) scene.forces.push_back(read_force(force, scene));
  if (auto const contact = root.section("contact")) scene.contact = ContactOptions(*contact);
  read_rest(root, scene);
  return scene;
}

}  // namespace

Scene load_scene(std::filesystem::path const& file, SceneChanges const& changes) {
  SceneValue document = read_document(file);
  SceneValue other = document;
  apply_small(changes.small ? document : other);
  for (std::string const& assignment : changes.overrides) {
    apply_override(document, assignment);
    apply_override(other, assignment);
  }
  resolve(other, file);
  Scene scene = resolve(document, file);
  if (scene.sweep)
    for (double const value : scene.sweep->values) {
      SceneValue member = document;
      apply_override(member, fmt::format("{}={}", scene.sweep->key, value));
      resolve(member, file);
    }
  return scene;
}

SceneTitle read_scene_title(std::filesystem::path const& file) {
  SceneValue const document = read_document(file);
  Section const root(document, "");
  return {root.text("name", file.stem().string()), root.text("description", "")};
}

}  // namespace taut
