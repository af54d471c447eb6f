// The kernels of friction: one sweep over lagged contacts, then one over the vertices in contact
// (vertex_slots.hpp). What does arithmetic is compiled once ([[gnu::noinline]]), as in
// contact_kernels.hpp.
//
// All that a contact adds is the same vector and block for its four vertices, times c_a and c_a^2,
// so a contact keeps one of each and slots are read from them.
#pragma once

#include <taut/contact/friction_law.hpp>
#include <taut/contact/lagged_contacts.hpp>

namespace taut::kernels {

/// The contacts of a step, and how each slips.
template <class Precision, class S>
struct SlipTable {
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, S>;
  LaggedTable<Precision, S> contacts;
  Positions from;  ///< x^t, m
  double length;   ///< e = eps_v h, m

  /// Sum_a c_a field(vertex a)
  template <class Field>
  KOKKOS_FUNCTION Vec3<double> combine(int k, Field const& field) const {
    Vec3<double> sum{};
    for (int a = 0; a < 4; ++a) {
      double const ca = double(contacts.c(k, a));
      if (ca == 0) continue;
      int const v = contacts.vertex(k, a);
      for (int i = 0; i < 3; ++i) sum[i] += ca * double(field(v, i));
    }
    return sum;
  }
  /// What is tangential of w, over `unit`.
  KOKKOS_FUNCTION Vec3<Real> tangential(int k, Vec3<double> const& w, double unit) const {
    Vec3<double> n;
    for (int i = 0; i < 3; ++i) n[i] = double(contacts.normal(k, i));
    // The normal is unit to round-off in Real.
    double const along = dot(n, w) / dot(n, n), scale = 1 / unit;
    Vec3<Real> r;
    for (int i = 0; i < 3; ++i) r[i] = static_cast<Real>(scale * (w[i] - along * n[i]));
    return r;
  }
  /// r = u / e at x. Differences first: they are small.
  KOKKOS_FUNCTION Vec3<Real> slip(int k, Positions const& x) const {
    Vec3<double> w{};
    for (int a = 0; a < 4; ++a) {
      double const ca = double(contacts.c(k, a));
      if (ca == 0) continue;
      int const v = contacts.vertex(k, a);
      for (int i = 0; i < 3; ++i) w[i] += ca * (double(x(v, i)) - double(from(v, i)));
    }
    for (int i = 0; i < 3; ++i) w[i] -= double(contacts.motion(k, i));
    return tangential(k, w, length);
  }
  /// Of a step of alpha p.
  KOKKOS_FUNCTION Vec3<Real> slip_step(int k, VectorField<Real, S> const& p, double alpha) const {
    return tangential(k, combine(k, p), length / alpha);
  }
};

template <class Precision, class S>
struct FrictionValue {
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION double value(int k) const {
    return slips.length * double(slips.contacts.limit(k)) *
           double(friction_energy(norm(slips.slip(k, x))));
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const { sum[0] += value(k); }
};

/// E(x + alpha p) - E(x)
template <class Precision, class S>
struct FrictionChange {
  using Real = typename Precision::real;
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  VectorField<Real, S> p;
  double alpha;
  [[gnu::noinline]] KOKKOS_FUNCTION double change(int k) const {
    if (alpha == 0) return 0;
    Vec3<Real> const before = slips.slip(k, x), step = slips.slip_step(k, p, alpha);
    return slips.length * double(slips.contacts.limit(k)) *
           double(friction_energy_change(before, before + step, step));
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const { sum[0] += change(k); }
};

/// What contact k adds to its vertices, times their coefficients: gradient and curvature. As
/// slots, for GatherSlots.
template <class Precision, class S>
struct FrictionSlots {
  using Real = typename Precision::real;
  Kokkos::View<Real* [4], typename S::layout, typename S::memory> c;
  VectorField<Real, S> force;  ///< of D by u, N
  BlockField<Real, S> block;   ///< of D by u, N/m

  KOKKOS_FUNCTION bool acts(int) const { return true; }
  KOKKOS_FUNCTION double vector(int slot, int i) const {
    return double(c(slot / 4, slot % 4)) * double(force(slot / 4, i));
  }
  KOKKOS_FUNCTION double curvature(int slot, int i) const {
    double const ca = double(c(slot / 4, slot % 4));
    return ca * ca * double(block(slot / 4, i));
  }
};

template <class Precision, class S, bool curvature>
struct EvaluateFriction {
  using Real = typename Precision::real;
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  VectorField<Real, S> p;  ///< of the step that led to x
  double alpha;
  FrictionSlots<Precision, S> to;

