// The fields of a minimiser and the passes over them. No pass depends on a policy, so each is
// compiled once per precision and space. Products are formed and summed in Precision::sum.
#pragma once

#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/matrix.hpp>

namespace taut {
namespace kernels {

template <class T, class Field>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> load3(Field const& field, int i) {
  return {T(field(i, 0)), T(field(i, 1)), T(field(i, 2))};
}
template <class T, class U>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> convert(Vec3<U> const& a) {
  return {T(a[0]), T(a[1]), T(a[2])};
}
template <class T, class Field>
KOKKOS_FORCEINLINE_FUNCTION void store3(Field const& field, int i, Vec3<T> const& value) {
  using Stored = typename Field::non_const_value_type;
  for (int c = 0; c < 3; ++c) field(i, c) = Stored(value[c]);
}

/// x = from + alpha p, and first from = x if `leaving`.
template <class P, class S>
struct MoveAlong {
  VectorField<typename P::position, S> x, from;
  VectorField<typename P::real, S> p;
  typename P::position alpha;
  bool leaving;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      if (leaving) from(i, c) = x(i, c);
      x(i, c) = from(i, c) + alpha * typename P::position(p(i, c));
    }
  }
};

/// p = -p
template <class P, class S>
struct Reverse {
  VectorField<typename P::real, S> p;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) p(i, c) = -p(i, c);
  }
};

template <class P, class S>
struct Dot {
  VectorField<typename P::real, S> a, b;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 1>& sums) const {
    using Sum = typename P::sum;
    sums[0] += dot(load3<Sum>(a, i), load3<Sum>(b, i));
  }
};

template <class Field>
struct LargestNorm {
  Field p;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    largest = Kokkos::max(largest, norm(load3<double>(p, i)));
  }
};

/// |x - from|^2 in the metric of the mass.
template <class P, class S>
struct Travel {
  VectorField<typename P::position, S> x, from;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 1>& sums) const {
    using Sum = typename P::sum;
    auto const d = load3<Sum>(x, i) - load3<Sum>(from, i);
    sums[0] += Sum(mass(i)) * dot(d, d);
  }
};

}  // namespace kernels

/// What an iteration works on. Allocated by `resize` alone.
template <class P, class S>
struct DescentFields {
  using Vectors = VectorField<typename P::real, S>;
  Vectors gradient, gradient_before;          ///< at x, and where the last step began
  Vectors direction;                          ///< p
  VectorField<typename P::position, S> from;  ///< where the last step began
  /// Where the minimisation began, or prescribed unknowns were last moved; only without inertia.
  VectorField<typename P::position, S> origin;
  Array<typename P::real, S> mass;
  Reducer<S, typename P::sum> reducer;

  int size() const { return static_cast<int>(direction.extent(0)); }
  /// Allocates what there is no memory for.
  void resize(int n, bool with_origin = false) {
    if (with_origin && static_cast<int>(origin.extent(0)) != n) {
      origin = origin_memory_.resize("origin", n);
    }
    if (size() == n) return;
    gradient = gradient_memory_.resize("gradient", n);
    gradient_before = gradient_before_memory_.resize("gradient_before", n);
    direction = direction_memory_.resize("direction", n);
    from = from_memory_.resize("from", n);
    reducer.provide(n);
  }

private:
  Resizable<Vectors> gradient_memory_, gradient_before_memory_, direction_memory_;
  Resizable<VectorField<typename P::position, S>> from_memory_, origin_memory_;
};

}  // namespace taut
