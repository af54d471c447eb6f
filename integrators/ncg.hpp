// Preconditioned nonlinear conjugate gradients (Algorithm 1 of the PNCG paper):
//   p = -P g + beta p + gamma P y,   x <- x + alpha p,
// with any beta, preconditioner, line search and stopping rule. Two passes over the unknowns per
// iteration: one for all scalar products, one for the direction.
//
// The curvature that alpha is made from is filtered, so that it is positive: where elements buckle
// it can be a hundred times what the energy has along p. Steps are short there, the next gradient
// is much like the last, and beta near or above 1. Such a step goes on along the same p instead, as
// far as the slopes at both its ends say.
#pragma once

#include <taut/integrators/beta.hpp>
#include <taut/integrators/conjugate_dots.hpp>
#include <taut/integrators/descent.hpp>
#include <taut/integrators/island_descent.hpp>
#include <taut/integrators/regions.hpp>

namespace taut {
namespace kernels {

/// p = -z + beta p + gamma w, and its products with the gradient and itself.
template <class P, class S>
struct ConjugateDirection {
  enum { g_p, p_p, p_M_p, count };
  PreconditionedGradient<P, S> preconditioned;
  VectorField<typename P::real, S> p;
  Array<typename P::real, S> mass;
  typename P::real beta, gamma;

  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Sum = typename P::sum;
    Vec3<typename P::real> next = -preconditioned.of_gradient(i);
    if (beta != 0) next = next + beta * load3<typename P::real>(p, i);
    if (gamma != 0) next = next + gamma * preconditioned.of_change(i);
    store3(p, i, next);
    auto const wide = convert<Sum>(next);
    Sum const pp = dot(wide, wide);
    sums[g_p] += dot(load3<Sum>(preconditioned.gradient, i), wide);
    sums[p_p] += pp;
    sums[p_M_p] += Sum(mass(i)) * pp;
  }
};

}  // namespace kernels

/// The directions of nonlinear CG.
template <class B, class P, class S>
class ConjugateDirections {
  static_assert(Beta<B>, "taut: Ncg's first argument must satisfy Beta (integrators/beta.hpp)");

public:
  using Precision = P;
  using Space = S;
  using Vectors = VectorField<typename P::real, S>;

  /// Without safeguard, s'y <= 0 is left to the formula.
  template <class Params>
  explicit ConjugateDirections(Params const& params)
      : beta_(params.beta),
        safeguard_(params.safeguard),
        by_regions_(params.splitting.by_regions) {}

  /// Memory for P g, unless P is pointwise.
  void resize(int n, bool pointwise) {
    z_ = pointwise ? Vectors() : z_memory_.resize("z", n);
    z_before_ = pointwise ? Vectors() : z_before_memory_.resize("z_before", n);
    if (by_regions_) regions_.resize(n);
  }

  /// Whether to go by islands (island_descent.hpp).
  template <class E, class M, class Params>
  bool splits(E& e, M const& preconditioner, Params const& params) const {
    if constexpr (DivisibleObjective<E>) {
      return params.splitting.by_islands && !params.splitting.by_regions &&
             preconditioner.pointwise() && e.scale().has_inertia && e.divisible() &&
             (e.bodies().count > 1 || !e.asleep().empty());
    } else {
      return false;
    }
  }
  template <class E, class M, class Search, class Rule, class Params>
  MinimiserReport minimise_split(E& e, VectorField<typename P::position, S> const& x,
                                 DescentFields<P, S>& fields, M& preconditioner,
                                 Search const& search, Rule& rule, Params const& params,
                                 Observer<P, S> const& observer) {
    if constexpr (DivisibleObjective<E>) {
      islands_.resize(e.bodies(), e.size());
      return IslandDescent(e, x, fields, islands_, preconditioner, beta_, search, rule,
                           params.budget, params.safeguard, observer)
          .run();
    } else {
      throw Error("this objective knows of no bodies: it cannot be minimised by islands");
    }
  }

  void start() { restart(); }
  void restart() { restarted_ = true; }

