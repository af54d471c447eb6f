// What comes out of the sources of a scene of material points.
#include <taut/apps/program/particle_frames.hpp>
#include <taut/apps/program/particle_geometry.hpp>
#include <taut/core/report/error.hpp>
#include <taut/mpm/source.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

/// Particles come out as the nodes in the source move, or nothing would follow them.
Particle particle_at(BoundaryMotion const& at, Vec3<double> const& place) {
  Particle p;
  p.x = at.pose(place);
  p.v = at.velocity + cross(at.spin, p.x - at.pose.translation);
  Vec3<double> const& w = at.spin;
  p.C = Mat3<double>{{0, w[2], -w[1], -w[2], 0, w[0], w[1], -w[0], 0}};
  return p;
}

SourceSpec flow_of(SceneSource const& source) {
  BoundarySpec shape;
  RigidMap const placed = compose(source.placement, set_shape(source.shape, shape));
  return {.name = source.name,
          .shape = shape.shape,
          .size = shape.size,
          .velocity = transpose_times(to_pose(placed).rotation, to_vec(source.velocity)),
          .per_cell = source.per_cell,
          .start = source.window.start,
          .end = source.window.end};
}

}  // namespace

double volume_let_out(SceneSource const& source, double time) {
  SourceSpec const flow = flow_of(source);
  double const speed = norm(flow.velocity),
               seconds = std::min(time, flow.end) - std::min(time, flow.start);
  return shadow(flow, (1 / speed) * flow.velocity) * speed * seconds;
}

void add_emitted(Scene const& scene, std::vector<int> const& material, SceneParticles& to) {
  ParticleScene const& points = *scene.particles;
  struct Emitted {
    double time;
    Particle particle;
  };
  std::vector<Emitted> all;
  for (std::size_t k = 0; k < points.sources.size(); ++k) {
    SceneSource const& source = points.sources[k];
    BoundarySpec const& spec = to.boundaries[points.boundaries.size() + k];
    double const until = scene.step * scene.frames * (1 + 1e-9);
    Outflow const out = outflow(flow_of(source), points.spacing, until,
                                static_cast<std::uint64_t>(points.seed) + 1000003 * (k + 1));
    auto const b = static_cast<int>(points.bodies.size() + k);
    for (Outflow::Point const& point : out.points) {
      Particle p = particle_at(spec.motion(point.time), point.place);
      p.volume = out.volume;
      p.mass = source.material.density * out.volume;
      p.material = material[static_cast<std::size_t>(b)];
      p.object = b;
      p.plastic = to.flows[static_cast<std::size_t>(p.material)].initial();
      all.push_back({point.time, p});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](Emitted const& a, Emitted const& b) { return a.time < b.time; });
  to.born.assign(to.list.size(), -std::numeric_limits<double>::infinity());
  for (Emitted const& emitted : all) {
    to.list.push_back(emitted.particle);
    to.born.push_back(emitted.time);
  }
}

void refuse_blocked_sources(ParticleScene const& scene, SceneParticles const& particles) {
  if (scene.sources.empty()) return;
  BoundaryList<Space<Kokkos::DefaultHostExecutionSpace>> walls(particles.boundaries);
  std::size_t const initial = particles.initial(), all = particles.list.size();
  for (std::size_t k = 0; k < scene.sources.size(); ++k) {
    SceneSource const& source = scene.sources[k];
    if (source.window.start > 0 || !scene.check_overlap) continue;
    for (std::size_t p = 0; p < initial; ++p) {
      Particle const& particle = particles.list[p];
      if (!walls.list()(scene.boundaries.size() + k).holds(particle.x)) continue;
      throw Error(
          "{}: object {} is in source {}, with a particle at ({:.4g}, {:.4g}, {:.4g}) m: move one "
          "of them (object.NAME.translate, source.NAME.translate)",
          source.where, scene.bodies[static_cast<std::size_t>(particle.object)].name, source.name,
          particle.x[0], particle.x[1], particle.x[2]);
    }
  }
  // Some of what comes out shows where all of it does.
  std::size_t const stride = 1 + (all - initial) / 2000;
  for (std::size_t p = initial; p < all; p += stride) {
    Particle const& particle = particles.list[p];
    walls.set_time(particles.born[p]);
    for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
      if (!walls.list()(k).holds(particle.x)) continue;
      SceneSource const& source =
          scene.sources[static_cast<std::size_t>(particle.object) - scene.bodies.size()];
      throw Error(
          "{}: source {} is in boundary {}: at {:.4g} s a particle would come out at ({:.4g}, "
          "{:.4g}, {:.4g}) m: move one of them (source.NAME.translate, boundary.NAME.translate)",
          source.where, source.name, scene.boundaries[k].name, particles.born[p], particle.x[0],
          particle.x[1], particle.x[2]);
    }
  }
}

}  // namespace taut
