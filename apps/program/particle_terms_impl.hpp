// The definition of add_solid, for the source files that instantiate it.
#pragma once

#include <taut/apps/program/particle_terms.hpp>

namespace taut {

template <class Model>
void add_solid(ParticleTerms& terms, std::vector<Lame<double>> const& materials) {
  terms.add(ProgramSolid<Model>(materials));
}

}  // namespace taut