  template <class E, class M>
  Heading next(E& e, VectorField<typename P::position, S> const& x, DescentFields<P, S>& fields,
               M const& preconditioner, Step const& last, bool renewed) {
    kernels::PreconditionedGradient<P, S> preconditioned{
        fields.gradient, fields.gradient_before, preconditioner.curvature(), {}, {}};
    if (!preconditioner.pointwise()) {
      std::swap(z_, z_before_);
      preconditioner.apply(fields.gradient, z_);
      if (renewed && !restarted_) preconditioner.apply(fields.gradient_before, z_before_);
      preconditioned.z = z_;
      preconditioned.z_before = z_before_;
    }

    if constexpr (RegionalObjective<E>) {
      if (by_regions_ && restarted_) two_regions_ = regions_.divide(e, x);
      if (two_regions_) {
        restarted_ = false;
        return regions_.next(e, x, fields, preconditioned, beta_, safeguard_, last.length);
      }
    }

    using Dot = kernels::ConjugateDots<P, S>;
    auto const sums = fields.reducer.template sum<Dot::count>(
        "conjugate_dots", fields.size(), Dot{preconditioned, fields.direction, fields.mass});
    dots_.g_P_g = dots_.g1_P1_g1;
    dots_.g_g = dots_.g1_g1;
    dots_.g1_P1_g1 = double(sums[Dot::g_P_g]);
    dots_.g1_P1_y = double(sums[Dot::g_P_y]);
    dots_.y_P1_y = double(sums[Dot::y_P_y]);
    dots_.g_P1_g = double(sums[Dot::before_P_before]);
    dots_.g1_p = double(sums[Dot::g_p]);
    dots_.y_p = double(sums[Dot::y_p]);
    dots_.g1_g1 = double(sums[Dot::g_g]);
    dots_.alpha = last.length;

    if (still_steep(last)) return go_on(last, double(sums[Dot::g_Minv_g]));
    Heading heading;
    Coefficients kept;
    if (!restarted_) {
      kept = beta_(dots_);
      bool const finite = std::isfinite(kept.beta) && std::isfinite(kept.gamma);
      heading.lost = safeguard_.on && (dots_.y_p <= 0 || !finite);
      if (heading.lost) kept = {};
    }
    restarted_ = false;
    heading.beta = kept.beta;
    heading.gamma = kept.gamma;
    heading.steepest = kept.beta == 0 && kept.gamma == 0;
    heading.descent = dots_.g1_P1_g1;
    heading.gradient = double(sums[Dot::g_Minv_g]);

    using Update = kernels::ConjugateDirection<P, S>;
    auto const products = fields.reducer.template sum<Update::count>(
        "conjugate_direction", fields.size(),
        Update{preconditioned, fields.direction, fields.mass, typename P::real(kept.beta),
               typename P::real(kept.gamma)});
    dots_.g_p = heading.slope = double(products[Update::g_p]);
    dots_.p_p = double(products[Update::p_p]);
    heading.metric = metric_ = double(products[Update::p_M_p]);
    return heading;
  }

private:
  /// Whether the energy falls on along p, at the end of the last step, nearly as it did at its
  /// beginning (Wolfe's curvature condition does not hold).
  bool still_steep(Step const& last) const {
    bool const whole = last.evaluated && !last.cut && last.backtracks == 0 && last.length > 0;
    return safeguard_.on && !restarted_ && whole && dots_.g1_p < safeguard_.still_steep * dots_.g_p;
  }
  /// The same p again, as far as the change of the slope along it says that its minimum is.
  Heading go_on(Step const& last, double gradient) {
    double const curvature = dots_.y_p / last.length, farthest = safeguard_.stretch * last.length;
    Heading heading;
    heading.goes_on = true;
    heading.slope = dots_.g_p = dots_.g1_p;
    heading.descent = -heading.slope;
    heading.metric = metric_;
    heading.gradient = gradient;
    heading.beta = 1;
    heading.first_length =
        curvature * farthest > -heading.slope ? -heading.slope / curvature : farthest;
    return heading;
  }

  B beta_;
  Safeguard safeguard_;
  bool by_regions_;
  bool restarted_ = true, two_regions_ = false;
  Dots dots_;
  double metric_ = 0;  ///< p'M p
  Vectors z_, z_before_;
  Resizable<Vectors> z_memory_, z_before_memory_;
  Islands<P, S> islands_;
  RegionDirections<P, S> regions_;
};

template <class Beta, class Preconditioner, class LineSearch, class Stopping>
struct NcgComposition {
  Beta beta = {};
  typename Preconditioner::Params preconditioner = {};
  typename LineSearch::Params line_search = {};
  typename Stopping::Params stop = {};
  Budget budget = {};
  Safeguard safeguard = {};
  Splitting splitting = {};
};

/// For example Ncg<DaiKou, BlockJacobi>, whose Params are {.beta = .., .preconditioner = .., and so
/// on}.
template <class Beta, template <class...> class Preconditioner,
          class LineSearch = SufficientDecrease, class Stopping = DecrementWindow,
          class Precision = Mixed, class Space = DefaultSpace>
using Ncg =
    DescentMinimiser<ConjugateDirections<Beta, Precision, Space>, Preconditioner<Precision, Space>,
                     LineSearch, Stopping,
                     NcgComposition<Beta, Preconditioner<Precision, Space>, LineSearch, Stopping>>;

}  // namespace taut
