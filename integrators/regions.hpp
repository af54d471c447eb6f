// Nonlinear CG by two regions of the unknowns: those on which contact acts where the past was last
// forgotten, and all others, each with a direction weight and a step of its own (Shen et al. 2024,
// section 4, its second form, there without detail):
//
//   p_R = -P g_R + beta_R d + gamma_R P y_R,   d <- alpha_0 p_0 + alpha_1 p_1.
//
// Elements couple the regions. So weights are of all of the last d: beta_R has in its numerator the
// sums over R and in its denominator those over all, which makes each p_R conjugate to d, and their
// sum the direction of plain CG. (Weights of the parts of d, from sums over R alone, lose that: a
// chain that plain CG solves in 68 iterations took 2000.) And alpha minimises the quadratic model
// on all of the plane that the p_R span,
//
//   [ p_0'H p_0   p_0'H p_1 ] [alpha_0]     [ g'p_0 ]
//   [ p_0'H p_1   p_1'H p_1 ] [alpha_1] = - [ g'p_1 ],
//
// in which the step of plain CG lies as well: from where it is, none is better. (Bridson and Greif
// 2006, "A multipreconditioned conjugate gradient algorithm", truncated to the last direction.) It
// costs three p'Hp instead of one. Where filtering the curvature of elements has left the matrix
// indefinite, both take the step of their sum.
//
// Where contact acts on none or on all there is one region, and this is plain CG.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/integrators/beta.hpp>
#include <taut/integrators/conjugate_dots.hpp>
#include <taut/integrators/descent.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace kernels {

template <class S>
struct CountMarks {
  Array<int, S> mark;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const { sum[0] += mark(i); }
};

/// The sums of a pass, region after region.
template <class Pass, class T, class S>
struct SumByRegion {
  Pass pass;
  Array<int, S> region;
  KOKKOS_FUNCTION void operator()(int i, Sums<T, 2 * Pass::count>& sums) const {
    Sums<T, Pass::count> own;
    pass(i, own);
    int const first = Pass::count * region(i);
    for (int k = 0; k < Pass::count; ++k) sums[first + k] += own[k];
  }
};

/// p = p_0 + p_1 in the place of d, and p_0; the products of p_0 and p with the gradient and
/// themselves.
template <class P, class S>
struct RegionDirection {
  enum { g_p0, g_p, p_p, p0_p, p0_p0, p_M_p, p0_M_p, p0_M_p0, count };
  PreconditionedGradient<P, S> preconditioned;
  VectorField<typename P::real, S> p, p0;
  Array<typename P::real, S> mass;
  Array<int, S> region;
  typename P::real beta[2], gamma[2];

  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Real = typename P::real;
    using Sum = typename P::sum;
    int const r = region(i);
    auto const d = load3<Real>(p, i);
    Vec3<Real> own = -preconditioned.of_gradient(i);
    if (gamma[r] != 0) own = own + gamma[r] * preconditioned.of_change(i);
    Vec3<Real> first = r == 0 ? own : Vec3<Real>{}, all = own;
    // What is forgotten may be anything.
    if (beta[0] != 0) first = first + beta[0] * d;
    if (beta[0] != 0 || beta[1] != 0) all = all + (beta[0] + beta[1]) * d;
    store3(p, i, all);
    store3(p0, i, first);
    auto const g = load3<Sum>(preconditioned.gradient, i), wide = convert<Sum>(all),
               part = convert<Sum>(first);
    Sum const products[3] = {dot(wide, wide), dot(part, wide), dot(part, part)};
    sums[g_p0] += dot(g, part);
    sums[g_p] += dot(g, wide);
    for (int k = 0; k < 3; ++k) {
      sums[p_p + k] += products[k];
      sums[p_M_p + k] += Sum(mass(i)) * products[k];
    }
  }
};

/// p_1 = p - p_0 in the place of p_0.
template <class P, class S>
struct OtherRegion {
  VectorField<typename P::real, S> p, part;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) part(i, c) = p(i, c) - part(i, c);
  }
};

