// [grid], [[object]], [[source]] and [[boundary]] of a scene of material points.
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>
#include <taut/materials/granular.hpp>
#include <taut/materials/von_mises.hpp>

#include <algorithm>
#include <array>

namespace taut {
namespace {

constexpr std::array<std::string_view, 5> kinds{
    "none", VonMises::name, VonMisesFixedCorotated::name, SnowClamp::name, DruckerPrager::name};

/// In the frame of its owner; what has a mesh elsewhere has none here, and no resolution.
Shape read_shape_without_mesh(Section const& s, double scale,
                              std::vector<std::string_view> keys = {}) {
  std::vector<std::string_view> const shapes{"box",      "beam", "sheet", "sphere",
                                             "cylinder", "rod",  "torus"};
  if (s.find("resolution"))
    throw Error(
        "{}: {}.resolution: material points have that of the grid (grid.spacing): leave "
        "the key out",
        s.at("resolution").place, s.path());
  keys.insert(keys.begin(), "kind");
  Shape const shape = *read_solid(s, s.choice("kind", shapes), keys, scale);
  auto const* torus = std::get_if<TorusShape>(&shape);
  if (torus && !(torus->tube_radius < torus->radius))
    throw Error("{}: {}.tube_radius is {} m: it must be below the radius, {} m",
                s.at("tube_radius").place, s.path(), torus->tube_radius, torus->radius);
  return shape;
}

Plasticity read_plasticity(Section const& s) {
  Plasticity p;
  p.kind = s.choice("kind", kinds);
  auto const stress = [&](std::string_view key, std::optional<double> fallback = {}) {
    return s.number(key, {.min = 0, .max = 1e15, .open_min = !fallback, .unit = "Pa"}, fallback);
  };
  if (p.kind == VonMises::name) {
    s.allow({"kind", "yield_stress", "hardening"});
    p.yield_stress = stress("yield_stress");
    p.hardening = stress("hardening", 0);
  } else if (p.kind == VonMisesFixedCorotated::name) {
    s.allow({"kind", "yield_stress"});
    p.yield_stress = stress("yield_stress");
  } else if (p.kind == SnowClamp::name) {
    s.allow({"kind", "compression", "stretch", "hardening", "least", "most"});
    SnowClamp const snow;
    Range const share{.min = 0, .max = 1, .open_max = true};
    p.compression = s.number("compression", share, snow.compression);
    p.stretch = s.number("stretch", share, snow.stretch);
    p.hardening = s.number("hardening", {.min = 0, .max = 1e3}, snow.psi);
    p.least = s.number("least", {.min = -1e3, .max = 1}, snow.least);
    p.most = s.number("most", {.min = 1, .max = 1e3}, snow.most);
  } else if (p.kind == DruckerPrager::name) {
    s.allow({"kind", "angle"});
    p.angle = s.number("angle", {.min = 0, .max = 90, .open_max = true, .unit = "deg"},
                       DruckerPrager().angle);
  } else {
    s.allow({"kind"});
  }
  return p;
}

/// The table `material` of a body or a source.
template <class Owner>
void read_material(Section const& s, Owner& owner) {
  s.allow({"model", "young", "poisson", "density", "plasticity"});
  MaterialParameters& m = owner.material;
  m.model = s.choice("model", particle_models(), std::string(particle_models().front()));
  read_elasticity(s, m);
  if (auto const plasticity = s.section("plasticity")) {
    owner.plasticity = read_plasticity(*plasticity);
  }
}

std::filesystem::path read_file_name(Section const& s, Scene const& scene) {
  std::filesystem::path const file = find_data(s.at("mesh"), s.path("mesh"), scene.file);
  if (file.extension() != ".obj" && file.extension() != ".vdb")
    throw Error("{}: {} is {}: material points fill a closed surface, .obj, or a level set, .vdb",
                s.at("mesh").place, s.path("mesh"), file.string());
  return file;
}

StartStretched read_start(Section const& s) {
  s.allow({"kind", "between", "seed"});
  constexpr std::array<std::string_view, 1> names{"stretched"};
  s.choice("kind", names);
  std::string const path = s.path("between");
  SceneValue::List const& list = read_list(s.at("between"), path);
  Range const factor{.min = 0, .max = 100, .open_min = true};
  if (list.size() != 2)
    throw Error("{}: {} is a list of {}: give the least and the most factor", s.at("between").place,
                path, list.size());
  StartStretched const start{read_number(list[0], path + "[0]", factor),
                             read_number(list[1], path + "[1]", factor),
                             s.integer("seed", {.min = 0, .max = 1e9}, 1)};
  if (start.least > start.most)
    throw Error("{}: {} begins at {} and ends at {}: give the smaller first", s.at("between").place,
                path, start.least, start.most);
  return start;
}

std::vector<SceneBody> read_body(Section const& s, Scene const& scene, double per_cell) {
  s.allow({"name", "shape", "mesh", "scale", "rotate", "translate", "copies", "velocity",
           "material", "per_cell", "max_holes", "start", "without"});
  SceneBody body;
  body.where = s.where();
  body.name = s.text("name");
  body.scale = read_scale(s);
  body.placement = read_placement(s);
  if (has_shape(s)) {
    body.geometry = read_shape_without_mesh(*s.section("shape"), 1);
  } else {
    body.geometry = read_file_name(s, scene);
  }
  if (auto const velocity = s.section("velocity")) body.velocity = read_velocity(*velocity);
  read_material(Section(s.at("material"), s.path("material")), body);
  body.per_cell = s.number("per_cell", {.min = 0, .max = 1e3, .open_min = true}, per_cell);
  body.max_holes = s.number("max_holes", {.min = 0, .max = 1}, 0.0);
  if (SceneValue const* names = s.find("without"))
    for (SceneValue const& name : read_list(*names, s.path("without")))
      body.without.push_back(read_text(name, s.path("without")));
  if (auto const start = s.section("start")) body.start = read_start(*start);
  return copies_of(body, s);
}

void read_boundary_shape(Section const& s, Scene const& scene, SceneBoundary& boundary) {
  double const scale = read_scale(s);
  boundary.max_holes = s.number("max_holes", {.min = 0, .max = 1}, 0.0);
  if (!has_shape(s)) {
    boundary.shape = read_file_name(s, scene);
    boundary.scale = scale;
    return;
  }
  Section const shape(s.at("shape"), s.path("shape"));
  SceneValue const* kind = shape.find("kind");
  auto const* word = kind ? std::get_if<std::string>(&kind->value) : nullptr;
  if (word && *word == "half_space") {
    shape.allow({"kind", "point", "normal"});
    boundary.shape = HalfSpaceShape{scale * shape.point("point", "m", Point{}),
                                    shape.direction("normal", HalfSpaceShape{}.normal)};
  } else {
    boundary.inside = shape.flag("inside", false);
    boundary.shape = read_shape_without_mesh(shape, scale, {"inside"});
  }
}

SceneSource read_source(Section const& s, double per_cell) {
  s.allow({"name", "shape", "rotate", "translate", "motion", "velocity", "material", "per_cell",
           "start", "end"});
  SceneSource source;
  source.where = s.where();
  source.name = s.text("name");
  source.placement = read_placement(s);
  source.shape = read_shape_without_mesh(Section(s.at("shape"), s.path("shape")), 1);
  if (std::holds_alternative<TorusShape>(source.shape))
    throw Error(
        "{}.shape is a torus, which what leaves it on one side enters on the other: take a box, a "
        "sphere or a cylinder",
        source.where);
  source.motion = read_motion(s);
  source.velocity = s.point("velocity", "m/s");
  if (!(norm(source.velocity) > 0))
    throw Error("{}: {} is 0: nothing would come out; give the velocity of the flow in m/s",
                s.at("velocity").place, s.path("velocity"));
  read_material(Section(s.at("material"), s.path("material")), source);
  source.per_cell = s.number("per_cell", {.min = 0, .max = 1e3, .open_min = true}, per_cell);
  source.window = read_window(s);
  return source;
}

SceneBoundary read_boundary(Section const& s, Scene const& scene) {
  s.allow({"name", "shape", "mesh", "max_holes", "scale", "rotate", "translate", "motion",
           "contact", "friction", "release"});
  SceneBoundary boundary;
  boundary.where = s.where();
  boundary.name = s.text("name");
  boundary.placement = read_placement(s);
  read_boundary_shape(s, scene, boundary);
  boundary.motion = read_motion(s);
  if (s.find("release")) {
    boundary.release = s.number("release", time_range);
    if (boundary.inside || std::holds_alternative<HalfSpaceShape>(boundary.shape))
      throw Error("{}: {}: {} cannot be released: use a box, or leave the key out",
                  s.at("release").place, s.path("release"),
                  boundary.inside ? "a boundary that bodies are in" : "a half space");
  }
  constexpr std::array<std::string_view, 3> laws{"stick", "slip", "separate"};
  std::string const law = s.choice("contact", laws, "stick");
  for (std::size_t k = 0; k < laws.size(); ++k)
    if (laws[k] == law) boundary.law = static_cast<BoundaryLaw>(k);
  boundary.friction = s.number("friction", {.min = 0, .max = 100}, 0.0);
  if (boundary.friction > 0 && boundary.law == BoundaryLaw::stick)
    throw Error("{}: {} is {} where contact = \"stick\" holds everything: choose slip or separate",
                s.at("friction").place, s.path("friction"), boundary.friction);
  return boundary;
}

void require_own_names(ParticleScene const& scene) {
  std::vector<std::pair<std::string_view, std::string_view>> taken;  // name, by whom
  auto const take = [&](std::string const& name, std::string const& where) {
    for (auto const& [other, by] : taken)
      if (other == name)
        throw Error("{}: the name '{}' is taken by {}: give it a name of its own", where, name, by);
    taken.emplace_back(name, where);
  };
  for (SceneBody const& body : scene.bodies) take(body.name, body.where);
  for (SceneSource const& source : scene.sources) take(source.name, source.where);
  for (SceneBoundary const& boundary : scene.boundaries) take(boundary.name, boundary.where);
}

}  // namespace

std::span<std::string_view const> plasticity_kinds() { return kinds; }

ParticleScene read_particle_scene(Section const& root, Scene const& scene) {
  Section const grid(root.at("grid"), "grid");
  grid.allow({"spacing", "kernel", "transfer", "flip", "per_cell", "ghost_penalty", "cfl",
              "crossing", "longest_step", "time_error", "halvings", "seed", "check_overlap"});
  ParticleScene p;
  p.spacing = grid.number("spacing", length_range) / scene.resolution;
  constexpr std::array<std::string_view, 1> kernels{"quadratic"};
  grid.choice("kernel", kernels, "quadratic");
  constexpr std::array<std::string_view, 3> transfers{"apic", "rpic", "flip"};
  p.transfer = grid.choice("transfer", transfers, p.transfer);
  p.flip = grid.number("flip", {.min = 0, .max = 1}, p.flip);
  if (grid.find("flip") && p.transfer != "flip")
    throw Error(
        "{}: {} has no effect where transfer = \"{}\": leave it out, or use transfer = "
        "\"flip\"",
        grid.at("flip").place, grid.path("flip"), p.transfer);
  double const per_cell = grid.number("per_cell", {.min = 0, .max = 1e3, .open_min = true}, 8.0);
  p.ghost_penalty = grid.number("ghost_penalty", {.min = 0, .max = 1}, p.ghost_penalty);
  p.cfl = grid.number("cfl", {.min = 0, .max = 10, .open_min = true, .unit = "cells"}, p.cfl);
  p.crossing =
      grid.number("crossing", {.min = 0, .max = 10, .open_min = true, .unit = "cells"}, p.crossing);
  if (grid.find("longest_step"))
    p.longest_step =
        grid.number("longest_step", {.min = 0, .max = 1e6, .open_min = true, .unit = "s"});
  if (grid.find("time_error"))
    p.time_error = grid.number("time_error", {.min = 0, .max = 1e6, .open_min = true, .unit = "m"});
  p.halvings = grid.integer("halvings", {.min = 0, .max = 60}, p.halvings);
  p.seed = grid.integer("seed", {.min = 0, .max = 1e9}, p.seed);
  p.check_overlap = grid.flag("check_overlap", p.check_overlap);
  for (Section const& object : root.list("object"))
    for (SceneBody& copy : read_body(object, scene, per_cell)) p.bodies.push_back(std::move(copy));
  for (Section const& source : root.list("source"))
    p.sources.push_back(read_source(source, per_cell));
  if (p.bodies.empty() && p.sources.empty())
    throw Error("{}: the scene has no objects: add an [[object]], or a [[source]]", root.place());
  for (Section const& boundary : root.list("boundary"))
    p.boundaries.push_back(read_boundary(boundary, scene));
  require_own_names(p);
  return p;
}

}  // namespace taut
