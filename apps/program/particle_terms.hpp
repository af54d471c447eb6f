// The elastic terms over particles that the program knows: every model, with its Hessian projected.
// The default model is compiled in particle_terms.cpp, each other one in a source of apps/variants.
#pragma once

#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/particle_potential.hpp>
#include <taut/materials/hencky.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>

namespace taut {

template <class Model>
using ProgramSolid = ElasticParticles<Elastic<Model, FullProjection>, ParticleKernel,
                                      ParticlePrecision, DefaultSpace>;

/// Adds the elastic term of `Model` over the materials that come next.
template <class Model>
void add_solid(ParticleTerms& terms, std::vector<Lame<double>> const& materials) {
  terms.add(ProgramSolid<Model>(materials, terms.materials().end));
}

/// The same for a model other than the default.
template <class Model>
inline constinit LatePart<void(ParticleTerms&, std::vector<Lame<double>> const&)> add_solid_late =
    {};
/// For Hencky's, with or without plasticity in the step.
inline constinit LatePart<void(ParticleTerms&, std::vector<HenckyParameters<double>> const&)>
    add_hencky_late = {};

}  // namespace taut