/// p = a p + b p_1
template <class P, class S>
struct CombineRegions {
  VectorField<typename P::real, S> p, part;
  typename P::real a, b;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) p(i, c) = a * p(i, c) + b * part(i, c);
  }
};

}  // namespace kernels

/// d = alpha_0 p_0 + alpha_1 p_1; g'd and d'H d.
struct PlaneStep {
  double alpha[2] = {0, 0};
  double slope = 0, form = 0;
};
/// The way to the minimum over the plane of p_0 and p_1, from p_R'H p_R, that of their sum, and
/// g'p_R. It is as long as makes g'd = -`descent`: that of plain CG is -g'P g after an exact step,
/// on which some formulas for beta rely.
inline PlaneStep step_in_plane(double const (&form)[2], double form_of_sum,
                               double const (&slope)[2], double descent) {
  double const coupled = 0.5 * (form_of_sum - form[0] - form[1]);
  double const det = form[0] * form[1] - coupled * coupled;
  bool const definite = form[0] > 0 && form[1] > 0 && det > 1e-6 * form[0] * form[1];
  PlaneStep step{{1, 1}};
  if (definite) {
    step.alpha[0] = (coupled * slope[1] - form[1] * slope[0]) / det;
    step.alpha[1] = (coupled * slope[0] - form[0] * slope[1]) / det;
  }
  double const gained = -(step.alpha[0] * slope[0] + step.alpha[1] * slope[1]);
  double const scale = definite ? descent / gained : 1;
  for (double& a : step.alpha) a *= scale;
  step.slope = -scale * gained;
  step.form = definite ? scale * scale * gained : form_of_sum;
  return step;
}

/// The directions of nonlinear CG by regions; owns the memory of that.
template <class P, class S>
class RegionDirections {
public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;
  using Positions = VectorField<typename P::position, S>;

  void resize(int n) {
    region_ = region_memory_.resize("region", n);
    part_ = part_memory_.resize("region_part", n);
    reducer_ = Reducer<S, typename P::sum>(n, 2 * kernels::ConjugateDots<P, S>::count);
    counter_ = Reducer<S, double>(n, 1);
  }

  /// Divides the unknowns by what acts at x, and forgets the past; false if that makes one region.
  template <RegionalObjective E>
  bool divide(E& e, Positions const& x) {
    e.mark_acting(x, region_);
    int const n = region_.extent_int(0);
    double const marked =
        counter_.template sum<1>("region_marks", n, kernels::CountMarks<S>{region_})[0];
    restarted_ = true;
    return marked > 0 && marked < n;
  }

  /// Makes d of the gradient at x, after a step of `length` along the last d.
  template <class E, class B>
  Heading next(E& e, Positions const& x, DescentFields<P, S>& fields,
               kernels::PreconditionedGradient<P, S> const& preconditioned, B const& beta,
               Safeguard const& safeguard, double length) {
    Heading heading;
    Coefficients kept[2];
    weigh(heading, kept, fields, preconditioned, beta, safeguard, length);
    heading.beta = kept[0].beta + kept[1].beta;
    heading.gamma = std::max(kept[0].gamma, kept[1].gamma);
    heading.steepest = true;
    Update update{preconditioned, fields.direction, part_, fields.mass, region_, {}, {}};
    for (int r = 0; r < 2; ++r) {
      update.beta[r] = Real(kept[r].beta);
      update.gamma[r] = Real(kept[r].gamma);
      heading.steepest = heading.steepest && kept[r].beta == 0 && kept[r].gamma == 0;
    }
    auto const sums =
        reducer_.template sum<Update::count>("region_direction", fields.size(), update);
    double const slope[2] = {double(sums[Update::g_p0]),
                             double(sums[Update::g_p] - sums[Update::g_p0])};
    PlaneStep const step = lengthen(e, x, fields, slope);
    double const a = step.alpha[0], b = step.alpha[1] - a;  // d = a p + b p_1, p_1 = p - p_0
    auto const square_of_d = [&](int first) {
      double const pp = double(sums[first]), p0_p = double(sums[first + 1]),
                   p0_p0 = double(sums[first + 2]);
      return a * a * pp + 2 * a * b * (pp - p0_p) + b * b * (pp - 2 * p0_p + p0_p0);
    };
    heading.slope = step.slope;
    heading.form = step.form;
    heading.descent = dots_.g1_P1_g1;
    heading.metric = square_of_d(Update::p_M_p);
    dots_.g_p = heading.slope;
    dots_.p_p = square_of_d(Update::p_p);
    restarted_ = false;
    return heading;
  }

private:
  using Update = kernels::RegionDirection<P, S>;

