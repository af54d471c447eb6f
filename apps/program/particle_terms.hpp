// The elastic terms over particles that the program knows: every model, with its Hessian projected.
// Each model is compiled in a source file of its own.
#pragma once

#include <taut/apps/program/particle_potential.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>

namespace taut {

template <class Model>
using ProgramSolid = ElasticParticles<Elastic<Model, FullProjection>, ParticleKernel,
                                      ParticlePrecision, DefaultSpace>;

/// Adds the elastic term of `Model`.
template <class Model>
void add_solid(ParticleTerms& terms, std::vector<Lame<double>> const& materials);

}  // namespace taut
