// Projected Newton: p = -H(x)^-1 g with H the positive semi-definite Hessian of the objective,
// solved inexactly (Dembo, Eisenstat and Steihaug 1982), and a line search from alpha = 1. Near a
// minimum where nothing is projected the error squares in each step; with an exact enough solve it
// ends at round-off, which makes it the reference that other methods are measured against.
#pragma once

#include <taut/integrators/characteristic_norm.hpp>
#include <taut/integrators/descent.hpp>
#include <taut/integrators/linear_solver.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut {

/// What a rule for how exactly to solve knows of a gradient.
struct GradientNorms {
  double weighted;  ///< sqrt(g' M^-1 g)
  double plain;     ///< sqrt(g'g)
};

/// How exactly a Newton direction is asked for: to a relative residual of
///   eta_k = gamma (|g_k| / |g_k-1|)^exponent,
/// but not below gamma eta_k-1^exponent while that exceeds 0.1 (Eisenstat and Walker 1996, choice
/// 2). Loose far from the minimum, and tight enough near it to keep the order of convergence.
class ForcingTerm {
public:
  struct Params {
    double largest = 0.1;  ///< and the first one; the only one if `fixed`
    double least = 1e-8;
    double gamma = 0.9;
    double exponent = 2;
    bool fixed = false;
  };
  explicit ForcingTerm(Params const& params) : params_(params) {}

  template <class E>
  void start(E&) {}
  void restart() { norm_before_ = 0; }
  /// Before the step.
  LinearTolerance operator()(GradientNorms const& norms) {
    double const norm = norms.weighted;
    double eta = params_.largest;
    if (norm_before_ > 0 && !params_.fixed) {
      eta = params_.gamma * std::pow(norm / norm_before_, params_.exponent);
      double const safeguard = params_.gamma * std::pow(eta_before_, params_.exponent);
      if (safeguard > 0.1) eta = std::max(eta, safeguard);
      eta = std::clamp(eta, params_.least, params_.largest);
    }
    norm_before_ = norm;
    eta_before_ = eta;
    return eta;
  }

private:
  Params params_;
  double norm_before_ = 0, eta_before_ = 0;
};

/// HOT's rule (Wang et al. 2020, section 6; after Gast et al. 2015): to a relative residual of
///   min(largest, sqrt(max(|r|, tau))),
/// with r the residual of momentum, g / h, and tau what is small for all unknowns together, the
/// tolerance times sqrt(n) times the largest characteristic force (of an unknown) over a step.
class RootForcing {
public:
  struct Params {
    double largest = 0.5;
    double tolerance = 1e-7;  ///< that of CharacteristicNorm
  };
  explicit RootForcing(Params const& params) : params_(params) {}

  template <class E>
  void start(E& e) {
    double const h = e.scale().time_step;
    double const most = largest_characteristic_force(e);
    tolerance_ = {params_.largest, 1 / h,
                  params_.tolerance * std::sqrt(double(e.size())) * h * most};
  }
  void restart() {}
  LinearTolerance operator()(GradientNorms const&) const { return tolerance_; }

private:
  Params params_;
  LinearTolerance tolerance_ = 0.5;
};

/// The rule of Gast et al. 2015 (as Wang et al. 2020 compare with it): to a relative residual of
///   min(largest, sqrt(max(|r|, tolerance))),
/// where |r| is the plain norm of the residual of momentum, g / h, in kg m/s, and the tolerance
/// that of MomentumNorm: a number of each scene's own.
class MomentumForcing {
public:
  struct Params {
    double largest = 0.5;
    double tolerance = 1e-3;  ///< kg m/s
  };
  explicit MomentumForcing(Params const& params) : params_(params) {}

  template <class E>
  void start(E& e) {
    per_step_ = 1 / e.scale().time_step;
  }
  void restart() {}
  LinearTolerance operator()(GradientNorms const& norms) const {
    return std::min(params_.largest,
                    std::sqrt(std::max(per_step_ * norms.plain, params_.tolerance)));
  }

private:
  Params params_;
  double per_step_ = 1;
};

namespace kernels {

/// g' M^-1 g, g'g and b = -g.
template <class P, class S>
struct NewtonRightHandSide {
  enum { weighted, plain, count };
  VectorField<typename P::real, S> g, b;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, count>& sums) const {
    double square = 0;
    for (int c = 0; c < 3; ++c) {
      b(i, c) = -g(i, c);
      square += double(g(i, c)) * double(g(i, c));
    }
    if (square != 0) sums[weighted] += square / double(mass(i));
    sums[plain] += square;
  }
};