  /// How much of the last direction each region keeps.
  template <class B>
  void weigh(Heading& heading, Coefficients (&kept)[2], DescentFields<P, S> const& fields,
             kernels::PreconditionedGradient<P, S> const& preconditioned, B const& beta,
             Safeguard const& safeguard, double length) {
    using Dot = kernels::ConjugateDots<P, S>;
    using ByRegion = kernels::SumByRegion<Dot, typename P::sum, S>;
    auto const sums = reducer_.template sum<2 * Dot::count>(
        "region_dots", fields.size(),
        ByRegion{{preconditioned, fields.direction, fields.mass}, region_});
    auto const of = [&](int r, int k) { return double(sums[Dot::count * r + k]); };
    auto const all = [&](int k) { return of(0, k) + of(1, k); };
    dots_.g_P_g = dots_.g1_P1_g1;
    dots_.g_g = dots_.g1_g1;
    dots_.g_P1_g = all(Dot::before_P_before);
    dots_.g1_p = all(Dot::g_p);
    dots_.y_p = all(Dot::y_p);
    dots_.alpha = length;
    heading.gradient = all(Dot::g_Minv_g);
    for (int r = 0; r < 2 && !restarted_; ++r) {
      Dots own = dots_;
      own.g1_P1_g1 = of(r, Dot::g_P_g);
      own.g1_P1_y = of(r, Dot::g_P_y);
      own.y_P1_y = of(r, Dot::y_P_y);
      own.g1_g1 = of(r, Dot::g_g);
      kept[r] = beta(own);
      bool const finite = std::isfinite(kept[r].beta) && std::isfinite(kept[r].gamma);
      heading.lost = heading.lost || (safeguard.on && (own.y_p <= 0 || !finite));
    }
    if (heading.lost) kept[0] = kept[1] = {};
    dots_.g1_P1_g1 = all(Dot::g_P_g);
    dots_.g1_g1 = all(Dot::g_g);
  }

  /// d of the p_R, in the place of their sum.
  template <class E>
  PlaneStep lengthen(E& e, Positions const& x, DescentFields<P, S>& fields,
                     double const (&slope)[2]) {
    if (slope[0] == 0 && slope[1] == 0) return {};
    Vectors const p = fields.direction;
    double form[2];
    double const form_of_sum = e.quadratic_form(x, p);
    form[0] = e.quadratic_form(x, part_);
    for_each<S>("other_region", fields.size(), kernels::OtherRegion<P, S>{p, part_});
    form[1] = e.quadratic_form(x, part_);
    PlaneStep const step = step_in_plane(form, form_of_sum, slope, dots_.g1_P1_g1);
    for_each<S>("combine_regions", fields.size(),
                kernels::CombineRegions<P, S>{p, part_, Real(step.alpha[0]),
                                              Real(step.alpha[1] - step.alpha[0])});
    return step;
  }

  Array<int, S> region_;  ///< 1 where contact acts
  Vectors part_;
  Resizable<Array<int, S>> region_memory_;
  Resizable<Vectors> part_memory_;
  Reducer<S, typename P::sum> reducer_;
  Reducer<S, double> counter_;
  Dots dots_;
  bool restarted_ = true;
};

}  // namespace taut
