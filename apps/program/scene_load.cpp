#include <taut/apps/program/scene.hpp>
#include <taut/apps/program/scene_document.hpp>
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

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
  section.allow({"every", "obj", "check"});
  OutputOptions output;
  output.every = section.integer("every", {.min = 1, .max = 1e9, .unit = "frames"}, output.every);
  output.obj = section.flag("obj", output.obj);
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

Scene resolve(SceneValue const& document, std::filesystem::path const& file) {
  Section const root(document, "");
  root.allow({"name", "description", "base", "gravity", "time", "object", "pin", "force", "contact",
              "solver", "output", "small", "sweep"});
  Scene scene;
  scene.file = file;
  scene.name = root.text("name", file.stem().string());
  scene.description = root.text("description", "");
  scene.gravity = root.point("gravity", "m/s^2", scene.gravity);
  read_time(Section(root.at("time"), "time"), scene);
  for (Section const& object : root.list("object"))
    scene.objects.push_back(read_object(object, scene));
  if (scene.objects.empty())
    throw Error("{}: the scene has no objects: add an [[object]]", root.place());
  for (Section const& pin : root.list("pin")) scene.pins.push_back(read_pin(pin, scene));
  for (Section const& force : root.list("force")) scene.forces.push_back(read_force(force, scene));
  if (auto const solver = root.section("solver")) scene.solver = SolverOptions(*solver);
  if (auto const contact = root.section("contact")) scene.contact = ContactOptions(*contact);
  if (auto const output = root.section("output")) scene.output = read_output(*output);
  if (auto const sweep = root.section("sweep")) scene.sweep = read_sweep(*sweep);
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
