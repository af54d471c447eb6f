// Which of the materials, by which particles are numbered, a term over them holds: those of its
// model.
#pragma once

#include <taut/core/report/error.hpp>

#include <Kokkos_Core.hpp>

#include <cstddef>
#include <vector>

namespace taut {

/// Materials first to end - 1.
struct MaterialRange {
  int first = 0, end = 0;
  KOKKOS_FORCEINLINE_FUNCTION bool holds(int material) const {
    return material >= first && material < end;
  }
};

namespace kernels {

struct VisitNothing {
  template <class Term>
  void operator()(Term&) const {}
};

}  // namespace kernels

/// `E` is a potential that shows its terms, of which some have particles perhaps.
template <class E>
concept ShowsTerms = requires(E& e) {
  e.for_each_term(kernels::VisitNothing());
};

/// How many terms of a potential hold each material. Throws Error if none holds one that is
/// numbered below others.
template <ShowsTerms E>
std::vector<int> terms_of_materials(E& potential) {
  std::vector<int> terms;
  potential.for_each_term([&](auto const& term) {
    if constexpr (requires { term.materials().end; }) {
      MaterialRange const range = term.materials();
      if (terms.size() < std::size_t(range.end)) terms.resize(std::size_t(range.end), 0);
      for (int m = range.first; m < range.end; ++m) ++terms[std::size_t(m)];
    }
  });
  for (std::size_t m = 0; m < terms.size(); ++m) {
    if (terms[m] == 0) throw Error("no term over the particles holds material {}: add one", m);
  }
  return terms;
}

}  // namespace taut
