// The largest eigenvalue of D^-1 A, with D the diagonal blocks of A: by Lanczos' method in the form
// of conjugate gradients (Saad 2003, section 6.7.3), whose coefficients are those of a tridiagonal
// matrix with nearly the same extreme eigenvalues. A few power iterations, in comparison, stay 10
// to 15 percent below it.
#pragma once

#include <taut/core/sparse/ritz_value.hpp>
#include <taut/mpm/level_operator.hpp>

#include <cmath>

namespace taut {

namespace kernels {

/// Numbers in [-1, 1] that follow from the place of a node alone.
template <class S>
KOKKOS_FUNCTION Vec3<double> scattered_numbers(GridNodes<S> const& nodes, int i) {
  Vec3<double> numbers;
  for (int c = 0; c < 3; ++c) {
    // From its numbers themselves: eight times a node far away would be too large for an int.
    unsigned h = LeafTable<S>::mix(nodes.ijk(i, 0), nodes.ijk(i, 1), nodes.ijk(i, 2)) +
                 0x9e3779b9u * static_cast<unsigned>(c + 1);
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    h ^= h >> 16;
    numbers[c] = 2 * (double(h) / 4294967295.0) - 1;
  }
  return numbers;
}
template <class S, class T>
struct ScatterNumbers {
  GridNodes<S> nodes;
  VectorField<T, S> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<double> const u = scattered_numbers(nodes, i);
    for (int c = 0; c < 3; ++c) to(i, c) = T(u[c]);
  }
};
/// L u, where L L' = D and u are such numbers: as much for every node by the norm of D^-1. Light
/// nodes, whose blocks may be 1e-10 of others, would be all that Lanczos starts from.
template <class S, class T>
struct ScatterResidual {
  GridNodes<S> nodes;
  BlockField<T, S> inverse;
  VectorField<T, S> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<double> const u = scattered_numbers(nodes, i);
    double m[6];
    for (int k = 0; k < 6; ++k) m[k] = double(inverse(i, k));
    // D^-1 = C C' with C upper triangular, and L = C^-T. Blocks were floored when inverted, so what
    // is smaller is round-off.
    auto const pivot = [](double rest, double all) {
      return Kokkos::sqrt(Kokkos::max(rest, 1e-7 * all));
    };
    double const zz = pivot(m[2], m[2]), yz = m[4] / zz, xz = m[5] / zz;
    double const yy = pivot(m[1] - yz * yz, m[1]), xy = (m[3] - xz * yz) / yy;
    double const xx = pivot(m[0] - xy * xy - xz * xz, m[0]);
    double const x = u[0] / xx, y = (u[1] - xy * x) / yy, z = (u[2] - xz * x - yz * y) / zz;
    to(i, 0) = T(x);
    to(i, 1) = T(y);
    to(i, 2) = T(z);
  }
};

/// (r - alpha y)' D^-1 (r - alpha y), which becomes r; and D^-1 r becomes y.
template <class S, class T>
struct LanczosResidual {
  BlockField<T, S> inverse;
  VectorField<T, S> r, y;
  T alpha;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sums) const { sums[0] += term(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION double term(int i) const {
    Vec3<T> residual = vector_of<T>(r, i);
    if (alpha != 0) residual = residual - alpha * vector_of<T>(y, i);
    Vec3<T> const z = block_times(inverse, i, residual);
    set_vector(r, i, residual);
    set_vector(y, i, z);
    return double(residual[0]) * double(z[0]) + double(residual[1]) * double(z[1]) +
           double(residual[2]) * double(z[2]);
  }
};

/// d = y + beta d
template <class S, class T>
struct LanczosDirection {
  VectorField<T, S> y, d;
  T beta;
  KOKKOS_FUNCTION void operator()(int i) const { step(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void step(int i) const {
    for (int c = 0; c < 3; ++c) d(i, c) = beta == 0 ? y(i, c) : y(i, c) + beta * d(i, c);
  }
};

/// r -= alpha y
template <class S, class T>
struct LanczosReduce {
  VectorField<T, S> r, y;
  T alpha;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (alpha == 0) return;
    for (int c = 0; c < 3; ++c) r(i, c) -= alpha * y(i, c);
  }
};

template <class S, class T>
struct VectorDot {
  VectorField<T, S> a, b;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sums) const { sums[0] += term(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION double term(int i) const {
    return double(a(i, 0)) * double(b(i, 0)) + double(a(i, 1)) * double(b(i, 1)) +
           double(a(i, 2)) * double(b(i, 2));
  }
};

/// d = scale z
template <class S, class T>
struct PowerNext {
  VectorField<T, S> z, d;
  T scale;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) d(i, c) = scale * z(i, c);
  }
};

}  // namespace kernels

