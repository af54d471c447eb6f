// Boundaries and sources of a scene of material points as what holds the nodes of its grid.
#include <taut/apps/program/particle_frames.hpp>
#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/scene_obstacle.hpp>
#include <taut/apps/program/scene_read.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace taut {
namespace {

/// Turns the y axis into a unit vector.
RigidMap turn_up(Point const& to) {
  Point const axis = cross({0, 1, 0}, to);
  double const sine = norm(axis);
  if (sine > 0) return rotation_about((1 / sine) * axis, std::atan2(sine, to[1]), {});
  return to[1] > 0 ? RigidMap{} : rotation_about({1, 0, 0}, std::numbers::pi, {});
}

/// Where no particle is, m.
constexpr double taken_away = -1e12;

/// What round-off makes of a time, s.
double slack_at(double t) { return 1e-9 * (1 + std::abs(t)); }

struct SetShape {
  BoundarySpec& spec;

  RigidMap operator()(BoxShape const& box) const {
    spec.shape = BoundaryShape::box;
    spec.size = to_vec(box.size);
    return {};
  }
  RigidMap operator()(SphereShape const& ball) const {
    spec.shape = BoundaryShape::ball;
    spec.size = {ball.radius, 0, 0};
    return {};
  }
  RigidMap operator()(CylinderShape const& c) const {
    spec.shape = BoundaryShape::cylinder;
    spec.size = {c.radius, c.length, 0};
    return frame_of(c);
  }
  RigidMap operator()(TorusShape const& t) const {
    spec.shape = BoundaryShape::torus;
    spec.size = {t.radius, t.tube_radius, 0};
    return {};
  }
  template <class Other>
  RigidMap operator()(Other const&) const {
    throw Error("this shape is of meshes alone");  // the reader lets none through
  }
};

/// The surface that a boundary of a file has, in its frame.
TriangleMesh surface_of(SceneBoundary const& boundary, std::filesystem::path const& file) {
  TriangleMesh surface = file.extension() == ".vdb" ? surface_of_level_set(file) : read_obj(file);
  for (Point& x : surface.points) x = boundary.scale * x;
  return surface;
}

/// Distances as fine as nodes can tell, and as far as particles see them: 2.6 cells along a
/// diagonal, and a cell of the field beyond.
std::shared_ptr<DistanceField const> field_of(SceneBoundary const& boundary,
                                              std::filesystem::path const& file, double spacing) {
  try {
    TriangleMesh const surface = surface_of(boundary, file);
    Solid const solid = solid_in_surface(surface, file.string(), boundary.max_holes);
    return std::make_shared<DistanceField>(
        distance_field(surface, solid, 0.5 * spacing, 3.5 * spacing, file.string()));
  } catch (Error const& error) {
    throw Error("{}: {}", boundary.where, error.what());
  }
}

/// Sets the shape of a boundary; returns its frame.
RigidMap set_boundary_shape(SceneBoundary const& boundary, double spacing, BoundarySpec& spec) {
  if (auto const* file = std::get_if<std::filesystem::path>(&boundary.shape)) {
    spec.shape = BoundaryShape::field;
    spec.field = field_of(boundary, *file, spacing);
    return {};
  }
  if (auto const* half = std::get_if<HalfSpaceShape>(&boundary.shape)) {
    spec.shape = BoundaryShape::half_space;
    RigidMap frame = turn_up(half->normal);
    frame.translation = half->point;
    return frame;
  }
  return set_shape(std::get<Shape>(boundary.shape), spec);
}

/// Of the picture of a boundary: thin rings are drawn with fewer, or they would have more triangles
/// than the bodies have particles.
int cells_across(SceneBoundary const& boundary) {
  constexpr int most = 16;
  auto const* shape = std::get_if<Shape>(&boundary.shape);
  auto const* torus = shape ? std::get_if<TorusShape>(shape) : nullptr;
  if (!torus) return most;
  return std::clamp(static_cast<int>(80 * torus->tube_radius / torus->radius), 4, most);
}

/// Of bodies and sources at time 0: how long a run is does not show in it.
std::array<Point, 2> box_around(ParticleScene const& scene, std::vector<Particle> const& list) {
  std::array<Point, 2> box{Point{unbounded, unbounded, unbounded},
                           Point{-unbounded, -unbounded, -unbounded}};
  auto const add = [&](Point const& x, double radius) {
    for (std::size_t c = 0; c < 3; ++c) {
      box[0][c] = std::min(box[0][c], x[c] - radius);
      box[1][c] = std::max(box[1][c], x[c] + radius);
    }
  };
  for (Particle const& p : list) {
    if (static_cast<std::size_t>(p.object) < scene.bodies.size()) add(to_point(p.x), 0);
  }
  for (SceneSource const& source : scene.sources) {
    BoundarySpec spec;
    set_shape(source.shape, spec);
    add(source.placement.translation, norm(spec.size));
  }
  return box;
}

/// A source holds the nodes in it while it flows.
BoundarySpec spec_of(SceneSource const& source) {
  BoundarySpec spec;
  spec.name = source.name;
  RigidMap const start = compose(source.placement, set_shape(source.shape, spec));
  spec.motion = [source, start](double t) {
    BoundaryMotion at = motion_at(source.motion, start, t);
    double const slack = slack_at(t);
    if (t > source.window.end + slack || t < source.window.start - slack) {
      at.pose.translation[1] = taken_away;
      return BoundaryMotion{at.pose, {}, {}};
    }
    RigidMap const turned = source.motion.at(t);
    at.velocity = at.velocity + to_vec(turned(source.velocity) - turned.translation);
    return at;
  };
  return spec;
}

}  // namespace

