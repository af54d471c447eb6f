// The kernels of the contact term: one sweep over pairs, then one over vertices.
//
// A pair that acts leaves what it adds to each of its four vertices in slots of its own, 4 k + a;
// a vertex adds up its slots in their order. So nothing is atomic, and sums do not depend on the
// number of threads. What does arithmetic is compiled once ([[gnu::noinline]]): inlined into the
// serial and the parallel copy of a loop, it could be contracted to other fused products in each.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>
#include <taut/contact/pair.hpp>
#include <taut/contact/stiffness.hpp>
#include <taut/contact/vertex_slots.hpp>

#include <type_traits>

namespace taut::kernels {

/// Pairs with all that does not change while they are candidates: those of points and triangles
/// first, then those of edges.
template <class Precision, class S>
struct PairTable {
  using Real = typename Precision::real;
  PairIds<S> vertex;
  Array<Real, S> stiffness, activation, mollifier;
  Array<float, S> clearance;  ///< pair_length of the distance, where it was found, less activation
  Displacement moved;         ///< since
  IdleMask<S> resting;        ///< vertices of idle islands, if there are any
  int point_triangles = 0, count = 0;

  /// Pair k certainly does not act: neither where the vertices are, nor at the other end of the
  /// motion, if there is one. Or both of its bodies are idle.
  KOKKOS_FUNCTION bool idle(int k) const {
    float const c = clearance(k);
    if (moved.of(c) < double(Kokkos::abs(c))) return true;
    return resting.extent(0) > 0 && resting(vertex(k, 0)) && resting(vertex(k, 3));
  }

  KOKKOS_FUNCTION PairKind kind(int k) const {
    return k < point_triangles ? PairKind::point_triangle : PairKind::edge_edge;
  }
  KOKKOS_FUNCTION PairParameters<Real> parameters(int k) const {
    return {stiffness(k), activation(k), mollifier(k)};
  }
  /// Where the vertices of pair k are at x, what the pair is there, and alpha p.
  KOKKOS_FUNCTION void read(int k, VectorField<typename Precision::position, S> const& x,
                            Vec3<double> (&y)[4]) const {
    int v[4];
    read_pair(vertex, k, v);
    gather(v, x, y);
  }
  /// Whether pair k at y is certainly more than `beyond`, m, out of the reach of its activation: a
  /// cheap look before all else, since most candidates are.
  KOKKOS_FUNCTION bool apart(int k, Vec3<double> const (&y)[4], double beyond = 0) const {
    double const reach = double(activation(k)) + beyond;
    return square_box_gap(kind(k), y) > reach * reach;
  }
  template <class Pair>
  KOKKOS_FUNCTION PairState<Real> evaluate(int k, Vec3<double> const (&y)[4]) const {
    return Pair::evaluate(kind(k), parameters(k), y);
  }
  /// Whether pair k acts at x; then `s` is its state.
  template <class Pair>
  KOKKOS_FUNCTION bool acting(int k, VectorField<typename Precision::position, S> const& x,
                              PairState<Real>& s) const {
    Vec3<double> y[4];
    read(k, x, y);
    if (apart(k, y)) return false;
    s = evaluate<Pair>(k, y);
    return s.at.distance < s.activation;
  }
  KOKKOS_FUNCTION void read_step(int k, VectorField<Real, S> const& p, double alpha,
                                 Vec3<double> (&step)[4]) const {
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) step[a][c] = alpha * double(p(vertex(k, a), c));
  }
};

/// Takes over the candidates of one kind as pairs `first`, `first` + 1, ...
template <class Pair, class Rule, class Precision, class S>
struct TakeCandidates {
  using Real = typename Precision::real;
  PairKind kind;
  int first;
  PairIds<S> ids;
  Array<float, S> distance;  ///< FoundDistances::at
  Array<double, S> activation;
  VectorField<double, S> rest_at;
  Rule rule;
  StiffnessFields<Precision, S> fields;
  double mollifier_threshold;
  PairTable<Precision, S> pairs;
  Kokkos::View<int*, typename S::memory> vertex_of_slot;