/// `A` has a preconditioner of its own in the place of D^-1: z = M r, kept until the next call. It
/// is D^-1 where there are no patches.
template <class A>
concept PreconditionedLevel = LevelOperator<A> &&
    requires(A const& a, VectorField<typename A::Scalar, typename A::Space> const& r) {
  {
    a.preconditioned(r)
    } -> std::convertible_to<VectorField<typename A::Scalar, typename A::Space>>;
  { a.patches() } -> std::convertible_to<int>;
};

/// The largest eigenvalue of D^-1 A: a Ritz value and its residual, which is hardly ever below it,
/// after so many steps at most, or once that residual is less than `enough` of the value. Uses the
/// vectors r, d and y.
template <LevelOperator A, class T, class S>
double largest_eigenvalue(A const& a, LevelVectors<T, S> const& v, int steps = 20,
                          double enough = 0.05) {
  int const n = a.size();
  if (n == 0) return 1;
  Reducer<S> const reducer(n, 1);
  for_each<S>("lanczos_start", n, kernels::ScatterResidual<S, T>{a.nodes(), a.inverse(), v.r});
  LanczosByConjugates lanczos;
  kernels::LanczosResidual<S, T> residual{a.inverse(), v.r, v.y, T(0)};
  VectorField<T, S> z = v.y;
  auto const reduce = [&] {
    if constexpr (PreconditionedLevel<A>) {
      for_each<S>("lanczos_reduce", n, kernels::LanczosReduce<S, T>{v.r, v.y, residual.alpha});
      z = a.preconditioned(v.r);
      return reducer.template sum<1>("lanczos_residual", n, kernels::VectorDot<S, T>{v.r, z})[0];
    } else {
      return reducer.template sum<1>("lanczos_residual", n, residual)[0];
    }
  };
  double rho = reduce();
  double beta = 0;
  RitzValue found;
  for (int k = 0; k < steps; ++k) {
    for_each<S>("lanczos_direction", n, kernels::LanczosDirection<S, T>{z, v.d, T(beta)});
    a.product(v.d, v.y);
    double const form =
        reducer.template sum<1>("lanczos_form", n, kernels::VectorDot<S, T>{v.d, v.y})[0];
    if (!(form > 0 && rho > 0)) break;  // found everything, or A is not positive
    double const alpha = rho / form;
    residual.alpha = T(alpha);
    double const next = reduce();
    if (!std::isfinite(next)) break;
    beta = next / rho;
    rho = next;
    found = lanczos.add(alpha, beta);
    if (k > 0 && found.residual <= enough * found.value) break;
  }
  return found.value + found.residual;
}

/// The same by power iteration, until a step changes the Rayleigh quotient d'A D^-1 A d / d'A d by
/// less than `enough` of itself. Uses the vectors r, d and y.
template <LevelOperator A, class T, class S>
double largest_by_power(A const& a, LevelVectors<T, S> const& v, int max_steps,
                        double enough = 1e-6) {
  int const n = a.size();
  if (n == 0) return 1;
  for_each<S>("power_start", n, kernels::ScatterNumbers<S, T>{a.nodes(), v.d});
  double largest = 1;
  for (int k = 0; k < max_steps; ++k) {
    a.product(v.d, v.r);
    double const form =
        v.reducer.template sum<1>("power_form", n, kernels::VectorDot<S, T>{v.d, v.r})[0];
    // y = D^-1 r
    double next = 0;
    VectorField<T, S> z = v.y;
    if constexpr (PreconditionedLevel<A>) {
      z = a.preconditioned(v.r);
      next = v.reducer.template sum<1>("power_next", n, kernels::VectorDot<S, T>{v.r, z})[0];
    } else {
      next = v.reducer.template sum<1>(
          "power_next", n, kernels::LanczosResidual<S, T>{a.inverse(), v.r, v.y, T(0)})[0];
    }
    if (!(form > 0 && next > 0)) return largest;  // A is not positive, or zero along d
    double const quotient = next / form;
    bool const done = k > 0 && std::abs(quotient - largest) < enough * quotient;
    largest = quotient;
    if (done) break;
    // The energy norm of z is near that of d times the quotient: keep it where it was.
    for_each<S>("power_scale", n, kernels::PowerNext<S, T>{z, v.d, T(1 / quotient)});
  }
  return largest;
}

}  // namespace taut
