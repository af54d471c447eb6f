// The stiffness of IPC, one K for all pairs, that adapts to the scene (Li et al. 2020, supplement,
// section 4): where a step begins with pairs in contact, the K that balances the gradients of the
// barrier and of all else,
//
//   K = - g_B'g_E / g_B'g_B,   within [K_low, 100 K_low],   K_low b''(1e-8 l) = 1e11 m / h^2,
//
// l being the diagonal of the box around the surface at rest and m the mean mass of a vertex. IPC
// doubles K in an iteration that leaves a gap below 1e-9 l; here a term is one function of x within
// a step, so the next step begins with the largest K instead. For comparison: one K serves bodies
// of one kind only, and the gap at rest depends on the step.
#pragma once

#include <taut/contact/barrier.hpp>
#include <taut/contact/stiffness.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/term.hpp>

#include <algorithm>

namespace taut {

/// What a step begins with, as an adaptive rule looks at it.
struct StiffnessBalance {
  double push = 0;       ///< -g_B'g_E, N^2 per N/m: g_B of K = 1
  double square = 0;     ///< g_B'g_B
  double gap = 0;        ///< the smallest, m; that of dhat where nothing acts
  double inertia = 0;    ///< m / h^2, N/m
  double size = 0;       ///< l, m
  double curvature = 0;  ///< b''(1e-8 l) of the barrier
};

/// A rule that is told of the balance at the beginning of each step, if it `adapts`. `reset` makes
/// it K = 1 for the gradient that the balance is made of.
template <class R>
concept AdaptiveRule = requires(R& rule, R const& c, StiffnessBalance const& balance) {
  { c.adapts() } -> std::same_as<bool>;
  {rule.reset()};
  {rule.adapt(balance)};
};

struct IpcAdaptiveStiffness {
  static constexpr char const* name = "ipc_adaptive";
  static constexpr bool per_vertex = true;                        // to be told when a step begins
  static constexpr double tiny_gap = 1e-9, tiny_distance = 1e-8;  ///< of l
  double stiffness = 1;                                           ///< K, N/m

  bool valid() const { return stiffness > 0; }
  bool adapts() const { return true; }

  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const&, PairKind, int const (&)[4]) const {
    return stiffness;
  }
  template <class Fields>
  KOKKOS_FUNCTION double vertex(Fields const&, int) const {
    return stiffness;
  }

  void reset() { stiffness = 1; }
  void adapt(StiffnessBalance const& b) {
    double const low = 1e11 * b.inertia / b.curvature, high = 100 * low;
    double const balanced = b.square > 0 ? b.push / b.square : low;
    stiffness = b.gap < tiny_gap * b.size ? high : std::clamp(balanced, low, high);
  }
};

namespace kernels {

/// g_B'g_E and g_B'g_B.
template <class Precision, class S>
struct BalanceOfGradients {
  VectorField<typename Precision::real, S> barrier, rest;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    for (int c = 0; c < 3; ++c) {
      double const b = double(barrier(i, c));
      sums[0] += b * double(rest(i, c));
      sums[1] += b * b;
    }
  }
};

}  // namespace kernels

/// The balance of a term with this barrier whose rule has been reset, where a step begins: its own
/// gradient against that of all terms that are not told. `size`: l, m.
template <Barrier B, class Term, class Precision, class S>
StiffnessBalance balance_of(B const& barrier, Term const& term,
                            StepStart<Precision, S> const& start, FixedMask<S> const& fixed,
                            double size) {
  int const n = static_cast<int>(start.x.extent(0));
  VectorField<typename Precision::real, S> const g("adaptive_gradient", n);
  term.add_gradient(start.x, 1, fixed, g);
  Reducer<S, double> const reducer(n, 2);
  auto const sums = reducer.template sum<2>(
      "adaptive_balance", n, kernels::BalanceOfGradients<Precision, S>{g, start.gradient});
  double const dhat = term.dhat();
  double const distance = std::min(IpcAdaptiveStiffness::tiny_distance * size, 0.5 * dhat);
  return {-sums[0] / start.scale,
          sums[1],
          term.report(start.x).smallest_gap * dhat,
          start.mean_mass / (start.time_step * start.time_step),
          size,
          evaluate_barrier(barrier, distance, dhat).curvature};
}

}  // namespace taut
