// Linear systems H p = b inside a minimiser: preconditioned conjugate gradients (Hestenes and
// Stiefel 1952) on the assembled Hessian or on products that are never assembled.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/integrators/fields.hpp>
#include <taut/integrators/holds_hessian.hpp>
#include <taut/integrators/preconditioner.hpp>

#include <algorithm>
#include <cmath>

namespace taut {

/// Why a linear solve ended.
enum class LinearStop {
  converged,
  budget,     ///< of iterations
  truncated,  ///< p'Hp was lost in round-off, or P is not positive: no iterate is better
  failed      ///< there is no solution: a direct solver found H singular or indefinite
};

struct LinearReport {
  LinearStop stop = LinearStop::failed;
  int iterations = 0;
  double residual = 1;  ///< |r| / |b| in the norm r'P r; known only to iterative solvers
};

/// How exact a solution is to be: a relative residual, in the norm |r| = sqrt(r'P r) of the
/// preconditioner; or where `scale` is not 0, min(relative, sqrt(max(scale |b|, least))), which is
/// known once the solver has taken that norm of b.
struct LinearTolerance {
  double relative;
  double scale = 0, least = 0;

  LinearTolerance(double relative_) : relative(relative_) {}
  LinearTolerance(double relative_, double scale_, double least_)
      : relative(relative_), scale(scale_), least(least_) {}
  double of(double norm_of_b) const {
    if (scale == 0) return relative;
    return std::min(relative, std::sqrt(std::max(scale * norm_of_b, least)));
  }
};

/// `L` solves with the Hessian of the Objective `E`, helped by the Preconditioner `M`.
template <class L, class E, class M>
concept LinearSolver = requires(
    L& solver, E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
    VectorField<typename E::Precision::real, typename E::Space> const& b, M const& preconditioner,
    LinearTolerance const& tolerance) {
  typename L::Params;
  {L(typename L::Params())};
  /// Memory for a minimisation of e.
  {solver.start(e)};
  /// H(x) p = b to a relative residual of `tolerance`; p is the last argument, its old value is of
  /// no account.
  { solver.solve(e, x, b, preconditioner, tolerance, b) } -> std::same_as<LinearReport>;
};

namespace kernels {

/// p'Hp and the sum of the moduli of its terms, against which it is judged.
template <class P, class S>
struct CurvatureAlong {
  enum { form, moduli, count };
  VectorField<typename P::real, S> d, hd;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, count>& sums) const {
    for (int c = 0; c < 3; ++c) {
      double const term = double(d(i, c)) * double(hd(i, c));
      sums[form] += term;
      sums[moduli] += Kokkos::abs(term);
    }
  }
};

/// p += alpha d, r -= alpha H d
template <class P, class S>
struct ConjugateStep {
  using Real = typename P::real;
  VectorField<Real, S> p, r, d, hd;
  Real alpha;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      p(i, c) += alpha * d(i, c);
      r(i, c) -= alpha * hd(i, c);
    }
  }
};

/// d = z + beta d
template <class P, class S>
struct ConjugateTurn {
  using Real = typename P::real;
  VectorField<Real, S> d, z;
  Real beta;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) d(i, c) = z(i, c) + beta * d(i, c);
  }
};

template <class P, class S>
struct WideDot {
  VectorField<typename P::real, S> a, b;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sums) const {
    for (int c = 0; c < 3; ++c) sums[0] += double(a(i, c)) * double(b(i, c));
  }
};

}  // namespace kernels

/// Preconditioned conjugate gradients from zero. Each iterate lowers the energy 1/2 p'Hp - b'p of
/// the model, so that the last one is the best and always a descent direction for b = -g.
template <class P, class S>
class ConjugateGradients {
public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;

  /// p'Hp counts as lost where it is smaller by this factor than its terms, or than what the
  /// stiffest direction so far would have given.
  static constexpr double lost = 16 * double(Kokkos::Experimental::epsilon_v<Real>);

  void resize(int n) {
    if (int(r_.extent(0)) == n) return;
    r_ = memory_[0].resize("cg_residual", n);
    z_ = memory_[1].resize("cg_preconditioned", n);
    d_ = memory_[2].resize("cg_direction", n);
    hd_ = memory_[3].resize("cg_product", n);
    reducer_.provide(n, 2);
  }

