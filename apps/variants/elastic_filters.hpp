// Elastic terms with the curvature filters that are not the default, for the source files that
// instantiate them: models alike share one, and what both need is compiled once.
#pragma once

#include <taut/apps/program/elastic_terms_impl.hpp>

namespace taut {

/// `curvature`: a value of the key solver.curvature other than "clamp".
template <class Model>
void add_filtered(ProgramTerms<Fp64>& terms, ElasticPart const& part, std::string_view curvature) {
  if (curvature == "limit") return add_elastic_term_of<Model, LimitLambda>(terms, part);
  add_elastic_term_of<Model, FullProjection>(terms, part);
}

}  // namespace taut
