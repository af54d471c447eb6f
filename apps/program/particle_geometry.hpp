// The discrete scene of material points: the particles of all bodies, their materials, and where
// the boundaries are at any time.
#pragma once

#include <taut/apps/program/scene.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/mpm/boundary.hpp>
#include <taut/mpm/particles.hpp>
#include <taut/mpm/plastic_flow.hpp>

#include <algorithm>
#include <limits>

namespace taut {

struct SceneParticles {
  /// One body after the other, then what comes out of sources, in the order of time; `object`
  /// counts the scene's bodies, then its sources. A source's particle is as it leaves the source.
  std::vector<Particle> list;
  std::vector<double> born;  ///< s; those of bodies: minus infinity
  std::vector<MaterialParameters> materials;
  std::vector<MaterialFlow> flows;       ///< per material
  std::vector<BoundarySpec> boundaries;  ///< boundary_specs()
  std::vector<std::string> warnings;
  /// Triangles of the boundaries at time 0, for pictures.
  std::vector<TriangleMesh> drawings;

  /// How many of the list are there at a time, s: those of bodies, and those that are out by then.
  std::size_t count_at(double time) const {
    return static_cast<std::size_t>(std::upper_bound(born.begin(), born.end(), time) -
                                    born.begin());
  }
  std::size_t initial() const { return count_at(std::numeric_limits<double>::lowest()); }
};

/// Samples all bodies, and what comes out of sources in the time of the scene. Throws Error for a
/// file that holds no solid, a body or a source without room for a particle, bodies that overlap or
/// are beyond where grids end, a body that starts in a boundary that does not stick or in a source,
/// and a source in a boundary.
SceneParticles build_particles(Scene const& scene);

/// What a source lets out in the first `time` seconds, m^3.
double volume_let_out(SceneSource const& source, double time);
/// What comes out of sources, behind the particles of bodies. `material`: the number of that of
/// each body, then of each source.
void add_emitted(Scene const& scene, std::vector<int> const& material, SceneParticles& to);
/// Throws Error for a body in a source and a source in a boundary.
void refuse_blocked_sources(ParticleScene const& scene, SceneParticles const& particles);

/// The boundaries as functions of time, and behind them the sources.
std::vector<BoundarySpec> boundary_specs(ParticleScene const& scene);
/// Triangles of the boundaries at time 0; `list`: what they are around.
std::vector<TriangleMesh> draw_boundaries(ParticleScene const& scene,
                                          std::vector<Particle> const& list);

/// Names of the numbers that a result has per particle.
std::vector<std::string> particle_scalars();
/// What results have of the scene, particles in front.
ResultMesh result_mesh(Scene const& scene, SceneParticles const& particles);

}  // namespace taut
