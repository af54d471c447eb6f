// Islands: sets of bodies that may act on each other. What one of them does is of no consequence to
// the others, so a minimiser may treat each as a problem of its own, at the cost of one.
//
// Labels are kept on the host: one number per body decides what a pass over unknowns does. Within a
// minimisation islands only grow: two that have been joined stay so, for what one knows of the
// energy along its way is not what the parts knew.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/integrators/conjugate_dots.hpp>

#include <numeric>
#include <vector>

namespace taut {

/// What a minimiser may take apart. Islands are without effect on a scene of one body, on
/// preconditioners that couple unknowns, and in quasi-static solves, where nothing bounds what a
/// free body does.
struct Splitting {
  bool by_islands = true;  ///< own direction weight, step length, bound and end for each island
  bool by_regions =
      false;  ///< instead: own weight and length for what contact acts on (regions.hpp)
};

namespace kernels {

/// What a pass does with the direction of a body.
enum class Turn : int { rest = 0, renew = 1, keep = 2 };

/// Per body.
template <class Real, class S>
struct BodyTurns {
  Array<Real, S> beta, gamma, factor;
  Kokkos::View<int*, typename S::memory> turn;
};

/// p = -z + beta p + gamma w where it is to be renewed, 0 where the body rests; and its products
/// with the gradient and itself.
template <class P, class S>
struct IslandDirection {
  enum { g_p, p_p, p_M_p, count };
  PreconditionedGradient<P, S> preconditioned;
  VectorField<typename P::real, S> p;
  Array<typename P::real, S> mass;
  typename Bodies<S>::Indices body;
  BodyTurns<typename P::real, S> of;

  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Sum = typename P::sum;
    using Real = typename P::real;
    int const b = body(i);
    if (of.turn(b) == int(Turn::rest)) return store3(p, i, Vec3<Real>{});
    auto next = load3<Real>(p, i);
    if (of.turn(b) == int(Turn::renew)) {
      Real const beta = of.beta(b), gamma = of.gamma(b);
      Vec3<Real> const z = preconditioned.of_gradient(i);
      next = beta != 0 ? beta * next - z : -z;
      if (gamma != 0) next = next + gamma * preconditioned.of_change(i);
      store3(p, i, next);
    }
    auto const wide = convert<Sum>(next);
    Sum const pp = dot(wide, wide);
    sums[g_p] += dot(load3<Sum>(preconditioned.gradient, i), wide);
    sums[p_p] += pp;
    sums[p_M_p] += Sum(mass(i)) * pp;
  }
};

/// p *= factor of its body
template <class P, class S>
struct ScaleBodies {
  VectorField<typename P::real, S> p;
  typename Bodies<S>::Indices body;
  Array<typename P::real, S> factor;
  KOKKOS_FUNCTION void operator()(int i) const {
    auto const f = factor(body(i));
    if (f == 1) return;
    for (int c = 0; c < 3; ++c) p(i, c) = f == 0 ? 0 : f * p(i, c);
  }
};

template <class S>
struct SumShares {
  Array<double, S> shares;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const { sum[0] += shares(i); }
};

/// Mass and number of what is free.
template <class P, class S>
struct SumFree {
  FixedMask<S> fixed;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    if (fixed(i)) return;
    sums[0] += double(mass(i));
    sums[1] += 1;
  }
};

template <class S>
struct MarkIdle {
  typename Bodies<S>::Indices body;
  Kokkos::View<int*, typename S::memory> turn;
  IdleMask<S> idle;
  KOKKOS_FUNCTION void operator()(int i) const {
    idle(i) = turn(body(i)) == int(Turn::rest) ? 1 : 0;
  }
};

}  // namespace kernels

/// Which bodies are joined, and the memory of passes that go by bodies.
template <class P, class S>
class Islands {
public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;
  using Turns = kernels::BodyTurns<Real, S>;

