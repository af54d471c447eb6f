// Smoothers: what a level does about errors that change from node to node. Each has a first half,
// from nothing, which also leaves the residual for the coarser level,
//
//   x = S b,   r = b - A x,
//
// and a second, x += S'(b - A x), so that a cycle that has them on its way down and up is
// symmetric.
#pragma once

#include <taut/mpm/level_operator.hpp>
#include <taut/mpm/spectrum.hpp>

namespace taut {
namespace kernels {

/// x_i = D^-1 (b_i - sum_j A_ij x_j), with the own block not in the sum.
template <class S, class T>
struct SolveNode {
  BlockField<T, S> inverse;
  VectorField<T, S> b, x;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const&, Vec3<T> const& sum) const {
    Vec3<T> const value = block_times(inverse, i, vector_of<T>(b, i) - sum);
    set_vector(x, i, value);
    return value;
  }
};

/// x_i += D^-1 (b_i - sum_j A_ij x_j)
template <class S, class T>
struct RelaxNode {
  BlockField<T, S> inverse;
  VectorField<T, S> b, x;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const& own,
                                                 Vec3<T> const& sum) const {
    Vec3<T> const value = own + block_times(inverse, i, vector_of<T>(b, i) - sum);
    set_vector(x, i, value);
    return value;
  }
};

/// t_i = b_i less what is before, x_i = D^-1 (t_i less what is after).
template <class S, class T>
struct RelaxForward {
  BlockField<T, S> inverse;
  VectorField<T, S> b, t, x;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const& before,
                                                 Vec3<T> const& after) const {
    Vec3<T> const left = vector_of<T>(b, i) - before;
    set_vector(t, i, left);
    Vec3<T> const value = block_times(inverse, i, left - after);
    set_vector(x, i, value);
    return value;
  }
};

/// The sweep back, from x with D x = t where nothing is after it: with t, x_i = D^-1 (t_i - sum_j
/// A_ij x_j), without, x_i -= D^-1 sum_j A_ij x_j; d_i = what x_i was less what it is.
template <class S, class T>
struct RelaxBack {
  BlockField<T, S> inverse;
  VectorField<T, S> t, x, d;
  bool with_t;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const&, Vec3<T> const& sum) const {
    Vec3<T> const was = vector_of<T>(x, i);
    Vec3<T> less, value;
    if (with_t) {
      value = block_times(inverse, i, vector_of<T>(t, i) - sum);
      less = was - value;
    } else {
      less = block_times(inverse, i, sum);
      value = was - less;
    }
    set_vector(x, i, value);
    set_vector(d, i, less);
    return value;
  }
};

/// r_i = sign sum_j A_ij x_j over some of the nodes.
template <class S, class T>
struct StoreSum {
  VectorField<T, S> x, r;
  T sign;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const&, Vec3<T> const& sum) const {
    set_vector(r, i, sign * sum);
    return vector_of<T>(x, i);
  }
};

/// One step of a recursion in D^-1 r: d = keep d + take D^-1 r, x += d, where r is `b` the first
/// time (and is set to it), and r - y after.
template <class S, class T>
struct RecursionStep {
  BlockField<T, S> inverse;
  VectorField<T, S> b, r, y, d, x;
  T keep, take;
  bool first;  ///< r = b, and x has nothing in it
  KOKKOS_FUNCTION void operator()(int i) const { step(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void step(int i) const {
    Vec3<T> const residual = first ? vector_of<T>(b, i) : vector_of<T>(r, i) - vector_of<T>(y, i);
    Vec3<T> next = take * block_times(inverse, i, residual);
    if (keep != 0) next = next + keep * vector_of<T>(d, i);
    set_vector(r, i, residual);
    set_vector(d, i, next);
    set_vector(x, i, first ? next : vector_of<T>(x, i) + next);
  }
};

/// The same in two parts, around z = M r: r = b, or r - y.
template <class S, class T>
struct RecursionResidual {
  VectorField<T, S> b, r, y;
  bool first;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) r(i, c) = first ? b(i, c) : r(i, c) - y(i, c);
  }
};
/// d = keep d + take z, x += d.
template <class S, class T>
struct RecursionUpdate {
  VectorField<T, S> z, d, x;
  T keep, take;
  bool first;
  KOKKOS_FUNCTION void operator()(int i) const { step(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void step(int i) const {
    for (int c = 0; c < 3; ++c) {
      T const next = keep == 0 ? take * z(i, c) : take * z(i, c) + keep * d(i, c);
      d(i, c) = next;
      x(i, c) = first ? next : x(i, c) + next;
    }
  }
};

/// Takes a step of a recursion, around M where the level has a preconditioner of its own that is
/// not D^-1 alone.
template <class A, class T, class S>
void take_step(A const& a, RecursionStep<S, T> const& step) {
  if constexpr (PreconditionedLevel<A>) {
    if (a.patches() > 0) {
      for_each<S>("smoother_residual", a.size(),
                  RecursionResidual<S, T>{step.b, step.r, step.y, step.first});
      auto const z = a.preconditioned(step.r);
      for_each<S>("smoother_step", a.size(),
                  RecursionUpdate<S, T>{z, step.d, step.x, step.keep, step.take, step.first});
      return;
    }
  }
  for_each<S>("smoother_step", a.size(), step);
}

/// r -= y
template <class S, class T>
struct SubtractProduct {
  VectorField<T, S> y, r;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) r(i, c) -= y(i, c);
  }
};

}  // namespace kernels

