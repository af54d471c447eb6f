#include <taut/apps/program/particle_terms.hpp>
#include <taut/apps/program/scene.hpp>

#include <fmt/core.h>

#include <array>
#include <concepts>

namespace taut {

std::span<std::string_view const> particle_models() {
  static constexpr std::array<std::string_view, 5> models{FixedCorotated::name, NeoHookean::name,
                                                          StableNeoHookean::name,
                                                          StableNeoHookean2018::name, Arap::name};
  return models;
}

int particle_lanes() { return ProgramSolid<FixedCorotated>::lanes; }

void add_particle_term(ParticleTerms& terms, std::string_view model,
                       std::vector<Lame<double>> const& materials) {
  ElasticModels::with(model, [&]<class Model>() {
    static_assert(ProgramSolid<Model>::lanes == ProgramSolid<FixedCorotated>::lanes);
    if constexpr (std::same_as<Model, FixedCorotated>) {
      add_solid<Model>(terms, materials);
    } else {
      add_solid_late<Model>(fmt::format("{} of material points", model), terms, materials);
    }
    return true;
  });
}

}  // namespace taut