  /// Allocates what is not there already.
  void resize(Bodies<S> const& bodies, int unknowns) {
    if (bodies_.of.data() == bodies.of.data() && shares_.extent_int(0) == unknowns) return;
    bodies_ = bodies;
    sums_ = BodySums<S, typename P::sum>(bodies, 8);
    wide_sums_ = BodySums<S, double>(bodies, 2);
    shares_ = Array<double, S>("island_shares", unknowns);
    idle_ = IdleMask<S>("island_idle", unknowns);
    label_ = typename Bodies<S>::Indices("island_label", bodies.count);
    host_label_ = Kokkos::create_mirror_view(label_);
    turns_ = {Array<Real, S>("island_beta", bodies.count),
              Array<Real, S>("island_gamma", bodies.count),
              Array<Real, S>("island_factor", bodies.count),
              Kokkos::View<int*, typename S::memory>("island_turn", bodies.count)};
    beta_ = Kokkos::create_mirror_view(turns_.beta);
    gamma_ = Kokkos::create_mirror_view(turns_.gamma);
    factor_ = Kokkos::create_mirror_view(turns_.factor);
    turn_ = Kokkos::create_mirror_view(turns_.turn);
  }

  int count() const { return bodies_.count; }
  Bodies<S> const& bodies() const { return bodies_; }
  /// The island of body b: its smallest body.
  int operator()(int b) const { return host_label_(b); }

  /// Every body is an island.
  void start() {
    for (int b = 0; b < count(); ++b) host_label_(b) = b;
    version_ = -1;
  }
  /// Joins what may act on each other at x; true if that has changed an island.
  template <class E>
  bool regroup(E& e, VectorField<typename P::position, S> const& x) {
    std::int64_t const version = e.pattern_version(x);
    if (version == version_) return false;
    version_ = version;
    previous_.assign(host_label_.data(), host_label_.data() + count());
    assign_on<S>(label_, host_label_);
    e.link(label_);
    assign_on<S>(host_label_, label_);
    S::instance().fence("taut: islands");
    return !std::equal(previous_.begin(), previous_.end(), host_label_.data());
  }
  /// The island of body b before the last regroup.
  int previous(int b) const { return previous_[b]; }
  /// The body that unknown i is of.
  int body_of(int i) const {
    int b = 0;
    Kokkos::deep_copy(b, Kokkos::subview(bodies_.of, i));
    return b;
  }

  // What a pass is to do, per body; `send` before it.
  Real& beta(int b) { return beta_(b); }
  Real& gamma(int b) { return gamma_(b); }
  Real& factor(int b) { return factor_(b); }
  void set_turn(int b, kernels::Turn turn) { turn_(b) = int(turn); }
  void send_turns() const {
    assign_on<S>(turns_.beta, beta_);
    assign_on<S>(turns_.gamma, gamma_);
    assign_on<S>(turns_.turn, turn_);
  }
  void send_factors() const { assign_on<S>(turns_.factor, factor_); }
  Turns const& turns() const { return turns_; }
  /// Marks the unknowns of bodies whose turn is to rest; the mask is empty if there are none.
  IdleMask<S> idle() const {
    bool any = false;
    for (int b = 0; b < count(); ++b) any = any || turn_(b) == int(kernels::Turn::rest);
    if (!any) return {};
    send_turns();
    for_each<S>("island_idle", idle_.extent_int(0),
                kernels::MarkIdle<S>{bodies_.of, turns_.turn, idle_});
    return idle_;
  }

  BodySums<S, typename P::sum> const& sums() const { return sums_; }
  BodySums<S, double> const& wide_sums() const { return wide_sums_; }
  Array<double, S> const& shares() const { return shares_; }

private:
  Bodies<S> bodies_;
  BodySums<S, typename P::sum> sums_;
  BodySums<S, double> wide_sums_;
  Array<double, S> shares_;  ///< of p'Hp, per unknown
  IdleMask<S> idle_;
  typename Bodies<S>::Indices label_;
  typename Bodies<S>::Indices::HostMirror host_label_;
  std::vector<int> previous_;
  std::int64_t version_ = -1;
  Turns turns_;
  typename Array<Real, S>::HostMirror beta_, gamma_, factor_;
  typename Kokkos::View<int*, typename S::memory>::HostMirror turn_;
};

}  // namespace taut
