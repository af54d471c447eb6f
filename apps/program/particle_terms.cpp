#include <taut/apps/program/particle_terms.hpp>
#include <taut/apps/program/scene.hpp>

#include <fmt/core.h>

#include <array>
#include <concepts>

namespace taut {
namespace {

constexpr std::string_view hencky_plastic = "hencky_plastic";

/// Of a model that is the same whatever flows after a step.
void add_plain_term(ParticleTerms& terms, std::string_view model,
                    std::vector<Lame<double>> const& materials) {
  ElasticModels::with(model, [&]<class Model>() {
    if constexpr (std::same_as<Model, FixedCorotated>) {
      add_solid<Model>(terms, materials);
    } else {
      add_solid_late<Model>(fmt::format("{} of material points", model), terms, materials);
    }
    return true;
  });
}

}  // namespace

std::span<std::string_view const> particle_models() {
  static constexpr std::array<std::string_view, 7> models{
      FixedCorotated::name, NeoHookean::name, StableNeoHookean::name, StableNeoHookean2018::name,
      Arap::name,           Hencky::name,     hencky_plastic};
  return models;
}

bool yields_in_step(std::string_view model, FlowKind kind) {
  return model == hencky_plastic && (kind == FlowKind::von_mises || kind == FlowKind::sand);
}

void add_particle_term(ParticleTerms& terms, std::string_view model,
                       std::span<Lame<double> const> materials,
                       std::span<MaterialFlow const> flows) {
  if (model != Hencky::name && model != hencky_plastic) {
    add_plain_term(terms, model, {materials.begin(), materials.end()});
    return;
  }
  std::vector<HenckyParameters<double>> all;
  for (std::size_t k = 0; k < materials.size(); ++k) {
    if (!yields_in_step(model, flows[k].kind)) {
      all.push_back(hencky(materials[k]));
    } else if (flows[k].kind == FlowKind::sand) {
      all.push_back(hencky(materials[k], flows[k].sand));
    } else {
      all.push_back(hencky(materials[k], flows[k].metal));
    }
  }
  add_hencky_late(fmt::format("{} of material points", model), terms, all);
}

}  // namespace taut
