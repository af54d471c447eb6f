// [[obstacle]]: what bodies touch and what is not simulated.
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>

namespace taut {
namespace {

using Geometry = decltype(SceneObstacle::geometry);

/// Kinds that a body can be inside of.
constexpr std::array<std::string_view, 3> hollow_kinds{"box", "sphere", "cylinder"};

Geometry read_inside(Section const& shape, std::string const& kind, double scale) {
  if (shape.find("resolution"))
    throw Error("{}: {} has no resolution: with inside = true it is no mesh, leave the key out",
                shape.at("resolution").place, shape.path());
  auto const length = [&](std::string_view key) { return scale * shape.number(key, length_range); };
  if (kind == "box") {
    shape.allow({"kind", "inside", "size"});
    Point size = shape.point("size", "m");
    for (double& edge : size) {
      if (!length_range.contains(edge))
        throw Error("{}: {} has an edge of {} m: it must be {}", shape.at("size").place,
                    shape.path("size"), edge, length_range.describe());
      edge *= scale;
    }
    return InsideBoxShape{size};
  }
  if (kind == "sphere") {
    shape.allow({"kind", "inside", "radius"});
    return InsideSphereShape{length("radius")};
  }
  shape.allow({"kind", "inside", "radius", "height"});
  return InsideCylinderShape{length("radius"), length("height")};
}

/// In the frame of the obstacle.
Geometry read_geometry(Section const& shape, SceneObstacle const& obstacle, Scene const& scene) {
  SceneValue const* kind_value = shape.find("kind");
  bool const is_text = kind_value && std::holds_alternative<std::string>(kind_value->value);
  std::string const kind = is_text ? std::get<std::string>(kind_value->value) : "";
  if (kind == "half_space") {
    shape.allow({"kind", "point", "normal"});
    return HalfSpaceShape{obstacle.scale * shape.point("point", "m", Point{}),
                          shape.direction("normal", HalfSpaceShape{}.normal)};
  }
  if (!shape.flag("inside", false)) return read_shape(shape, scene.resolution, ShapeOf::obstacle);
  return read_inside(shape, shape.choice("kind", hollow_kinds), obstacle.scale);
}

}  // namespace

SceneObstacle read_obstacle(Section const& section, Scene const& scene) {
  section.allow({"name", "shape", "mesh", "scale", "rotate", "translate", "motion", "friction"});
  SceneObstacle obstacle;
  obstacle.where = section.where();
  obstacle.name = section.text("name");
  obstacle.scale = read_scale(section);
  obstacle.placement = read_placement(section);
  if (has_shape(section))
    obstacle.geometry = read_geometry(*section.section("shape"), obstacle, scene);
  else
    obstacle.geometry = find_data(section.at("mesh"), section.path("mesh"), scene.file);
  obstacle.motion = read_motion(section);
  if (section.find("friction"))
    obstacle.friction = section.number("friction", {.min = 0, .max = 100});
  return obstacle;
}

}  // namespace taut
