#include <taut/apps/program/particle_terms.hpp>

namespace taut {
namespace {

void add_hencky(ParticleTerms& terms, std::vector<HenckyParameters<double>> const& materials) {
  using Solid = ElasticParticles<Hencky, ParticleKernel, ParticlePrecision, DefaultSpace>;
  terms.add(Solid(materials, terms.materials().end));
}

bool const filled = add_hencky_late.fill(add_hencky);

}  // namespace
}  // namespace taut
