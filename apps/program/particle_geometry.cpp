#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/scene_obstacle.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>
#include <taut/materials/invariants.hpp>
#include <taut/mpm/sampling.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace taut {
namespace {

Vec3<double> to_vec(Point const& p) { return {p[0], p[1], p[2]}; }

RigidPose to_pose(RigidMap const& map) {
  RigidPose pose;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pose.rotation(r, c) = map.rotation[r][c];
  pose.translation = to_vec(map.translation);
  return pose;
}

/// Turns the y axis into a unit vector.
RigidMap turn_up(Point const& to) {
  Point const axis = cross({0, 1, 0}, to);
  double const sine = norm(axis);
  if (sine > 0) return rotation_about((1 / sine) * axis, std::atan2(sine, to[1]), {});
  return to[1] > 0 ? RigidMap{} : rotation_about({1, 0, 0}, std::numbers::pi, {});
}

/// Of a solid whose axis is y, to the axis of the shape.
RigidMap frame_of(CylinderShape const& c) {
  Point axis{};
  axis[static_cast<std::size_t>(c.axis)] = 1;
  return turn_up(axis);
}

struct MakeSolid {
  Solid operator()(BoxShape const& box) const { return solid_box(to_vec(box.size)); }
  Solid operator()(SphereShape const& ball) const { return solid_ball(ball.radius); }
  Solid operator()(CylinderShape const& c) const {
    return placed(solid_cylinder(c.radius, c.length), to_pose(frame_of(c)));
  }
  Solid operator()(TorusShape const& t) const { return solid_torus(t.radius, t.tube_radius); }
  template <class Other>
  Solid operator()(Other const&) const {
    throw Error("this shape is of meshes alone");  // the reader lets none through
  }
};

Solid scaled(Solid const& solid, double factor) {
  if (factor == 1) return solid;
  return {[inner = solid.holds, factor](Vec3<double> const& x) { return inner((1 / factor) * x); },
          factor * solid.lowest, factor * solid.highest, factor * factor * factor * solid.volume};
}

Solid solid_of(SceneBody const& body) {
  Solid solid;
  if (auto const* file = std::get_if<std::filesystem::path>(&body.geometry)) {
    solid = file->extension() == ".vdb"
                ? solid_in_level_set(*file)
                : solid_in_surface(read_obj(*file), file->string(), body.max_holes);
  } else {
    solid = std::visit(MakeSolid(), std::get<Shape>(body.geometry));
  }
  return placed(scaled(solid, body.scale), to_pose(body.placement));
}

bool same(MaterialParameters const& a, MaterialParameters const& b) {
  return a.model == b.model && a.young == b.young && a.poisson == b.poisson;
}
bool same(Plasticity const& a, Plasticity const& b) {
  return a.kind == b.kind && a.yield_stress == b.yield_stress && a.hardening == b.hardening &&
         a.compression == b.compression && a.stretch == b.stretch && a.least == b.least &&
         a.most == b.most && a.angle == b.angle;
}

MaterialFlow flow_of(SceneBody const& body) {
  Plasticity const& p = body.plasticity;
  Lame<double> const lame = lame_parameters(body.material.young, body.material.poisson);
  MaterialFlow flow;
  for (std::size_t k = 0; k < plasticity_kinds().size(); ++k) {
    if (plasticity_kinds()[k] == p.kind) flow.kind = static_cast<FlowKind>(k);
  }
  flow.metal = {lame.mu, p.yield_stress, p.hardening};
  flow.metal_of_hot = {lame.mu, p.yield_stress};
  flow.snow = {p.compression, p.stretch, p.hardening, p.least, p.most};
  flow.sand = {.mu = lame.mu, .lambda = lame.lambda, .angle = p.angle};
  return flow;
}

/// Numbers the materials; those that are alike have one number.
std::vector<int> number_materials(ParticleScene const& scene, SceneParticles& to) {
  std::vector<int> number;
  std::vector<SceneBody const*> first;
  for (SceneBody const& body : scene.bodies) {
    auto const known = std::find_if(first.begin(), first.end(), [&](SceneBody const* other) {
      return same(other->material, body.material) && same(other->plasticity, body.plasticity);
    });
    number.push_back(static_cast<int>(known - first.begin()));
    if (known != first.end()) continue;
    first.push_back(&body);
    to.materials.push_back(body.material);
    to.flows.push_back(flow_of(body));
  }
  return number;
}

Solid carved(ParticleScene const& scene, std::size_t number, std::vector<Solid> const& whole) {
  SceneBody const& body = scene.bodies[number];
  Solid solid = whole[number];
  for (std::string const& name : body.without) {
    std::size_t other = 0;
    while (other < whole.size() && scene.bodies[other].name != name) ++other;
    if (other == whole.size() || other == number) {
      std::vector<std::string_view> names;
      for (SceneBody const& one : scene.bodies) {
        if (&one != &body) names.push_back(one.name);
      }
      throw Error("{}.without: there is no other object '{}'{}", body.where, name,
                  names.empty() ? "" : suggestion(": did you mean '", name, names, "'?"));
    }
    solid = without(solid, whole[other]);
  }
  return solid;
}

void start_moving(SceneBody const& body, Particle& p) {
  InitialVelocity const& v = body.velocity;
  Point const arm = Point{p.x[0], p.x[1], p.x[2]} - v.centre;
  double rate = v.angular_velocity;
  if (v.twist_length) {
    rate *= std::sin(std::numbers::pi * dot(v.axis, arm) / (2 * *v.twist_length));
  }
  p.v = to_vec(v.linear + rate * cross(v.axis, arm));
  if (v.twist_length || rate == 0) return;
  for (int c = 0; c < 3; ++c) {  // the gradient of a spin
    Point unit{};
    unit[static_cast<std::size_t>(c)] = 1;
    p.C.set_column(c, to_vec(rate * cross(v.axis, unit)));
  }
}

/// A body that begins in a wall is pushed out of it with whatever force that takes.
void refuse_inside(ParticleScene const& scene, SceneParticles const& particles) {
  BoundaryList<Space<Kokkos::DefaultHostExecutionSpace>> walls(boundary_specs(scene));
  auto const list = walls.list();
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    if (scene.boundaries[k].law == BoundaryLaw::stick) continue;
    for (Particle const& p : particles.list) {
      if (!list(k).holds(p.x)) continue;
      throw Error(
          "{}: object {} starts in boundary {}, with a particle at ({:.4g}, {:.4g}, {:.4g}) m: "
          "move one of them (object.NAME.translate, boundary.NAME.translate)",
          scene.boundaries[k].where, scene.bodies[static_cast<std::size_t>(p.object)].name,
          scene.boundaries[k].name, p.x[0], p.x[1], p.x[2]);
    }
  }
}

