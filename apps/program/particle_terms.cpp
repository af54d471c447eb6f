// The elastic models that the program knows for material points.
#include <taut/apps/program/particle_potential.hpp>
#include <taut/apps/program/scene.hpp>
#include <taut/materials/fixed_corotated.hpp>
#include <taut/mpm/elastic_particles.hpp>

#include <array>

namespace taut {
namespace {

template <class Model>
using SolidOf = ElasticParticles<Elastic<Model, FullProjection>, ParticleKernel, ParticlePrecision,
                                 DefaultSpace>;

constexpr std::array<std::string_view, 1> models{FixedCorotated::name};

}  // namespace

std::span<std::string_view const> particle_models() { return models; }
int particle_lanes() { return SolidOf<FixedCorotated>::lanes; }

void add_particle_term(ParticleTerms& terms, std::string_view model,
                       std::vector<Lame<double>> const& materials) {
  if (model == FixedCorotated::name) return terms.add(SolidOf<FixedCorotated>(materials));
  throw Error("material.model = \"{}\" is not compiled for material points: use {}", model,
              models.front());
}

}  // namespace taut
