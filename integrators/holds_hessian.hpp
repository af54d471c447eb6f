// Preconditioners that are made of a whole Hessian, as multigrid cycles are, can lend it: a linear
// solver that is helped by one then assembles none of its own.
#pragma once

#include <concepts>

namespace taut {

template <class M, class Vectors>
concept HoldsHessian = requires(M const& m, Vectors const& v) {
  /// Whether it is the one of the iterate: made anew at each.
  { m.holds_hessian() } -> std::convertible_to<bool>;
  /// hd = H d into the second argument.
  {m.hessian_product(v, v)};
};

}  // namespace taut
