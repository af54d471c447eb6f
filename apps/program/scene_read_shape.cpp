// The geometry of objects and obstacles: shape, place and motion.
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

/// points = [[x, y, z], ...], tets = [[a, b, c, d], ...], which count the points from 0.
TetMesh read_tets(Section const& s) {
  TetMesh mesh;
  std::string const points = s.path("points"), tets = s.path("tets");
  for (SceneValue const& point : read_list(s.at("points"), points))
    mesh.points.push_back(
        read_point(point, fmt::format("{}[{}]", points, mesh.points.size()), "m"));
  for (SceneValue const& entry : read_list(s.at("tets"), tets)) {
    std::string const path = fmt::format("{}[{}]", tets, mesh.tets.size());
    SceneValue::List const& corners = read_list(entry, path);
    if (corners.size() != 4)
      throw Error("{}: {} is a list of {}: a tet is a list of the numbers of four points",
                  entry.place, path, corners.size());
    if (mesh.points.empty())
      throw Error("{}: {} is empty: give the points that the tets name", s.at("points").place,
                  points);
    Tet tet{};
    for (std::size_t a = 0; a < 4; ++a)
      tet[a] = static_cast<std::int32_t>(
          read_integer(corners[a], fmt::format("{}[{}]", path, a),
                       {.min = 0, .max = static_cast<double>(mesh.points.size() - 1)}));
    mesh.tets.push_back(tet);
  }
  return mesh;
}

Shape read_shape_kind(Section const& s, ShapeOf owner) {
  std::vector<std::string_view> kinds{"box", "beam",   "sheet", "boxes", "letter_e", "cylinder",
                                      "rod", "sphere", "torus", "bowl",  "funnel",   "tets"};
  std::vector<std::string_view> common{"kind", "resolution"};
  if (owner == ShapeOf::obstacle) {
    kinds.push_back("half_space");
    common.push_back("inside");
  }
  std::string const kind = s.choice("kind", kinds);
  auto const allow = [&](std::vector<std::string_view> keys) {
    keys.insert(keys.end(), common.begin(), common.end());
    s.allow(keys);
  };
  if (auto const solid = read_solid(s, kind, common)) return *solid;
  auto const length = [&](std::string_view key) { return s.number(key, length_range); };
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
  if (kind == "bowl") {
    allow({"radius", "thickness", "height"});
    return BowlShape{length("radius"), length("thickness"), length("height")};
  }
  if (kind == "funnel") {
    allow({"radius", "throat", "height", "spout", "thickness"});
    return FunnelShape{length("radius"), length("throat"), length("height"), length("spout"),
                       length("thickness")};
  }
  allow({"points", "tets"});
  return TetsShape{read_tets(s)};
}

MotionPhase read_phase(Section const& section) {
  section.allow({"name", "start", "end", "velocity", "axis", "centre", "angular_velocity",
                 "angular_acceleration"});
  MotionPhase phase;
  phase.window = read_window(section);
  phase.velocity = section.point("velocity", "m/s", phase.velocity);
  phase.angular_velocity =
      radians(section.number("angular_velocity", {.min = -1e9, .max = 1e9, .unit = "deg/s"}, 0.0));
  phase.angular_acceleration = radians(
      section.number("angular_acceleration", {.min = -1e9, .max = 1e9, .unit = "deg/s^2"}, 0.0));
  bool const turns = phase.angular_velocity != 0 || phase.angular_acceleration != 0;
  std::optional<Point> const none;
  phase.axis = section.direction("axis", turns ? none : phase.axis);
  phase.centre = section.point("centre", "m", turns ? none : phase.centre);
  return phase;
}

/// The nearest resolution that the shape has to factor * resolution.
int scaled(Shape const& shape, int resolution, double factor) {
  if (factor == 1) return resolution;
  double const unit = resolution_unit(shape);
  return static_cast<int>(unit * std::max(1.0, std::round(factor * resolution / unit)));
}

}  // namespace

std::optional<Shape> read_solid(Section const& s, std::string_view kind,
                                std::vector<std::string_view> const& common, double scale) {
  auto const allow = [&](std::vector<std::string_view> keys) {
    keys.insert(keys.end(), common.begin(), common.end());
    s.allow(keys);
  };
  auto const length = [&](std::string_view key) { return scale * s.number(key, length_range); };
  if (kind == "box") {
    allow({"size"});
    Point size = s.point("size", "m");
    for (double& edge : size) {
      if (!length_range.contains(edge))
        throw Error("{}: {} has an edge of {} m: it must be {}", s.at("size").place, s.path("size"),
                    edge, length_range.describe());
      edge *= scale;
    }
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
  if (kind == "sphere") {
    allow({"radius"});
    return SphereShape{length("radius")};
  }
  if (kind == "cylinder") {
    allow({"radius", "height"});
    return CylinderShape{length("radius"), length("height"), 1};
  }
  if (kind == "rod") {
    allow({"radius", "length"});
    return CylinderShape{length("radius"), length("length"), 0};
  }
  if (kind == "torus") {
    allow({"radius", "tube_radius"});
    return TorusShape{length("radius"), length("tube_radius")};
  }
  return {};
}

bool has_shape(Section const& section) {
  bool const shape = section.find("shape") != nullptr, mesh = section.find("mesh") != nullptr;
  if (shape == mesh)
    throw Error("{} has {}: give either a shape or a mesh", section.where(),
                mesh ? "both a shape and a mesh" : "no geometry");
  return shape;
}

ProceduralShape read_shape(Section const& section, double factor, ShapeOf owner) {
  Shape const shape = read_shape_kind(section, owner);
  constexpr double most = 1e6;
  bool const has_cells = std::holds_alternative<TetsShape>(shape);
  int const resolution = section.integer("resolution", {.min = 1, .max = most, .unit = "cells"},
                                         has_cells ? std::optional<int>(1) : std::nullopt);
  if (factor * resolution > most)
    throw Error(
        "{}: the resolution {} of {}, times that of the scene, {}, is above {} cells: lower one",
        section.place(), resolution, section.path(), factor, most);
  return {shape, scaled(shape, resolution, factor)};
}

double read_scale(Section const& section) {
  return section.number("scale", {.min = 1e-9, .max = 1e9}, 1.0);
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

RigidMotion read_motion(Section const& section) {
  RigidMotion motion;
  double last_end = 0;
  for (Section const& entry : section.list("motion")) {
    MotionPhase const phase = read_phase(entry);
    if (phase.window.start < last_end)
      throw Error(
          "{}: starts at {} s, before the phase above it ends at {} s: give the phases in "
          "order of time, without overlap",
          entry.where(), phase.window.start, last_end);
    last_end = phase.window.end;
    motion.phases.push_back(phase);
  }
  return motion;
}

}  // namespace taut