  KOKKOS_FUNCTION void operator()(int i) const { take(i, first + i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void take(int i, int k) const {
    int v[4];
    Vec3<double> rest[4];
    read_pair(ids, i, v);
    write_pair(v, pairs.vertex, k);
    gather(v, rest_at, rest);
    for (int a = 0; a < 4; ++a) vertex_of_slot(4 * k + a) = v[a];
    // What is held exerts nothing: it is a candidate for step bounds alone.
    bool const held = Held<S>{fields.fixed, false}(v);
    pairs.activation(k) = held ? Real(0) : static_cast<Real>(activation(i));
    float const left = Kokkos::abs(distance(i)) - static_cast<float>(pairs.activation(k));
    pairs.clearance(k) = pair_length(distance(i) < 0, (1 - 1e-6f) * left);
    pairs.stiffness(k) = static_cast<Real>(rule(fields, kind, v));
    pairs.mollifier(k) = kind == PairKind::edge_edge
                             ? static_cast<Real>(Pair::Mollifier::scale(rest, mollifier_threshold))
                             : Real(0);
  }
};

template <class Pair, class Precision, class S>
struct PairValue {
  using Real = typename Precision::real;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  [[gnu::noinline]] KOKKOS_FUNCTION double value(int k) const {
    PairState<Real> s;
    return pairs.template acting<Pair>(k, x, s) ? double(Pair::value(s)) : 0;
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const {
    if (!pairs.idle(k)) sum[0] += value(k);
  }
};

/// How far the vertices of a pair go against each other in a step, or a little more: three for two,
/// which leaves room for round-off, times their motions against vertex 1.
KOKKOS_INLINE_FUNCTION double relative_length(Vec3<double> const (&step)[4]) {
  double longest = 0;
  for (int a = 0; a < 4; ++a) longest = Kokkos::max(longest, norm(step[a] - step[1]));
  return 3 * longest;
}

/// The change of energy by the step that has led to the state `after`; 0 if no pair within it acts.
template <class Pair, class T>
KOKKOS_INLINE_FUNCTION double change_of_pair(PairKind kind, PairParameters<T> const& parameters,
                                             PairState<T> const& after,
                                             Vec3<double> const (&step)[4]) {
  if (double(after.at.distance) > double(after.activation) + relative_length(step)) return 0;
  Vec3<T> moved[4];
  for (int a = 0; a < 4; ++a)
    for (int c = 0; c < 3; ++c) moved[a][c] = static_cast<T>(step[a][c] - step[1][c]);
  return double(Pair::change(kind, parameters, after, moved));
}

/// E(x + alpha p) - E(x)
template <class Pair, class Precision, class S>
struct PairChange {
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  double alpha;
  [[gnu::noinline]] KOKKOS_FUNCTION double change(int k) const {
    Vec3<double> y[4], step[4];
    pairs.read(k, x, y);
    pairs.read_step(k, p, alpha, step);
    for (int a = 0; a < 4; ++a) y[a] = y[a] + step[a];
    if (pairs.apart(k, y, relative_length(step))) return 0;
    return change_of_pair<Pair>(pairs.kind(k), pairs.parameters(k),
                                pairs.template evaluate<Pair>(k, y), step);
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const {
    if (!pairs.idle(k)) sum[0] += change(k);
  }
};

/// Slots: what each pair adds to the gradient and to `numbers` of the curvature of its vertices.
template <class Precision, class S>
struct ContactSlots {
  using Real = typename Precision::real;
  Kokkos::View<std::uint8_t*, typename S::memory> acts;  ///< per pair
  Array<Real, S> over_gradient;                          ///< per pair that acts, see form_factor
  VectorField<Real, S> vector;
  BlockField<Real, S> curvature;
};

/// The f of a pair whose Hessian is f g g', g its gradient; below zero where it is not.
template <class Pair, class T>
KOKKOS_INLINE_FUNCTION T form_factor(PairState<T> const& s) {
  if constexpr (requires { Pair::Curvature::over_gradient(s); }) {
    T const f = Pair::Curvature::over_gradient(s);
    return f < Kokkos::Experimental::finite_max_v<T> ? f : T(-1);
  } else {
    return T(-1);
  }
}

/// Pairs that are evaluated side by side: one per lane of a register of the host, where curvature
/// and barrier are arithmetic without branches.
template <class Pair, class Precision, class S>
using PairLanes = std::conditional_t < S::on_host&& requires {
  Pair::Curvature::in_packs;
}
, HostPack<typename Precision::real>, typename Precision::real > ;

template <class Pair, class Precision, class S, int numbers>
struct EvaluatePair {
  using Real = typename Precision::real;
  using Lanes = PairLanes<Pair, Precision, S>;
  static constexpr int lanes = ScalarTraits<Lanes>::lanes;

  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;  ///< of the step that led to x
  double alpha;
  ContactSlots<Precision, S> to;

  /// Registers full of pairs, those of points and triangles first.
  int packs() const {
    return packs(pairs.point_triangles) + packs(pairs.count - pairs.point_triangles);
  }
  KOKKOS_FUNCTION static int packs(int count) { return (count + lanes - 1) / lanes; }

  /// Leaves what the pairs of pack g add; the change of energy if `after_step`.
  KOKKOS_FUNCTION double evaluate_pack(int g, bool after_step) const {
    if constexpr (lanes == 1) {
      return evaluate_unless_idle(g, after_step);
    } else {
      int const of_points = packs(pairs.point_triangles);
      if (g < of_points) {
        int const first = lanes * g;
        return side_by_side<PairKind::point_triangle>(first, pairs.point_triangles - first,
                                                      after_step);
      }
      int const first = pairs.point_triangles + lanes * (g - of_points);
      return side_by_side<PairKind::edge_edge>(first, pairs.count - first, after_step);
    }
  }

private:
  /// A pair that is idle only leaves that it does not act.
  KOKKOS_FUNCTION double evaluate_unless_idle(int k, bool after_step) const {
    if (!pairs.idle(k)) return evaluate(k, after_step);
    to.acts(k) = 0;
    return 0;
  }
  [[gnu::noinline]] KOKKOS_FUNCTION double evaluate(int k, bool after_step) const {
    Vec3<double> y[4], step[4];
    pairs.read(k, x, y);
    if (after_step) pairs.read_step(k, p, alpha, step);
    if (pairs.apart(k, y, after_step ? relative_length(step) : 0)) {
      to.acts(k) = 0;
      return 0;
    }
    auto const s = pairs.template evaluate<Pair>(k, y);
    bool const acts = s.at.distance < s.activation;
    to.acts(k) = acts ? 1 : 0;
    if (acts) {
      to.over_gradient(k) = form_factor<Pair>(s);
      Real gradient[12], curvature[numbers > 0 ? 4 * numbers : 1];
      contributions(s, gradient, curvature);
      write(k, gradient, curvature, 1);
    }
    return after_step ? change_of_pair<Pair>(pairs.kind(k), pairs.parameters(k), s, step) : 0;
  }

  /// Of all four vertices, one after the other.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void contributions(PairState<T> const& s, T* gradient,
                                                        T* curvature) {
    for (int a = 0; a < 4; ++a) {
      Vec3<T> const g = Pair::gradient(s, a);
      for (int c = 0; c < 3; ++c) gradient[3 * a + c] = g[c];
      if constexpr (numbers == 3) {
        Vec3<T> const h = Pair::diagonal(s, a);
        for (int c = 0; c < 3; ++c) curvature[3 * a + c] = h[c];
      }
      if constexpr (numbers == 6) {
        Sym3<T> const h = Pair::block(s, a);
        for (int c = 0; c < 6; ++c) curvature[6 * a + c] = h.s[c];
      }
    }
  }
  /// Numbers that are `stride` apart, to the slots of pair k.
  KOKKOS_FORCEINLINE_FUNCTION void write(int k, Real const* gradient, Real const* curvature,
                                         int stride) const {
    for (int a = 0; a < 4; ++a) {
      for (int c = 0; c < 3; ++c) to.vector(4 * k + a, c) = gradient[stride * (3 * a + c)];
      for (int c = 0; c < numbers; ++c) {
        to.curvature(4 * k + a, c) = curvature[stride * (numbers * a + c)];
      }
    }
  }

  /// Pairs first, first + 1, ... of one kind, of which there are `left`.
  template <PairKind kind>
  [[gnu::noinline]] double side_by_side(int first, int left, bool after_step) const {
    using T = Lanes;
    int k[lanes], v[4][lanes];
    bool looked_at[lanes], any = false;
    for (int i = 0; i < lanes; ++i) {
      k[i] = first + (i < left ? i : 0);
      looked_at[i] = i < left && !pairs.idle(k[i]);
      any = any || looked_at[i];
      if (i < left) to.acts(k[i]) = 0;
      for (int a = 0; a < 4; ++a) v[a][i] = pairs.vertex(k[i], a);
    }
    if (!any) return 0;
    PairParameters<T> const parameters{gather<T>(pairs.stiffness.data(), k),
                                       gather<T>(pairs.activation.data(), k),
                                       gather<T>(pairs.mollifier.data(), k)};
    Vec3<T> y[4], step[4];
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) {
        y[a][c] =
            T([&](std::size_t i) { return static_cast<Real>(x(v[a][i], c) - x(v[1][i], c)); });
        if (after_step) {
          step[a][c] = T([&](std::size_t i) {
            return static_cast<Real>(alpha * (double(p(v[a][i], c)) - double(p(v[1][i], c))));
          });
        }
      }
    auto const s =
        evaluate_local<typename Pair::Barrier, typename Pair::Mollifier>(kind, parameters, y);

    // What is mollified goes by itself, and so does what has no direction.
    auto odd = !(s.at.distance > T(0));
    if constexpr (kind == PairKind::edge_edge) {
      odd = odd || Pair::Mollifier::acts(y, parameters.mollifier_scale);
      if (after_step) {
        Vec3<T> before[4];
        for (int a = 0; a < 4; ++a) before[a] = y[a] - step[a];
        odd = odd || Pair::Mollifier::acts(before, parameters.mollifier_scale);
      }
    }
    T gradient[12], curvature[numbers > 0 ? 4 * numbers : 1];
    contributions(s, gradient, curvature);
    alignas(64) Real g[12][lanes], h[numbers > 0 ? 4 * numbers : 1][lanes], f[lanes], change[lanes],
        acts[lanes], by_itself[lanes];
    for (int n = 0; n < 12; ++n) store(gradient[n], g[n]);
    for (int n = 0; n < 4 * numbers; ++n) store(curvature[n], h[n]);
    store(Pair::Curvature::over_gradient(s), f);
    store(after_step ? Pair::change(kind, parameters, s, step) : T(0), change);
    store(select(s.at.distance < s.activation, T(1), T(0)), acts);
    store(select(odd, T(1), T(0)), by_itself);

    double sum = 0;
    for (int i = 0; i < lanes; ++i) {
      if (!looked_at[i]) continue;
      if (by_itself[i] != 0) {
        sum += evaluate(k[i], after_step);
        continue;
      }
      sum += double(change[i]);
      if (acts[i] == 0) continue;
      to.acts(k[i]) = 1;
      to.over_gradient(k[i]) = f[i] < Kokkos::Experimental::finite_max_v<Real> ? f[i] : Real(-1);
      write(k[i], &g[0][i], &h[0][i], lanes);
    }
    return sum;
  }
};

template <class Pair, class Precision, class S, int numbers>
struct PairGradient : EvaluatePair<Pair, Precision, S, numbers> {
  KOKKOS_FUNCTION void operator()(int g) const { this->evaluate_pack(g, false); }
};
/// And E(x) - E(x - alpha p).
template <class Pair, class Precision, class S, int numbers>
struct PairGradientAfter : EvaluatePair<Pair, Precision, S, numbers> {
  KOKKOS_FUNCTION void operator()(int g, Sums<double, 1>& sum) const {
    sum[0] += this->evaluate_pack(g, true);
  }
};

/// p'Hp of each pair at x.
template <class Pair, class Precision, class S>
struct PairForm {
  using Real = typename Precision::real;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  ContactSlots<Precision, S> known;  ///< of a gradient at x; empty: none is known
  [[gnu::noinline]] KOKKOS_FUNCTION double form(int k) const {
    bool const evaluated = known.acts.extent(0) > 0;
    if (evaluated && known.acts(k) == 0) return 0;
    if (evaluated && known.over_gradient(k) >= 0) {
      // The four gradients add up to nothing.
      double change = 0;
      int const base = pairs.vertex(k, 1);
      for (int a = 0; a < 4; ++a) {
        int const v = pairs.vertex(k, a);
        if (a == 1) continue;
        for (int c = 0; c < 3; ++c) {
          change += double(known.vector(4 * k + a, c)) * (double(p(v, c)) - double(p(base, c)));
        }
      }
      return double(known.over_gradient(k)) * change * change;
    }
    PairState<Real> s;
    if (!pairs.template acting<Pair>(k, x, s)) return 0;
    Vec3<double> step[4];
    Vec3<Real> q[4];
    pairs.read_step(k, p, 1, step);
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) q[a][c] = static_cast<Real>(step[a][c]);
    return double(Pair::quadratic(s, q));
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const {
    if (!pairs.idle(k)) sum[0] += form(k);
  }
};

/// Lowers to the first vertex of the surface whose places differ.
template <class Precision, class S>
struct FindOtherPlace {
  using Positions = VectorField<typename Precision::position, S>;
  typename SurfaceViews<S>::Indices vertex;
  Positions x, y;
  KOKKOS_FUNCTION void operator()(int i, int& first) const {
    int const v = vertex(i);
    bool same = true;
    for (int c = 0; c < 3; ++c) same = same && x(v, c) == y(v, c);
    if (!same) first = Kokkos::min(first, i);
  }
};

/// Block (a, b) of the projected Hessian of a pair; of the whole of it where that must be
/// projected.
template <class Pair, class T>
class PairHessian {
public:
  KOKKOS_INLINE_FUNCTION explicit PairHessian(PairState<T> const& s) : s_(s) {
    if constexpr (!Pair::Curvature::positive) h_ = Pair::hessian(s);
  }
  KOKKOS_INLINE_FUNCTION Mat3<T> block(int a, int b) const {
    if constexpr (Pair::Curvature::positive) {
      return Pair::Curvature::block(s_, a, b);
    } else {
      Mat3<T> r;
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) r(i, j) = h_(3 * a + i, 3 * b + j);
      return r;
    }
  }

private:
  struct Nothing {};
  PairState<T> const& s_;
  std::conditional_t<Pair::Curvature::positive, Nothing, SquareMatrix<T, 12>> h_;
};

/// Slots of H p. What is fixed does not move.
template <class Pair, class Precision, class S>
struct PairProduct {
  using Real = typename Precision::real;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  FixedMask<S> fixed;
  ContactSlots<Precision, S> to;
  [[gnu::noinline]] KOKKOS_FUNCTION void multiply(int k) const {
    PairState<Real> s;
    bool const acts = pairs.template acting<Pair>(k, x, s);
    to.acts(k) = acts ? 1 : 0;
    if (!acts) return;
    PairHessian<Pair, Real> const h(s);
    for (int a = 0; a < 4; ++a) {
      Vec3<Real> sum{};
      for (int b = 0; b < 4; ++b) {
        int const v = pairs.vertex(k, b);
        if (fixed(v)) continue;
        sum = sum + h.block(a, b) * Vec3<Real>{p(v, 0), p(v, 1), p(v, 2)};
      }
      for (int c = 0; c < 3; ++c) to.vector(4 * k + a, c) = sum[c];
    }
  }
  KOKKOS_FUNCTION void operator()(int k) const {
    if (pairs.idle(k)) {
      to.acts(k) = 0;
    } else {
      multiply(k);
    }
  }
};

/// Adds the blocks of surface vertex i's row. Each row is written by one thread, so a pair is
/// evaluated once per corner.
template <class Pair, class Precision, class S>
struct AssembleRows {
  using Real = typename Precision::real;
  typename SurfaceViews<S>::Indices vertex;
  SlotsOfVertices<S> of;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  FixedMask<S> fixed;
  BlockCsr<S, double> matrix;
  double scale;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = vertex(i);
    if (fixed(v)) return;
    for (int j = of.begin(v); j < of.begin(v + 1); ++j) {
      if (!pairs.idle(of.slot(j) / 4)) add(v, of.slot(j));
    }
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int v, int slot) const {
    int const k = slot / 4, a = slot % 4;
    PairState<Real> s;
    if (!pairs.template acting<Pair>(k, x, s)) return;
    PairHessian<Pair, Real> const h(s);
    for (int b = 0; b < 4; ++b) {
      int const w = pairs.vertex(k, b);
      if (fixed(w)) continue;
      Mat3<Real> const block = h.block(a, b);
      Mat3<double> scaled;
      for (int m = 0; m < 9; ++m) scaled.a[m] = scale * double(block.a[m]);
      matrix.add(v, w, scaled);
    }
  }
};