/// g'p and p'M p.
template <class P, class S>
struct NewtonProducts {
  enum { slope, metric, count };
  VectorField<typename P::real, S> g, p;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, count>& sums) const {
    for (int c = 0; c < 3; ++c) {
      sums[slope] += double(g(i, c)) * double(p(i, c));
      sums[metric] += double(mass(i)) * double(p(i, c)) * double(p(i, c));
    }
  }
};

}  // namespace kernels

/// A stopping rule that also stops where round-off does: the decrement is tiny (against the largest
/// so far, or against the mass moved by a length) and has not halved for some steps.
template <Stopping Rule, class Real>
class UntilRoundOff : public Rule {
public:
  using Rule::Rule;

  void start(Scale const& scale) {
    Rule::start(scale);
    largest_ = 0.5 * scale.mass * scale.length * scale.length;
    forget();
  }
  void forget() {
    Rule::forget();
    smallest_ = std::numeric_limits<double>::infinity();
    idle_steps_ = 0;
  }
  Stop check(Progress const& progress) {
    double const decrement = std::abs(progress.attainable);
    bool const idle = decrement > 0.5 * smallest_ && decrement < epsilon * largest_;
    idle_steps_ = idle ? idle_steps_ + 1 : 0;
    smallest_ = std::min(smallest_, decrement);
    largest_ = std::max(largest_, decrement);
    Stop const stop = Rule::check(progress);
    return stop == Stop::none && idle_steps_ == 3 ? Stop::stalled : stop;
  }

private:
  static constexpr double epsilon = double(Kokkos::Experimental::epsilon_v<Real>);
  double smallest_ = 0, largest_ = 0;
  int idle_steps_ = 0;
};

struct NewtonReport : MinimiserReport {
  int linear_iterations = 0;  ///< products with the Hessian, in all steps
  int linear_failures = 0;    ///< steps along -P g, because the linear solver had found no descent
};

inline NewtonReport in_sequence(NewtonReport const& first, NewtonReport const& second) {
  MinimiserReport const &a = first, &b = second;
  return {in_sequence(a, b), first.linear_iterations + second.linear_iterations,
          first.linear_failures + second.linear_failures};
}

/// The directions of Newton's method.
template <class Linear, class P, class S, class Forcing = ForcingTerm>
class NewtonDirections {
public:
  NewtonDirections(typename Linear::Params const& linear, typename Forcing::Params const& forcing)
      : linear_(linear), forcing_(forcing) {}

  void resize(int n) {
    b_ = b_memory_.resize("newton_rhs", n);
    reducer_.provide(n, Products::count);
  }

  /// A new minimisation, perhaps of another objective.
  void start() {
    started_ = false;
    linear_iterations_ = linear_failures_ = 0;
    restart();
  }
  void restart() { forcing_.restart(); }

  template <class E, class M>
  Heading next(E& e, VectorField<typename P::position, S> const& x, DescentFields<P, S>& fields,
               M const& preconditioner, Step const&, bool) {
    if (!started_) {
      linear_.start(e);
      forcing_.start(e);
    }
    started_ = true;
    // There is no past in a Newton direction, so nothing else could be tried where it fails.
    Heading heading{.first_length = 1, .steepest = true, .solved = true};
    auto const& p = fields.direction;
    using RightHandSide = kernels::NewtonRightHandSide<P, S>;
    auto const squares = reducer_.template sum<RightHandSide::count>(
        "newton_rhs", e.size(), RightHandSide{fields.gradient, b_, fields.mass});
    heading.gradient = squares[RightHandSide::weighted];

    LinearTolerance const tolerance =
        forcing_({std::sqrt(heading.gradient), std::sqrt(squares[RightHandSide::plain])});
    LinearReport const linear = linear_.solve(e, x, b_, preconditioner, tolerance, p);
    linear_iterations_ += linear.iterations;
    auto sums = products(fields);
    if (linear.stop == LinearStop::failed || sums[Products::slope] > 0) {
      ++linear_failures_;
      heading.solved = false;
      preconditioner.apply(b_, p);
      sums = products(fields);
    }
    heading.slope = sums[Products::slope];
    heading.metric = sums[Products::metric];
    heading.descent = std::abs(heading.slope);
    heading.shortened = !heading.solved || linear.residual > std::max(tolerance.relative, unsolved);
    return heading;
  }

