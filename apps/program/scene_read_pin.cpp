#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

#include <cstdlib>
#include <numbers>

namespace taut {
namespace {

/// Indices of the objects meant: the one named by the key `object`, all copies of what it names, or
/// all without that key.
std::vector<std::size_t> read_objects(Section const& section, Scene const& scene) {
  std::vector<std::string_view> names;
  for (SceneObject const& object : scene.objects) {
    if (names.empty() || names.back() != object.copy_of) names.push_back(object.copy_of);
    if (object.name != object.copy_of) names.push_back(object.name);
  }
  std::optional<std::string> name;
  if (section.find("object")) name = section.choice("object", names);
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (!name || scene.objects[i].copy_of == *name || scene.objects[i].name == *name)
      indices.push_back(i);
  return indices;
}

Selector read_side(Section const& section, std::optional<double> within) {
  constexpr std::array<std::string_view, 6> sides{"x_min", "x_max", "y_min",
                                                  "y_max", "z_min", "z_max"};
  std::string const side = section.choice("side", sides);
  return SelectSide{static_cast<std::size_t>(side[0] - 'x'),
                    side == "x_max" || side == "y_max" || side == "z_max", within};
}

Selector read_selector(SceneValue const& value, std::string const& path,
                       std::filesystem::path const& scene_file) {
  if (std::holds_alternative<std::string>(value.value)) {
    constexpr std::array<std::string_view, 1> words{"all"};
    read_choice(value, path, words);
    return SelectAll{};
  }
  Section const section(value, path);
  section.allow({"box", "plane", "sphere", "side", "mask", "within"});
  int kinds = 0;
  for (std::string_view const kind : {"box", "plane", "sphere", "side", "mask"})
    if (section.find(kind)) ++kinds;
  if (kinds != 1)
    throw Error(
        "{} has {} of the keys box, plane, sphere, side, mask: give one, and a list of "
        "tables for a union",
        section.where(), kinds);
  std::optional<double> within;
  if (section.find("within")) {
    if (!section.find("plane") && !section.find("side"))
      throw Error("{}.within has no meaning here: only plane and side have a distance",
                  section.where());
    within = section.number("within", {.min = 0, .max = 1e9, .unit = "m"});
  }
  if (SceneValue const* box = section.find("box")) {
    auto const [low, high] = read_box(*box, section.path("box"));
    return SelectBox{low, high};
  }
  if (auto const plane = section.section("plane")) {
    plane->allow({"point", "normal"});
    return SelectPlane{plane->point("point", "m"), plane->direction("normal"), within};
  }
  if (auto const sphere = section.section("sphere")) {
    sphere->allow({"centre", "radius"});
    return SelectSphere{sphere->point("centre", "m"), sphere->number("radius", length_range)};
  }
  if (section.find("side")) return read_side(section, within);
  return SelectMask{find_data(section.at("mask"), section.path("mask"), scene_file)};
}

}  // namespace

Window read_window(Section const& section) {
  Window window;
  window.start = section.number("start", time_range, 0.0);
  if (section.find("end"))
    window.end = section.number(
        "end", {.min = window.start, .max = time_range.max, .open_min = true, .unit = "s"});
  return window;
}

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

std::filesystem::path find_data(SceneValue const& value, std::string_view path,
                                std::filesystem::path const& scene_file) {
  std::filesystem::path const name = read_text(value, path);
  std::error_code ignored;
  std::filesystem::path const beside = scene_file.parent_path() / name;
  if (std::filesystem::is_regular_file(beside, ignored)) return beside;
  char const* data = std::getenv("TAUT_DATA_DIR");
  if (data == nullptr)
    throw Error(
        "{}: {}: there is no file '{}': set the environment variable TAUT_DATA_DIR to the "
        "folder to look in as well",
        value.place, path, beside.string());
  std::filesystem::path const shared = std::filesystem::path(data) / name;
  if (std::filesystem::is_regular_file(shared, ignored)) return shared;
  throw Error("{}: {}: there is neither a file '{}' nor, by TAUT_DATA_DIR, '{}': correct the path",
              value.place, path, beside.string(), shared.string());
}

Selection read_selection(Section const& parent, std::filesystem::path const& scene_file) {
  SceneValue const& value = parent.at("select");
  std::string const path = parent.path("select");
  Selection selection;
  if (auto const* list = std::get_if<SceneValue::List>(&value.value)) {
    for (SceneValue const& entry : *list)
      selection.push_back(
          read_selector(entry, fmt::format("{}[{}]", path, selection.size()), scene_file));
  } else {
    selection.push_back(read_selector(value, path, scene_file));
  }
  return selection;
}

ScenePin read_pin(Section const& section, Scene const& scene) {
  section.allow({"name", "object", "select", "release", "motion"});
  ScenePin pin;
  pin.where = section.where();
  pin.name = section.path();
  pin.objects = read_objects(section, scene);
  pin.selection = read_selection(section, scene.file);
  if (section.find("release"))
    pin.window.end =
        section.number("release", {.min = 0, .max = time_range.max, .open_min = true, .unit = "s"});
  pin.motion = read_motion(section);
  return pin;
}

SceneForce read_force(Section const& section, Scene const& scene) {
  section.allow(
      {"name", "object", "select", "per_vertex", "total", "acceleration", "start", "end"});
  SceneForce force;
  force.where = section.where();
  force.objects = read_objects(section, scene);
  force.selection =
      section.find("select") ? read_selection(section, scene.file) : Selection{SelectAll{}};
  int kinds = 0;
  auto const read = [&](std::string_view key, SceneForce::Kind kind, std::string_view unit) {
    if (!section.find(key)) return;
    ++kinds;
    force.kind = kind;
    force.value = section.point(key, unit);
  };
  read("per_vertex", SceneForce::Kind::per_vertex, "N");
  read("total", SceneForce::Kind::total, "N");
  read("acceleration", SceneForce::Kind::acceleration, "m/s^2");
  if (kinds != 1)
    throw Error("{} has {} of the keys per_vertex, total, acceleration: give one", section.where(),
                kinds);
  force.window = read_window(section);
  return force;
}

}  // namespace taut