template <class Precision, class S>
struct PairDistance {
  using Real = typename Precision::real;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  [[gnu::noinline]] KOKKOS_FUNCTION Real distance(int k) const {
    Vec3<double> y[4];
    Vec3<Real> local[4];
    pairs.read(k, x, y);
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) local[a][c] = static_cast<Real>(y[a][c] - y[1][c]);
    return closest_points(pairs.kind(k), local).distance;
  }
  KOKKOS_FUNCTION bool acts(int k) const {
    return !pairs.idle(k) && distance(k) < pairs.activation(k);
  }
};

template <class Precision, class S>
struct CountContacts : PairDistance<Precision, S> {
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& count) const {
    if (this->acts(k)) count[0] += 1;
  }
};

/// Marks the free vertices of pairs that act.
template <class Precision, class S>
struct MarkContacts : PairDistance<Precision, S> {
  FixedMask<S> fixed;
  Array<int, S> marks;
  KOKKOS_FUNCTION void operator()(int k) const {
    if (!this->acts(k)) return;
    for (int a = 0; a < 4; ++a) {
      int const v = this->pairs.vertex(k, a);
      if (!fixed(v)) Kokkos::atomic_store(&marks(v), 1);
    }
  }
};

/// Lowers to the share that is left of the activation distance.
template <class Precision, class S>
struct LeastGap : PairDistance<Precision, S> {
  KOKKOS_FUNCTION void operator()(int k, double& least) const {
    double const a = double(this->pairs.activation(k));
    if (a > 0 && !this->pairs.idle(k)) least = Kokkos::min(least, double(this->distance(k)) / a);
  }
};