  int linear_iterations() const { return linear_iterations_; }
  int linear_failures() const { return linear_failures_; }

private:
  using Products = kernels::NewtonProducts<P, S>;
  /// Relative residual of a solve whose decrement says too little about what remains.
  static constexpr double unsolved = 0.2;

  Sums<double, Products::count> products(DescentFields<P, S> const& fields) const {
    return reducer_.template sum<Products::count>(
        "newton_products", fields.size(), Products{fields.gradient, fields.direction, fields.mass});
  }

  Linear linear_;
  Forcing forcing_;
  VectorField<typename P::real, S> b_;  ///< -g
  Resizable<VectorField<typename P::real, S>> b_memory_;
  Reducer<S> reducer_;
  bool started_ = false;
  int linear_iterations_ = 0, linear_failures_ = 0;
};

/// Steps that a line search may refuse along a Newton direction.
inline constexpr int newton_backtracks = 30;

/// For example Newton<AssembledPcg, BlockJacobi>.
template <template <class...> class LinearSolver_ = AssembledPcg,
          template <class...> class Preconditioner_ = BlockJacobi,
          class LineSearch_ = SufficientDecrease, Stopping Stopping_ = DecrementWindow,
          class Precision_ = Mixed, class Space_ = DefaultSpace, class Forcing = ForcingTerm>
class Newton {
public:
  using Precision = Precision_;
  using Space = Space_;
  using Linear = LinearSolver_<Precision, Space>;
  using Preconditioner = Preconditioner_<Precision, Space>;
  using Positions = VectorField<typename Precision::position, Space>;

  struct Params {
    typename Linear::Params linear = {};
    typename Forcing::Params forcing = {};
    typename Preconditioner::Params preconditioner = {};
    typename LineSearch_::Params line_search = many_backtracks();
    typename Stopping_::Params stop = one_step_window();
    Budget budget = {};
    Safeguard safeguard = {};
  };

  Newton() : Newton(Params()) {}
  explicit Newton(Params const& params)
      : params_(params),
        directions_(params.linear, params.forcing),
        preconditioner_(params.preconditioner),
        line_search_(params.line_search),
        stopping_(params.stop) {}

  /// Minimises e from x, in place.
  template <Objective E>
  NewtonReport minimise(E& e, Positions const& x, Observer<Precision, Space> const& observer = {}) {
    static_assert(
        std::same_as<typename E::Precision, Precision> && std::same_as<typename E::Space, Space>,
        "taut: a minimiser and its objective must have the same Precision and Space");
    static_assert(LinearSolver<Linear, E, Preconditioner>,
                  "taut: Newton's first argument must satisfy LinearSolver (linear_solver.hpp)");
    fields_.resize(e.size(), !e.scale().has_inertia);
    if (preconditioned_ != e.size()) {
      preconditioned_ = e.size();
      preconditioner_.resize(e.size());
      directions_.resize(e.size());
    }
    NewtonReport report{Descent(e, x, fields_, preconditioner_, directions_, line_search_,
                                stopping_, params_.budget, params_.safeguard, observer)
                            .run()};
    report.linear_iterations = directions_.linear_iterations();
    report.linear_failures = directions_.linear_failures();
    return report;
  }

  Params const& params() const { return params_; }

private:
  /// A Newton step is worth far more than the evaluations that it takes to shorten it.
  static typename LineSearch_::Params many_backtracks() {
    typename LineSearch_::Params params;
    if constexpr (requires { params.max_backtracks; }) params.max_backtracks = newton_backtracks;
    return params;
  }
  /// What the next steps gain is far less than what the last one did: no need to wait for more.
  static typename Stopping_::Params one_step_window() {
    typename Stopping_::Params params;
    if constexpr (requires { params.window; }) params.window = 1;
    return params;
  }

  Params params_;
  DescentFields<Precision, Space> fields_;
  int preconditioned_ = -1;  ///< unknowns that there is memory for
  NewtonDirections<Linear, Precision, Space, Forcing> directions_;
  Preconditioner preconditioner_;
  LineSearch_ line_search_;
  UntilRoundOff<Stopping_, typename Precision::real> stopping_;
};

}  // namespace taut
