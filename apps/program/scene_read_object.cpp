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
  MaterialParameters material;
  material.model =
      section.choice("model", model_names(), base ? base->model : "stable_neo_hookean");
  read_elasticity(section, material, base);
  return material;
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

void read_elasticity(Section const& section, MaterialParameters& material,
                     MaterialParameters const* base) {
  auto const read = [&](char const* key, double MaterialParameters::*member, Range const& range) {
    material.*member =
        section.number(key, range, base ? std::optional<double>(base->*member) : std::nullopt);
  };
  read("young", &MaterialParameters::young,
       {.min = 0, .max = 1e15, .open_min = true, .unit = "Pa"});
  read("poisson", &MaterialParameters::poisson,
       {.min = -1, .max = 0.5, .open_min = true, .open_max = true});
  read("density", &MaterialParameters::density,
       {.min = 0, .max = 1e9, .open_min = true, .unit = "kg/m^3"});
  // Its bulk modulus is lambda - mu / 3.
  if (material.model == "stable_neo_hookean" && material.poisson <= 0.125)
    throw Error(
        "{}.poisson is {}: stable_neo_hookean has no stable rest state at or below 0.125: use "
        "model = \"stable_neo_hookean_2018\"",
        section.where(), material.poisson);
}

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

/// copies = { count = [nx, ny, nz], step = [dx, dy, dz] }: a block of them, the first where the
/// object itself is, numbered along x first.
Copies read_copies(Section const& object) {
  auto const copies = object.section("copies");
  if (!copies) return {};
  copies->allow({"count", "step"});
  std::string const path = copies->path("count");
  SceneValue::List const& list = read_list(copies->at("count"), path);
  if (list.size() != 3)
    throw Error("{}: {} is a list of {}: it must be a list of three whole numbers",
                copies->at("count").place, path, list.size());
  constexpr double most = 1e5;
  std::array<std::int64_t, 3> count{};
  double all = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    count[a] = read_integer(list[a], fmt::format("{}[{}]", path, a),
                            {.min = 1, .max = most, .unit = "copies"});
    all *= static_cast<double>(count[a]);
  }
  if (all > most)
    throw Error("{}: {} asks for {} copies: it must be at most {}", copies->at("count").place, path,
                all, most);
  Point const step = copies->point("step", "m");
  for (std::size_t a = 0; a < 3; ++a)
    if (count[a] > 1 && step[a] == 0)
      throw Error("{}: {} is 0 along {}, where there are {} copies: give the way between two",
                  copies->at("step").place, copies->path("step"), "xyz"[a], count[a]);

  Copies block{{}, true};
  for (std::int64_t k = 0; k < count[2]; ++k)
    for (std::int64_t j = 0; j < count[1]; ++j)
      for (std::int64_t i = 0; i < count[0]; ++i)
        block.ways.push_back({static_cast<double>(i) * step[0], static_cast<double>(j) * step[1],
                              static_cast<double>(k) * step[2]});
  return block;
}

std::vector<SceneObject> read_object(Section const& section, Scene const& scene) {
  section.allow({"name", "shape", "mesh", "scale", "rotate", "translate", "copies", "velocity",
                 "material", "region", "start"});
  SceneObject object;
  object.where = section.where();
  object.name = object.copy_of = section.text("name");
  if (has_shape(section))
    object.geometry = read_shape(*section.section("shape"), scene.resolution, ShapeOf::object);
  else
    object.geometry = find_data(section.at("mesh"), section.path("mesh"), scene.file);
  object.scale = read_scale(section);
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
  return copies_of(object, section);
}

}  // namespace taut