  /// `product(d, hd)` makes hd = H d; `preconditioner.apply(r, z)` makes z = P r. `flexible`: with
  /// beta = z'(r - r_before) / z_before'r_before (Notay 2000), for a P that is not the same
  /// operator each time (solves of its own that stop at a tolerance); one more scalar product.
  template <class Product, class M>
  LinearReport solve(Product const& product, M const& preconditioner, Vectors const& b,
                     LinearTolerance const& tolerance, int max_iterations, Vectors const& p,
                     bool flexible = false) const {
    int const n = static_cast<int>(b.extent(0));
    assign_on<S>(p, Real(0));
    assign_on<S>(r_, b);
    preconditioner.apply(r_, z_);
    assign_on<S>(d_, z_);
    double const first = dot(r_, z_);
    LinearReport report{.stop = LinearStop::converged, .residual = 0};
    if (first == 0) return report;

    double const asked = tolerance.of(std::sqrt(first));
    double r_P_r = first;
    double d_Pinv_d = first;  // the length of d in the metric in which the curvatures are near 1
    double stiffest = 0;
    for (;; ++report.iterations) {
      report.residual = std::sqrt(r_P_r / first);
      if (report.residual <= asked) return report;
      if (report.iterations == max_iterations) {
        report.stop = LinearStop::budget;
        return report;
      }
      product(d_, hd_);
      using Curvature = kernels::CurvatureAlong<P, S>;
      auto const sums =
          reducer_.template sum<Curvature::count>("cg_curvature", n, Curvature{d_, hd_});
      double const curvature = sums[Curvature::form];
      double const terms = std::max(sums[Curvature::moduli], stiffest * d_Pinv_d);
      if (!(r_P_r > 0) || !(curvature > lost * terms)) {
        if (report.iterations == 0) assign_on<S>(p, z_);
        report.stop = LinearStop::truncated;
        return report;
      }
      stiffest = std::max(stiffest, curvature / d_Pinv_d);
      double const alpha = r_P_r / curvature;
      for_each<S>("cg_step", n, kernels::ConjugateStep<P, S>{p, r_, d_, hd_, Real(alpha)});

      preconditioner.apply(r_, z_);
      double const before = r_P_r;
      r_P_r = dot(r_, z_);
      // What r has changed by is -alpha H d.
      double const beta = (flexible ? -alpha * dot(z_, hd_) : r_P_r) / before;
      d_Pinv_d = r_P_r + beta * beta * d_Pinv_d;
      for_each<S>("cg_turn", n, kernels::ConjugateTurn<P, S>{d_, z_, Real(beta)});
    }
  }

private:
  double dot(Vectors const& a, Vectors const& b) const {
    int const n = static_cast<int>(a.extent(0));
    return reducer_.template sum<1>("cg_dot", n, kernels::WideDot<P, S>{a, b})[0];
  }

  Vectors r_, z_, d_, hd_;
  Resizable<Vectors> memory_[4];
  Reducer<S> reducer_;
};

/// H(x) in a matrix whose pattern is made anew where it has changed.
template <class P, class S>
class HessianMatrix {
public:
  /// Another objective, perhaps.
  void forget() { version_ = -1; }
  template <class E>
  BlockCsr<S, double> const& at(E& e, VectorField<typename P::position, S> const& x) {
    std::int64_t const version = e.pattern_version(x);
    if (version != version_) matrix_ = e.pattern(x);
    version_ = version;
    e.assemble(x, matrix_);
    return matrix_;
  }
  BlockCsr<S, double> const& operator()() const { return matrix_; }

private:
  BlockCsr<S, double> matrix_;
  std::int64_t version_ = -1;
};

/// H(x) as a matrix: pays where more than a few products are taken at one x.
template <class P, class S>
class AssembledHessian {
public:
  template <class E>
  void start(E&) {
    matrix_.forget();
  }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    matrix_.at(e, x);
  }
  void product(VectorField<typename P::real, S> const& d,
               VectorField<typename P::real, S> const& hd) const {
    taut::product(matrix_(), d, hd);
  }
  template <class E>
  void product(E&, VectorField<typename P::position, S> const&,
               VectorField<typename P::real, S> const& d,
               VectorField<typename P::real, S> const& hd) const {
    product(d, hd);
  }

private:
  HessianMatrix<P, S> matrix_;
};

/// H(x) as a sweep over the elements per product: no memory.
template <class P, class S>
class MatrixFreeHessian {
public:
  template <class E>
  void start(E&) {}
  template <class E>
  void update(E&, VectorField<typename P::position, S> const&) {}
  template <class E>
  void product(E& e, VectorField<typename P::position, S> const& x,
               VectorField<typename P::real, S> const& d,
               VectorField<typename P::real, S> const& hd) const {
    e.product(x, d, hd);
  }
};

/// Conjugate gradients as a policy of minimisers. A preconditioner that holds the Hessian of the
/// iterate lends it.
template <class P, class S, template <class, class> class Hessian>
class Pcg {
public:
  using Vectors = VectorField<typename P::real, S>;

  struct Params {
    int max_iterations = 2000;
    bool flexible = false;  ///< see ConjugateGradients
  };
  Pcg() : Pcg(Params()) {}
  explicit Pcg(Params const& params) : params_(params) {}

  template <class E>
  void start(E& e) {
    hessian_.start(e);
    cg_.resize(e.size());
  }
  template <class E, class M>
  LinearReport solve(E& e, VectorField<typename P::position, S> const& x, Vectors const& b,
                     M const& preconditioner, LinearTolerance const& tolerance, Vectors const& p) {
    bool held = false;
    if constexpr (HoldsHessian<M, Vectors>) held = preconditioner.holds_hessian();
    if (!held) hessian_.update(e, x);
    auto const product = [&](Vectors const& d, Vectors const& hd) {
      if constexpr (HoldsHessian<M, Vectors>) {
        if (held) return preconditioner.hessian_product(d, hd);
      }
      hessian_.product(e, x, d, hd);
    };
    return cg_.solve(product, preconditioner, b, tolerance, params_.max_iterations, p,
                     params_.flexible);
  }

private:
  Params params_;
  Hessian<P, S> hessian_;
  ConjugateGradients<P, S> cg_;
};

template <class P = Mixed, class S = DefaultSpace>
using AssembledPcg = Pcg<P, S, AssembledHessian>;
template <class P = Mixed, class S = DefaultSpace>
using MatrixFreePcg = Pcg<P, S, MatrixFreeHessian>;

}  // namespace taut