/// Lowers to the first pair that acts and has a block that `matrix` does not store.
template <class Precision, class S>
struct FindMissingBlock : PairDistance<Precision, S> {
  FixedMask<S> fixed;
  BlockCsr<S, double> matrix;
  KOKKOS_FUNCTION void operator()(int k, int& first) const {
    if (k < first && !stored(k) && this->acts(k)) first = k;
  }
  KOKKOS_FUNCTION bool stored(int k) const {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        int const i = this->pairs.vertex(k, a), j = this->pairs.vertex(k, b);
        if (!fixed(i) && !fixed(j) && matrix.find(i, j) < 0) return false;
      }
    return true;
  }
};

/// The longest motion of a vertex of the surface against the first.
template <class Precision, class S>
struct LargestMotion {
  typename SurfaceViews<S>::Indices vertex;
  VectorField<typename Precision::real, S> p;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    largest = Kokkos::max(largest, length(i));
  }
  [[gnu::noinline]] KOKKOS_FUNCTION double length(int i) const {
    int const v = vertex(i), o = vertex(0);
    Vec3<double> d;
    for (int c = 0; c < 3; ++c) d[c] = double(p(v, c)) - double(p(o, c));
    double const size = norm(d);
    // A maximum passes over what is not a number.
    return size >= 0 ? size : Kokkos::Experimental::infinity_v<double>;
  }
};

/// Remembers the vertices of pair k.
template <class S>
struct KeepPair {
  PairIds<S> ids;
  int k;
  Kokkos::View<int[4], typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int) const {
    for (int a = 0; a < 4; ++a) to(a) = ids(k, a);
  }
};

}  // namespace taut::kernels