/// A layer of less than a cell cannot bend, and a body of less than that is a drop.
void refuse_coarse(ParticleScene const& scene, std::vector<Solid> const& solids) {
  for (std::size_t b = 0; b < solids.size(); ++b) {
    double largest = 0;
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, solids[b].highest[c] - solids[b].lowest[c]);
    }
    if (scene.spacing < largest) continue;
    throw Error(
        "{}: the cells of the grid are {:.3g} m wide and object {} only {:.3g} m: lower "
        "grid.spacing, or raise resolution",
        scene.bodies[b].where, scene.spacing, scene.bodies[b].name, largest);
  }
}

std::vector<TriangleMesh> draw(ParticleScene const& scene, std::vector<Particle> const& list) {
  std::array<Point, 2> around{Point{list[0].x[0], list[0].x[1], list[0].x[2]}, Point{}};
  around[1] = around[0];
  for (Particle const& p : list)
    for (std::size_t c = 0; c < 3; ++c) {
      around[0][c] = std::min(around[0][c], p.x[static_cast<int>(c)]);
      around[1][c] = std::max(around[1][c], p.x[static_cast<int>(c)]);
    }
  constexpr int resolution = 16;
  std::vector<TriangleMesh> drawings;
  for (SceneBoundary const& boundary : scene.boundaries) {
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

/// Where no particle is, m.
constexpr double taken_away = -1e12;

/// Velocity and spin of what follows a motion, at the end of a step at time t; `x` is where a point
/// of it is then.
BoundaryMotion motion_at(SceneBoundary const& boundary, RigidMap const& frame, double t) {
  BoundaryMotion at;
  RigidMap const pose = compose(boundary.motion.at(t), compose(boundary.placement, frame));
  at.pose = to_pose(pose);
  double const slack = 1e-9 * (1 + std::abs(t));
  if (boundary.release && t > *boundary.release + slack) {
    at.pose.translation[1] = taken_away;
    return at;
  }
  for (MotionPhase const& phase : boundary.motion.phases) {
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

struct SpecOf {
  BoundarySpec& spec;

  RigidMap operator()(HalfSpaceShape const& half) const {
    spec.shape = BoundaryShape::half_space;
    RigidMap frame = turn_up(half.normal);
    frame.translation = half.point;
    return frame;
  }
  RigidMap operator()(Shape const& shape) const { return std::visit(*this, shape); }
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

}  // namespace

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
    RigidMap const frame = std::visit(SpecOf{spec}, boundary.shape);
    spec.motion = [boundary, frame](double t) { return motion_at(boundary, frame, t); };
    specs.push_back(spec);
  }
  return specs;
}

SceneParticles build_particles(Scene const& scene) {
  ParticleScene const& points = *scene.particles;
  SceneParticles built;
  std::vector<int> const material = number_materials(points, built);
  std::vector<Solid> whole;
  for (SceneBody const& body : points.bodies) {
    try {
      whole.push_back(solid_of(body));
    } catch (Error const& error) {
      throw Error("{}: {}", body.where, error.what());
    }
  }
  refuse_coarse(points, whole);
  std::vector<ParticleBody> bodies;
  for (std::size_t b = 0; b < points.bodies.size(); ++b) {
    SceneBody const& body = points.bodies[b];
    bodies.push_back({.name = body.name,
                      .solid = carved(points, b, whole),
                      .density = body.material.density,
                      .per_cell = body.per_cell,
                      .material = material[b]});
  }
  try {
    built.list = sample(bodies, points.spacing,
                        {static_cast<std::uint64_t>(points.seed), points.check_overlap});
  } catch (Error const& error) {
    throw Error("{}: {}", scene.file.string(), error.what());
  }
  std::vector<std::mt19937_64> engines;
  for (SceneBody const& body : points.bodies) {
    engines.emplace_back(static_cast<std::uint64_t>(body.start ? body.start->seed : 0));
  }
  for (Particle& p : built.list) {
    auto const b = static_cast<std::size_t>(p.object);
    SceneBody const& body = points.bodies[b];
    start_moving(body, p);
    p.plastic = built.flows[static_cast<std::size_t>(p.material)].initial();
    if (!body.start) continue;
    for (int c = 0; c < 3; ++c) {
      double const unit = static_cast<double>(engines[b]() >> 11) * 0x1p-53;
      p.F(c, c) = body.start->least + unit * (body.start->most - body.start->least);
    }
  }
  refuse_inside(points, built);
  built.drawings = draw(points, built.list);
  return built;
}

std::vector<std::string> particle_scalars() { return {"J", "plastic", "stiffness"}; }

ResultMesh result_mesh(Scene const& scene, SceneParticles const& particles) {
  ParticleScene const& points = *scene.particles;
  ResultMesh result;
  for (Particle const& p : particles.list) {
    result.mesh.points.push_back({p.x[0], p.x[1], p.x[2]});
    result.object.push_back(p.object);
  }
  result.particles = particles.list.size();
  result.scalars = particle_scalars();
  for (SceneBody const& body : points.bodies) {
    result.object_names.push_back(body.name);
    result.object_kind.push_back(ObjectKind::body);
  }
  for (std::size_t k = 0; k < points.boundaries.size(); ++k) {
    SceneBoundary const& boundary = points.boundaries[k];
    bool const wall = boundary.inside || std::holds_alternative<HalfSpaceShape>(boundary.shape);
    auto const number = static_cast<std::int32_t>(result.object_names.size());
    auto const first = static_cast<std::int32_t>(result.mesh.points.size());
    result.object_names.push_back(boundary.name);
    result.object_kind.push_back(wall ? ObjectKind::drawn_only : ObjectKind::obstacle);
    TriangleMesh const& drawing = particles.drawings[k];
    result.mesh.points.insert(result.mesh.points.end(), drawing.points.begin(),
                              drawing.points.end());
    for (Triangle triangle : drawing.triangles) {
      for (std::int32_t& v : triangle) v += first;
      result.triangles.push_back(triangle);
      result.object.push_back(number);
    }
  }
  return result;
}

}  // namespace taut