RigidMap frame_of(CylinderShape const& c) {
  Point axis{};
  axis[static_cast<std::size_t>(c.axis)] = 1;
  return turn_up(axis);
}

RigidMap set_shape(Shape const& shape, BoundarySpec& spec) {
  return std::visit(SetShape{spec}, shape);
}

BoundaryMotion motion_at(RigidMotion const& motion, RigidMap const& start, double t) {
  BoundaryMotion at;
  RigidMap const pose = compose(motion.at(t), start);
  at.pose = to_pose(pose);
  double const slack = slack_at(t);
  for (MotionPhase const& phase : motion.phases) {
    // A phase is over after the step that ends with it.
    if (!(t > phase.window.start + slack && t <= phase.window.end + slack)) continue;
    double const tau = t - phase.window.start;
    Point const spin = (phase.angular_velocity + phase.angular_acceleration * tau) * phase.axis;
    Point const arm = pose.translation - (phase.centre + tau * phase.velocity);
    at.spin = to_vec(spin);
    at.velocity = to_vec(phase.velocity + cross(spin, arm));
  }
  return at;
}

std::vector<BoundarySpec> boundary_specs(ParticleScene const& scene) {
  constexpr BoundaryContact laws[] = {BoundaryContact::sticky, BoundaryContact::slip,
                                      BoundaryContact::separate};
  std::vector<BoundarySpec> specs;
  for (SceneBoundary const& boundary : scene.boundaries) {
    BoundarySpec spec;
    spec.name = boundary.name;
    spec.contact = laws[static_cast<int>(boundary.law)];
    spec.outside = boundary.inside;
    spec.friction = boundary.friction;
    RigidMap const start =
        compose(boundary.placement, set_boundary_shape(boundary, scene.spacing, spec));
    spec.motion = [motion = boundary.motion, release = boundary.release, start](double t) {
      BoundaryMotion at = motion_at(motion, start, t);
      if (release && t > *release + slack_at(t)) {
        at.pose.translation[1] = taken_away;
        return BoundaryMotion{at.pose, {}, {}};
      }
      return at;
    };
    specs.push_back(spec);
  }
  for (SceneSource const& source : scene.sources) specs.push_back(spec_of(source));
  return specs;
}

std::vector<TriangleMesh> draw_boundaries(ParticleScene const& scene,
                                          std::vector<Particle> const& list) {
  std::array<Point, 2> const around = box_around(scene, list);
  std::vector<TriangleMesh> drawings;
  for (SceneBoundary const& boundary : scene.boundaries) {
    int const resolution = cells_across(boundary);
    if (auto const* file = std::get_if<std::filesystem::path>(&boundary.shape)) {
      drawings.push_back(surface_of(boundary, *file));
      for (Point& x : drawings.back().points) x = boundary.placement(x);
      continue;
    }
    SceneObstacle obstacle;
    obstacle.where = boundary.where;
    obstacle.placement = boundary.placement;
    if (auto const* half = std::get_if<HalfSpaceShape>(&boundary.shape)) {
      obstacle.geometry = *half;
    } else {
      obstacle.geometry = ProceduralShape{std::get<Shape>(boundary.shape), resolution};
    }
    drawings.push_back(triangles_of(obstacle, around, resolution));
    if (!boundary.inside) continue;
    for (Triangle& t : drawings.back().triangles) std::swap(t[1], t[2]);
  }
  return drawings;
}

}  // namespace taut
