// The definition of add_elastic_term, for the source files that instantiate it.
#pragma once

#include <taut/apps/program/elastic_terms.hpp>
#include <taut/core/report/error.hpp>

namespace taut {

template <class Model, class Precision>
void add_elastic_term(ProgramTerms<Precision>& terms, ElasticPart const& part,
                      std::string_view curvature) {
  auto const add = [&]<class Filter>() {
    terms.add(ElasticTets<Elastic<Model, Filter>, Precision, DefaultSpace>(
        part.rest, part.materials, part.material_of_tet));
  };
  if (curvature == "clamp") return add.template operator()<ClampElement>();
  if constexpr (std::same_as<Precision, Fp64>) {
    if (curvature == "limit") return add.template operator()<LimitLambda>();
    if (curvature == "project") return add.template operator()<FullProjection>();
  }
  throw Error(
      "solver.curvature = \"{}\" is compiled for fp64 alone: set solver.precision = \"fp64\", or "
      "solver.curvature = \"clamp\"",
      curvature);
}

}  // namespace taut