/// Block Gauss-Seidel forward on the way down and backward on the way up: symmetric as a pair, at
/// half the cost of symmetric sweeps. Nodes in the order of the colours of their blocks and in a
/// block in that of their numbers, so the result does not depend on the number of threads. Both
/// directions are params; where they are the same the cycle is not symmetric, which is for
/// stationary iterations, not for a metric.
struct ForwardBackward {
  static constexpr char const* name = "forward_backward";
  struct Params {
    bool down_backward = false;  ///< on the way down
    bool up_backward = true;     ///< on the way up
  };
  ForwardBackward() = default;
  explicit ForwardBackward(Params const& params) : params_(params) {}

  template <class A, class V>
  void setup(A const&, V&) {}

  template <class S, class T, int radius>
  void first(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v) const {
    using kernels::Part;
    bool const backward = params_.down_backward;
    Part const known = backward ? Part::after : Part::before;
    sweep_blocks("gauss_seidel_first", a.matrix(), v.x,
                 kernels::SolveNode<S, T>{a.inverse(), v.b, v.x}, known, true, backward);
    // (D + L) x = b leaves the residual -U x, and (D + U) x = b leaves -L x.
    Part const missed = backward ? Part::before : Part::after;
    sweep_blocks("gauss_seidel_missed", a.matrix(), v.x, kernels::StoreSum<S, T>{v.x, v.r, T(-1)},
                 missed, false, !backward);
  }
  template <class S, class T, int radius>
  void second(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v) const {
    sweep_blocks("gauss_seidel_second", a.matrix(), v.x,
                 kernels::RelaxNode<S, T>{a.inverse(), v.b, v.x}, kernels::Part::all, true,
                 params_.up_backward);
  }

private:
  Params params_;
};

/// Symmetric block Gauss-Seidel, (D + L) D^-1 (D + U), as HOT has it, in three halves of the matrix
/// on the way down and three on the way up: a sweep forward leaves t = b - L x, the one back takes
/// (D + U) x' = t, and what is left then is
///
///   b - (D + L + U) x' = L (x - x').
struct SymmetricGaussSeidel {
  static constexpr char const* name = "symmetric_gauss_seidel";
  struct Params {
    int sweeps = 1;
  };
  SymmetricGaussSeidel() : SymmetricGaussSeidel(Params()) {}
  explicit SymmetricGaussSeidel(Params const& params) : params_(params) {}

  template <class A, class V>
  void setup(A const&, V&) {}

  template <class S, class T, int radius>
  void first(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v) const {
    using kernels::Part;
    sweep_blocks("gauss_seidel_first", a.matrix(), v.x,
                 kernels::SolveNode<S, T>{a.inverse(), v.b, v.x}, Part::before, true, false);
    back(a, v, false);
    for (int k = 1; k < params_.sweeps; ++k) again(a, v);
    sweep_blocks("gauss_seidel_missed", a.matrix(), v.d, kernels::StoreSum<S, T>{v.d, v.r, T(1)},
                 Part::before, false, false);
  }
  template <class S, class T, int radius>
  void second(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v) const {
    for (int k = 0; k < params_.sweeps; ++k) again(a, v);
  }

private:
  template <class S, class T, int radius>
  static void again(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v) {
    relax_blocks("gauss_seidel_forward", a.matrix(), v.x,
                 kernels::RelaxForward<S, T>{a.inverse(), v.b, v.y, v.x});
    back(a, v, true);
  }
  template <class S, class T, int radius>
  static void back(MatrixLevel<S, T, radius> const& a, LevelVectors<T, S> const& v, bool with_t) {
    sweep_blocks("gauss_seidel_back", a.matrix(), v.x,
                 kernels::RelaxBack<S, T>{a.inverse(), v.y, v.x, v.d, with_t}, kernels::Part::after,
                 true, true);
  }

  Params params_;
};

