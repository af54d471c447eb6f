// The discrete scene of material points: the particles of all bodies, their materials, and where
// the boundaries are at any time.
#pragma once

#include <taut/apps/program/scene.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/mpm/boundary.hpp>
#include <taut/mpm/particles.hpp>
#include <taut/mpm/plastic_flow.hpp>

namespace taut {

struct SceneParticles {
  std::vector<Particle> list;  ///< one body after the other; `object` is that of the scene's bodies
  std::vector<MaterialParameters> materials;
  std::vector<MaterialFlow> flows;  ///< per material
  std::vector<std::string> warnings;
  /// Triangles of the boundaries at time 0, for pictures.
  std::vector<TriangleMesh> drawings;
};

/// Samples all bodies. Throws Error for a file that holds no solid, a body without room for a
/// particle, bodies that overlap, and a body that starts in a boundary that does not stick.
SceneParticles build_particles(Scene const& scene);

/// The boundaries as functions of time.
std::vector<BoundarySpec> boundary_specs(ParticleScene const& scene);

/// Names of the numbers that a result has per particle.
std::vector<std::string> particle_scalars();
/// What results have of the scene, particles in front.
ResultMesh result_mesh(Scene const& scene, SceneParticles const& particles);

}  // namespace taut