  [[gnu::noinline]] KOKKOS_FUNCTION double evaluate(int k, bool after_step) const {
    auto const s = evaluate_slip(slips.slip(k, x));
    Real const limit = slips.contacts.limit(k);
    for (int i = 0; i < 3; ++i) to.force(k, i) = limit * s.slope_ratio * s.r[i];
    if constexpr (curvature) {
      auto const h = friction_curvature(s, slips.contacts.normal_of(k));
      auto const stiffness = static_cast<Real>(double(limit) / slips.length);
      for (int i = 0; i < 6; ++i) to.block(k, i) = stiffness * h.s[i];
    }
    if (!after_step || alpha == 0) return 0;
    Vec3<Real> const step = slips.slip_step(k, p, alpha);
    return slips.length * double(limit) * double(friction_energy_change(s.r - step, s.r, step));
  }
};

template <class Precision, class S, bool curvature>
struct FrictionGradient : EvaluateFriction<Precision, S, curvature> {
  KOKKOS_FUNCTION void operator()(int k) const { this->evaluate(k, false); }
};
/// And E(x) - E(x - alpha p).
template <class Precision, class S, bool curvature>
struct FrictionGradientAfter : EvaluateFriction<Precision, S, curvature> {
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const {
    sum[0] += this->evaluate(k, true);
  }
};

template <class Precision, class S>
struct FrictionForm {
  using Real = typename Precision::real;
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  VectorField<Real, S> p;
  [[gnu::noinline]] KOKKOS_FUNCTION double form(int k) const {
    auto const s = evaluate_slip(slips.slip(k, x));
    Vec3<Real> const q = slips.tangential(k, slips.combine(k, p), 1);
    return double(slips.contacts.limit(k)) / slips.length * double(s.slope_ratio * dot(q, q));
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const { sum[0] += form(k); }
};

/// Slots of H p. What is fixed does not move.
template <class Precision, class S>
struct FrictionProduct {
  using Real = typename Precision::real;
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  VectorField<Real, S> p;
  FixedMask<S> fixed;
  FrictionSlots<Precision, S> to;
  [[gnu::noinline]] KOKKOS_FUNCTION void multiply(int k) const {
    Vec3<double> w{};
    for (int a = 0; a < 4; ++a) {
      double const ca = double(slips.contacts.c(k, a));
      int const v = slips.contacts.vertex(k, a);
      if (ca == 0 || fixed(v)) continue;
      for (int i = 0; i < 3; ++i) w[i] += ca * double(p(v, i));
    }
    auto const s = evaluate_slip(slips.slip(k, x));
    auto const stiffness = static_cast<Real>(double(slips.contacts.limit(k)) / slips.length);
    Vec3<Real> const hw = stiffness * (s.slope_ratio * slips.tangential(k, w, 1));
    for (int i = 0; i < 3; ++i) to.force(k, i) = hw[i];
  }
  KOKKOS_FUNCTION void operator()(int k) const { multiply(k); }
};

/// Adds the blocks of the row of entry i of `vertex`, from slots with curvature.
template <class Precision, class S>
struct AssembleFriction {
  typename SurfaceViews<S>::Indices vertex;
  SlotsOfVertices<S> of;
  LaggedTable<Precision, S> contacts;
  FrictionSlots<Precision, S> from;
  FixedMask<S> fixed;
  BlockCsr<S, double> matrix;
  double scale;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = vertex(i);
    if (fixed(v)) return;
    for (int j = of.begin(v); j < of.begin(v + 1); ++j) add(v, of.slot(j) / 4, of.slot(j) % 4);
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int v, int k, int a) const {
    Sym3<double> h;
    for (int i = 0; i < 6; ++i) h.s[i] = scale * double(from.block(k, i));
    for (int b = 0; b < 4; ++b) {
      double const c = double(contacts.c(k, a)) * double(contacts.c(k, b));
      int const w = contacts.vertex(k, b);
      if (c != 0 && !fixed(w)) matrix.add(v, w, c * to_matrix(h));
    }
  }
};

/// Lowers to the first contact that has a block which `matrix` does not store.
template <class Precision, class S>
struct FindMissingFriction {
  LaggedTable<Precision, S> contacts;
  FixedMask<S> fixed;
  BlockCsr<S, double> matrix;
  KOKKOS_FUNCTION void operator()(int k, int& first) const {
    if (k < first && !stored(k)) first = k;
  }
  KOKKOS_FUNCTION bool couples(int k, int a) const {
    return contacts.c(k, a) != 0 && !fixed(contacts.vertex(k, a));
  }
  KOKKOS_FUNCTION bool stored(int k) const {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        bool const both = couples(k, a) && couples(k, b);
        if (both && matrix.find(contacts.vertex(k, a), contacts.vertex(k, b)) < 0) return false;
      }
    return true;
  }
};

/// Sums: contacts that slide, the work against friction (J), the most that friction exerts (N).
template <class Precision, class S>
struct FrictionTotals {
  SlipTable<Precision, S> slips;
  typename SlipTable<Precision, S>::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int k, Sums<double, 3>& sum) const {
    auto const s = evaluate_slip(slips.slip(k, x));
    double const limit = double(slips.contacts.limit(k));
    sum[0] += s.slides() ? 1 : 0;
    sum[1] += slips.length * limit * double(s.slope_ratio * square(s.y));
    sum[2] += limit;
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 3>& sum) const { add(k, sum); }
};

}  // namespace taut::kernels
