// The definition of add_elastic_term, for the source files that instantiate it.
#pragma once

#include <taut/apps/program/elastic_terms.hpp>
#include <taut/apps/program/late_part.hpp>
#include <taut/core/report/error.hpp>

namespace taut {

template <class Model, class Filter, class Precision>
void add_elastic_term_of(ProgramTerms<Precision>& terms, ElasticPart const& part) {
  terms.add(ElasticTets<Elastic<Model, Filter>, Precision, DefaultSpace>(part.rest, part.materials,
                                                                         part.material_of_tet));
}

/// A curvature filter other than the default.
template <class Model>
inline constinit LatePart<void(ProgramTerms<Fp64>&, ElasticPart const&, std::string_view)>
    add_filtered_term = {};

template <class Model, class Precision>
void add_elastic_term(ProgramTerms<Precision>& terms, ElasticPart const& part,
                      std::string_view curvature) {
  if (curvature == "clamp") return add_elastic_term_of<Model, ClampElement>(terms, part);
  if constexpr (std::same_as<Precision, Fp64>) {
    add_filtered_term<Model>(fmt::format("curvature = {}", curvature), terms, part, curvature);
  } else {
    throw Error(
        "solver.curvature = \"{}\" is compiled for fp64 alone: set solver.precision = \"fp64\", or "
        "solver.curvature = \"clamp\"",
        curvature);
  }
}

}  // namespace taut
