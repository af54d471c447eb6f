// The unknowns of a potential: how many, how heavy, which are fixed and where those are going.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/term.hpp>

#include <span>

namespace taut {

template <class Precision = Mixed, class Space = DefaultSpace>
struct Unknowns {
  using Positions = VectorField<typename Precision::position, Space>;

  Array<typename Precision::real, Space> mass;  ///< lumped, kg
  FixedMask<Space> fixed;                       ///< not 0 where prescribed (term.hpp)
  Positions prescribed;  ///< where fixed unknowns are to be at the end of the step, m
  double length = 1;     ///< length in which tolerances are measured, m (mean rest edge length)

  Unknowns() = default;
  /// All free. `lumped` in kg, in the solver's order.
  Unknowns(std::span<double const> lumped, double length_scale)
      : mass("mass", lumped.size()),
        fixed("fixed", lumped.size()),
        prescribed("prescribed", lumped.size()),
        length(length_scale) {
    auto host = Kokkos::create_mirror_view(mass);
    for (std::size_t i = 0; i < lumped.size(); ++i) {
      host(i) = static_cast<typename Precision::real>(lumped[i]);
    }
    assign(mass, host);
  }

  int size() const { return static_cast<int>(mass.extent(0)); }
};

}  // namespace taut
