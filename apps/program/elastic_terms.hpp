// The elastic terms that the program knows: every model in every precision with the clamped filter,
// and with the other filters in fp64. All but fp64 with the clamped filter is compiled in
// apps/variants.
#pragma once

#include <taut/apps/program/scene.hpp>
#include <taut/core/potential/any_terms.hpp>
#include <taut/presets/elastic.hpp>

#include <string_view>

namespace taut {

/// Part of a scene that one model covers: tets in the solver's order with their materials.
struct ElasticPart {
  TetMesh rest;
  std::vector<Lame<double>> materials;
  std::vector<int> material_of_tet;
};

template <class Precision>
using ProgramTerms = AnyTerms<Precision, DefaultSpace>;

/// Adds the elastic term of `Model`. `curvature` is a value of the key solver.curvature. Throws
/// Error for a filter that is not compiled in this precision.
template <class Model, class Precision>
void add_elastic_term(ProgramTerms<Precision>& terms, ElasticPart const& part,
                      std::string_view curvature);

}  // namespace taut
