#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>

namespace taut {
namespace {

std::vector<std::string_view> model_names() {
  std::vector<std::string_view> names;
  for (MaterialModel const& model : material_models()) names.push_back(model.name);
  return names;
}

/// `base` gives the keys that are left out; without it all but the model are required.
MaterialParameters read_material(Section const& section, MaterialParameters const* base) {
  section.allow({"model", "young", "poisson", "density"});
  auto const inherited = [&](double MaterialParameters::*member) {
    return base ? std::optional<double>(base->*member) : std::nullopt;
  };
  MaterialParameters material;
  material.model =
      section.choice("model", model_names(), base ? base->model : "stable_neo_hookean");
  material.young = section.number("young", {.min = 0, .max = 1e15, .open_min = true, .unit = "Pa"},
                                  inherited(&MaterialParameters::young));
  material.poisson =
      section.number("poisson", {.min = -1, .max = 0.5, .open_min = true, .open_max = true},
                     inherited(&MaterialParameters::poisson));
  material.density =
      section.number("density", {.min = 0, .max = 1e9, .open_min = true, .unit = "kg/m^3"},
                     inherited(&MaterialParameters::density));
  // Its bulk modulus is lambda - mu / 3.
  if (material.model == "stable_neo_hookean" && material.poisson <= 0.125)
    throw Error(
        "{}.poisson is {}: stable_neo_hookean has no stable rest state at or below 0.125: use "
        "model = \"stable_neo_hookean_2018\"",
        section.where(), material.poisson);
  return material;
}

Shape read_shape_kind(Section const& s) {
  constexpr std::array<std::string_view, 9> kinds{"box",      "beam", "sheet",  "boxes", "letter_e",
                                                  "cylinder", "rod",  "sphere", "torus"};
  std::string const kind = s.choice("kind", kinds);
  auto const allow = [&](std::vector<std::string_view> keys) {
    keys.insert(keys.end(), {"kind", "resolution"});
    s.allow(keys);
  };
  auto const length = [&](std::string_view key) { return s.number(key, length_range); };
  if (kind == "box") {
    allow({"size"});
    Point const size = s.point("size", "m");
    for (double const edge : size)
      if (!length_range.contains(edge))
        throw Error("{}: {} has an edge of {} m: it must be {}", s.at("size").place, s.path("size"),
                    edge, length_range.describe());
    return BoxShape{size};
  }
  if (kind == "beam") {
    allow({"length", "height", "width"});
    return BoxShape{{length("length"), length("height"), length("width")}};
  }
  if (kind == "sheet") {
    allow({"length", "width", "thickness"});
    return BoxShape{{length("length"), length("thickness"), length("width")}};
  }
  if (kind == "boxes") {
    allow({"boxes"});
    BoxUnionShape shape;
    for (SceneValue const& box : read_list(s.at("boxes"), s.path("boxes")))
      shape.boxes.push_back(
          read_box(box, fmt::format("{}[{}]", s.path("boxes"), shape.boxes.size())));
    return shape;
  }
  if (kind == "letter_e") {
    allow({"height", "depth"});
    double const height = s.number("height", length_range, LetterEShape{}.height);
    return LetterEShape{height, s.number("depth", length_range, height / 1.125)};
  }
  if (kind == "cylinder") {
    allow({"radius", "height"});
    return CylinderShape{length("radius"), length("height"), 1};
  }
  if (kind == "rod") {
    allow({"radius", "length"});
    return CylinderShape{length("radius"), length("length"), 0};
  }
  if (kind == "sphere") {
    allow({"radius"});
    return SphereShape{length("radius")};
  }
  allow({"radius", "tube_radius"});
  return TorusShape{length("radius"), length("tube_radius")};
}

ProceduralShape read_shape(Section const& section) {
  Shape const shape = read_shape_kind(section);
  return {shape, section.integer("resolution", {.min = 1, .max = 1e6, .unit = "cells"})};
}

InitialVelocity read_velocity(Section const& section) {
  section.allow({"linear", "axis", "centre", "angular_velocity", "twist_length"});
  InitialVelocity velocity;
  velocity.linear = section.point("linear", "m/s", velocity.linear);
  velocity.axis = section.direction("axis", velocity.axis);
  velocity.centre = section.point("centre", "m", velocity.centre);
  velocity.angular_velocity =
      radians(section.number("angular_velocity", {.min = -1e9, .max = 1e9, .unit = "deg/s"}, 0.0));
  if (section.find("twist_length"))
    velocity.twist_length = section.number("twist_length", length_range);
  return velocity;
}

/// start = "rest" | "flat" | "random", or a table whose `kind` is one of them.
Start read_start(Section const& object) {
  constexpr std::array<std::string_view, 3> kinds{"rest", "flat", "random"};
  SceneValue const* value = object.find("start");
  if (value == nullptr) return {};
  std::string const path = object.path("start");
  SceneValue::Table const word{{"kind", *value}};
  bool const is_word = std::holds_alternative<std::string>(value->value);
  SceneValue const table = is_word ? SceneValue{value->place, word} : *value;
  Section const section(table, path);
  std::string const kind = read_choice(section.at("kind"), is_word ? path : path + ".kind", kinds);
  if (kind == "flat") {
    section.allow({"kind", "normal", "point"});
    StartFlat flat;
    flat.normal = section.direction("normal", flat.normal);
    if (section.find("point")) flat.point = section.point("point", "m");
    return flat;
  }
  if (kind == "random") {
    section.allow({"kind", "seed", "box"});
    StartRandom random;
    random.seed = section.integer("seed", {.min = 0, .max = 1e9}, random.seed);
    if (section.find("box")) random.box = read_box(section.at("box"), section.path("box"));
    return random;
  }
  section.allow({"kind"});
  return {};
}

RigidMap read_placement(Section const& object) {
  RigidMap placement;
  if (auto const rotate = object.section("rotate")) {
    rotate->allow({"axis", "angle"});
    placement = rotation_about(
        rotate->direction("axis"),
        radians(rotate->number("angle", {.min = -1e6, .max = 1e6, .unit = "deg"})), {});
  }
  placement.translation = object.point("translate", "m", Point{});
  return placement;
}

/// A body that starts collapsed passes through J <= 0, which not every model is defined for.
void require_start_allowed(SceneObject const& object) {
  if (std::holds_alternative<std::monostate>(object.start)) return;
  auto const check = [&](MaterialParameters const& material) {
    for (MaterialModel const& model : material_models())
      if (model.name == material.model && !model.allows_inversion)
        throw Error(
            "{}: {} is undefined for the collapsed tets of start = \"flat\" or \"random\": "
            "use stable_neo_hookean",
            object.where, model.name);
  };
  check(object.material);
  for (SceneRegion const& region : object.regions) check(region.material);
}

}  // namespace

std::span<MaterialModel const> material_models() {
  static constexpr std::array<MaterialModel, 5> models{
      {{"stable_neo_hookean", true,
        "as in the PNCG paper: cheapest; nu above 1/8; softer in volume than its nu says "
        "(default)"},
       {"stable_neo_hookean_2018", true, "Smith et al. 2018: nominal moduli at small strain"},
       {"neo_hookean", false, "with a logarithm of J, which no step may bring to zero"},
       {"fixed_corotated", true, "Stomakhin et al. 2012: needs the rotation of F"},
       {"arap", true, "as rigid as possible: mu alone, Poisson's ratio has no effect"}}};
  return models;
}

SceneObject read_object(Section const& section, Scene& scene) {
  section.allow({"name", "shape", "mesh", "scale", "rotate", "translate", "velocity", "material",
                 "region", "start"});
  SceneObject object;
  object.where = section.where();
  object.name = section.text("name");
  auto const shape = section.section("shape");
  SceneValue const* mesh = section.find("mesh");
  if (shape.has_value() == (mesh != nullptr))
    throw Error("{} has {}: give either a shape or a mesh", section.where(),
                mesh ? "both a shape and a mesh" : "no geometry");
  if (shape)
    object.geometry = read_shape(*shape);
  else
    object.geometry = find_data(*mesh, section.path("mesh"), scene.file);
  object.scale = section.number("scale", {.min = 1e-9, .max = 1e9}, 1.0);
  object.placement = read_placement(section);
  if (auto const velocity = section.section("velocity")) object.velocity = read_velocity(*velocity);
  Section const material(section.at("material"), section.path("material"));
  object.material = read_material(material, nullptr);
  for (Section const& region : section.list("region")) {
    region.allow({"name", "select", "material"});
    Section const changed(region.at("material"), region.path("material"));
    object.regions.push_back({region.where(), read_selection(region, scene.file),
                              read_material(changed, &object.material)});
  }
  object.start = read_start(section);
  require_start_allowed(object);
  return object;
}

}  // namespace taut