/// Damped block Jacobi, x += damping D^-1 r. Converges where damping < 2 / lambda_max(D^-1 A),
/// which is 5 to 8 for quadratic B-splines.
struct DampedJacobi {
  static constexpr char const* name = "damped_jacobi";
  struct Params {
    double damping = 0.3;  ///< 0: 4/3 of 1 / lambda_max by Lanczos
    int sweeps = 1;
  };
  DampedJacobi() : DampedJacobi(Params()) {}
  explicit DampedJacobi(Params const& params) : params_(params), damping_(params.damping) {}

  template <LevelOperator A, class V>
  void setup(A const& a, V& v) {
    if (params_.damping == 0) damping_ = 4 / (3 * largest_eigenvalue(a, v));
  }
  template <class A, class T, class S>
  void first(A const& a, LevelVectors<T, S> const& v) const {
    run(a, v, true);
    a.residual(v.b, v.x, v.r);
  }
  template <class A, class T, class S>
  void second(A const& a, LevelVectors<T, S> const& v) const {
    run(a, v, false);
  }

private:
  template <class A, class T, class S>
  void run(A const& a, LevelVectors<T, S> const& v, bool from_nothing) const {
    for (int k = 0; k < params_.sweeps; ++k) {
      bool const first = from_nothing && k == 0;
      if (!first) {
        a.product(v.x, v.y);
        for_each<S>("jacobi_residual", a.size(), kernels::SubtractFrom<S, T>{v.b, v.y});
      }
      // The residual that the step takes is b, or what y has become; and nothing is taken off it.
      kernels::RecursionStep<S, T> step{a.inverse(), first ? v.b : v.y, v.r, v.y, v.d, v.x,
                                        T(0),        T(damping_),       true};
      if (first) {
        kernels::take_step(a, step);
      } else {
        step.x = v.d;
        kernels::take_step(a, step);
        for_each<S>("jacobi_add", a.size(), kernels::AddVectors<S, T>{v.d, v.x});
      }
    }
  }

  Params params_;
  double damping_;
};

/// The Chebyshev polynomial in D^-1 A that is smallest over [lambda_max / ratio, lambda_max] (Saad
/// 2003, algorithm 12.1): products alone, so the smoother of a level without a matrix.
struct Chebyshev {
  static constexpr char const* name = "chebyshev";
  struct Params {
    int degree = 3;
    double ratio = 30;  ///< of the largest eigenvalue to the least that is smoothed
    /// On the largest, of which Lanczos may see too little: of eleven scenes at worst 0.9 where it
    /// ends by itself, most often after eight steps. Above 1.033 of what this makes of it the
    /// polynomial is above 1, and a cycle that smooths with it may be indefinite.
    double safety = 1.15;
    int steps = 20;  ///< of Lanczos, at most
    /// Above 0: that many power steps at most instead, as HOT has it (512 there, and no safety).
    int power_steps = 0;
  };
  Chebyshev() : Chebyshev(Params()) {}
  explicit Chebyshev(Params const& params) : params_(params) {}

  /// The largest eigenvalue of D^-1 A.
  template <LevelOperator A, class V>
  void setup(A const& a, V& v) {
    double const found = params_.power_steps > 0 ? largest_by_power(a, v, params_.power_steps)
                                                 : largest_eigenvalue(a, v, params_.steps);
    largest_ = params_.safety * found;
  }
  double largest() const { return largest_; }

  template <class A, class T, class S>
  void first(A const& a, LevelVectors<T, S> const& v) const {
    run(a, v, true);
    a.product(v.d, v.y);
    for_each<S>("chebyshev_residual", a.size(), kernels::SubtractProduct<S, T>{v.y, v.r});
  }
  template <class A, class T, class S>
  void second(A const& a, LevelVectors<T, S> const& v) const {
    run(a, v, false);
  }

private:
  template <class A, class T, class S>
  void run(A const& a, LevelVectors<T, S> const& v, bool from_nothing) const {
    double const least = largest_ / params_.ratio;
    double const middle = (largest_ + least) / 2, half = (largest_ - least) / 2;
    double rho = half / middle;
    kernels::RecursionStep<S, T> step{a.inverse(), v.b,  v.r,           v.y,         v.d,
                                      v.x,         T(0), T(1 / middle), from_nothing};
    if (!from_nothing) {
      a.product(v.x, v.y);
      for_each<S>("chebyshev_start", a.size(), kernels::ConvertVectors<S, T, T>{v.b, v.r});
    }
    kernels::take_step(a, step);
    step.first = false;
    for (int k = 1; k < params_.degree; ++k) {
      double const next = 1 / (2 * middle / half - rho);
      step.keep = T(next * rho);
      step.take = T(2 * next / half);
      rho = next;
      a.product(v.d, v.y);
      kernels::take_step(a, step);
    }
  }
  Params params_;
  double largest_ = 1;
};

}  // namespace taut
