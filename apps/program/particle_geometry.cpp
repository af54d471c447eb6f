#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/particle_frames.hpp>
#include <taut/apps/program/particle_geometry.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>
#include <taut/materials/invariants.hpp>
#include <taut/mpm/sampling.hpp>
#include <taut/mpm/topology.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace taut {
namespace {

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

MaterialFlow flow_of(MaterialParameters const& material, Plasticity const& p) {
  Lame<double> const lame = lame_parameters(material.young, material.poisson);
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

/// Numbers the materials of bodies, then of sources; those that are alike have one number, and
/// those of one model follow each other.
std::vector<int> number_materials(ParticleScene const& scene, SceneParticles& to) {
  struct Kind {
    MaterialParameters const* material;
    Plasticity const* plasticity;
    bool operator==(Kind const& other) const {
      return same(*material, *other.material) && same(*plasticity, *other.plasticity);
    }
  };
  std::vector<Kind> all;
  for (SceneBody const& body : scene.bodies) all.push_back({&body.material, &body.plasticity});
  for (SceneSource const& source : scene.sources) {
    all.push_back({&source.material, &source.plasticity});
  }
  std::vector<Kind> kinds;
  for (Kind const& one : all) {
    if (std::find(kinds.begin(), kinds.end(), one) != kinds.end()) continue;
    auto const alike = [&](Kind const& k) { return k.material->model == one.material->model; };
    auto const last = std::find_if(kinds.rbegin(), kinds.rend(), alike);
    kinds.insert(last == kinds.rend() ? kinds.end() : last.base(), one);
  }
  for (Kind const& one : kinds) {
    to.materials.push_back(*one.material);
    to.flows.push_back(flow_of(*one.material, *one.plasticity));
  }
  std::vector<int> number;
  for (Kind const& one : all) {
    number.push_back(static_cast<int>(std::find(kinds.begin(), kinds.end(), one) - kinds.begin()));
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
  BoundaryList<Space<Kokkos::DefaultHostExecutionSpace>> walls(particles.boundaries);
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

/// Before anything is sampled.
void require_memory_for(Scene const& scene, std::vector<Solid> const& solids) {
  ParticleScene const& points = *scene.particles;
  double const cell = points.spacing * points.spacing * points.spacing;
  double particles = 0, cells = 0;
  auto const add = [&](double volume, double per_cell) {
    particles += volume / cell * per_cell;
    cells += volume / cell;
  };
  for (std::size_t b = 0; b < solids.size(); ++b) {
    add(solids[b].volume, points.bodies[b].per_cell);
  }
  for (SceneSource const& source : points.sources) {
    add(volume_let_out(source, scene.step * scene.frames), source.per_cell);
  }
  if (cells == 0) return;
  try {
    require_particle_memory(particles, particles / cells, scene.solver);
  } catch (Error const& error) {
    throw Error("{}: {}", scene.file.string(), error.what());
  }
}

/// Nodes have numbers, and those end.
void refuse_far(ParticleScene const& scene, std::vector<Solid> const& solids) {
  double const end = 0.5 * Topology::farthest * scene.spacing;
  for (std::size_t b = 0; b < solids.size(); ++b) {
    for (int c = 0; c < 3; ++c) {
      double const far = std::max(-solids[b].lowest[c], solids[b].highest[c]);
      if (far < end) continue;
      throw Error(
          "{}: object {} reaches {:.3g} m from the origin, and a grid of cells of {} m ends at "
          "{:.3g} m: move it nearer, or raise grid.spacing",
          scene.bodies[b].where, scene.bodies[b].name, far, scene.spacing, end);
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

std::vector<Particle> sampled(Scene const& scene, std::vector<ParticleBody> const& bodies) {
  ParticleScene const& points = *scene.particles;
  try {
    return sample(bodies, points.spacing,
                  {static_cast<std::uint64_t>(points.seed), points.check_overlap});
  } catch (Error const& error) {
    throw Error("{}: {}", scene.file.string(), error.what());
  }
}

}  // namespace

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
  refuse_far(points, whole);
  require_memory_for(scene, whole);
  if (!bodies.empty()) built.list = sampled(scene, bodies);
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
  built.boundaries = boundary_specs(points);
  refuse_inside(points, built);
  add_emitted(scene, material, built);
  if (built.list.empty()) {
    throw Error(
        "{}: nothing comes out of the sources in {} s, and there is nothing else: let them "
        "flow sooner, or take more frames",
        scene.file.string(), scene.step * scene.frames);
  }
  refuse_blocked_sources(points, built);
  built.drawings = draw_boundaries(points, built.list);
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
  result.growing = !points.sources.empty();
  result.scalars = particle_scalars();
  for (SceneBody const& body : points.bodies) {
    result.object_names.push_back(body.name);
    result.object_kind.push_back(ObjectKind::body);
  }
  for (SceneSource const& source : points.sources) {
    result.object_names.push_back(source.name);
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
