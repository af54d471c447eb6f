// Small functions for testing minimisers: n unknowns in a row, tied to targets by their mass and to
// their neighbours by bonds,
//   E(x) = 1/2 w sum_i m_i |x_i - t_i|^2 + sum_i bond(x_{i+1} - x_i),   w = 1, or 0 (quasi-static).
// The bond decides what is hard about it: `Anisotropic` is quadratic and ill-conditioned, `Quartic`
// is not convex, `Barrier` limits the step. The first unknowns may be pinned and moved in pieces.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/potential/objective.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut::toy {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// 1/2 (d - r)' K (d - r) with the stiffnesses 1, 30 and `stiffest` along three skew axes, N/m.
struct Anisotropic {
  double stiffest = 1000;

  template <class T>
  KOKKOS_FUNCTION Vec3<T> rest() const {
    return {T(1), T(0.25), T(-0.5)};
  }
  template <class T>
  KOKKOS_FUNCTION Mat3<T> curvature(Vec3<T> const&) const {
    T const s = sqrt(T(2)) / 2, t = sqrt(T(3)) / 2;
    Vec3<T> const a{s, s, T(0)}, b{-s / 2, s / 2, t}, c{s * t, -s * t, T(0.5)};
    return outer(a, a) + T(30) * outer(b, b) + T(stiffest) * outer(c, c);
  }
  template <class T>
  KOKKOS_FUNCTION Vec3<T> gradient(Vec3<T> const& d) const {
    return curvature(d) * (d - rest<T>());
  }
  template <class T>
  KOKKOS_FUNCTION T value(Vec3<T> const& d) const {
    return T(0.5) * dot(d - rest<T>(), gradient(d));
  }
  template <class T>
  KOKKOS_FUNCTION T difference(Vec3<T> const& d, Vec3<T> const& step) const {
    return dot(step, gradient(d)) + T(0.5) * dot(step, curvature(d) * step);
  }
  template <class T>
  KOKKOS_FUNCTION T max_step(Vec3<T> const&, Vec3<T> const&) const {
    return T(infinity);
  }
};

/// k/4 (|d|^2 - 1)^2: has a flat sphere of minima and is concave inside it, where the curvature is
/// filtered.
struct Quartic {
  double stiffness = 50;

  template <class T>
  KOKKOS_FUNCTION Mat3<T> curvature(Vec3<T> const& d) const {
    T const length2 = dot(d, d), across = max(length2 - 1, T(0)),
            along = max(3 * length2 - 1, T(0));
    T const stretch = length2 > 0 ? (along - across) / length2 : T(0);
    return T(stiffness) * (across * identity3<T>() + stretch * outer(d, d));
  }
  template <class T>
  KOKKOS_FUNCTION Vec3<T> gradient(Vec3<T> const& d) const {
    return T(stiffness) * (dot(d, d) - 1) * d;
  }
  template <class T>
  KOKKOS_FUNCTION T value(Vec3<T> const& d) const {
    return T(stiffness / 4) * square(dot(d, d) - 1);
  }
  template <class T>
  KOKKOS_FUNCTION T difference(Vec3<T> const& d, Vec3<T> const& step) const {
    T const growth = dot(step, T(2) * d + step);
    return T(stiffness / 4) * growth * (2 * (dot(d, d) - 1) + growth);
  }
  template <class T>
  KOKKOS_FUNCTION T max_step(Vec3<T> const&, Vec3<T> const&) const {
    return T(infinity);
  }
};

/// k/2 |d - r|^2 - b log(d_x), which keeps neighbours in order along the first axis.
struct Barrier {
  double stiffness = 20, strength = 0.1;

  template <class T>
  KOKKOS_FUNCTION Vec3<T> rest() const {
    return {T(-0.2), T(0.1), T(0)};
  }
  template <class T>
  KOKKOS_FUNCTION Mat3<T> curvature(Vec3<T> const& d) const {
    Mat3<T> k = T(stiffness) * identity3<T>();
    k(0, 0) += T(strength) / square(d[0]);
    return k;
  }
  template <class T>
  KOKKOS_FUNCTION Vec3<T> gradient(Vec3<T> const& d) const {
    Vec3<T> g = T(stiffness) * (d - rest<T>());
    g[0] -= T(strength) / d[0];
    return g;
  }
  template <class T>
  KOKKOS_FUNCTION T value(Vec3<T> const& d) const {
    Vec3<T> const stretch = d - rest<T>();
    return T(stiffness / 2) * dot(stretch, stretch) - T(strength) * Kokkos::log(d[0]);
  }
  template <class T>
  KOKKOS_FUNCTION T difference(Vec3<T> const& d, Vec3<T> const& step) const {
    return T(stiffness) * dot(step, d - rest<T>() + T(0.5) * step) -
           T(strength) * Kokkos::log1p(step[0] / d[0]);
  }
  template <class T>
  KOKKOS_FUNCTION T max_step(Vec3<T> const& d, Vec3<T> const& step) const {
    return step[0] < 0 ? -d[0] / step[0] : T(infinity);
  }
};

struct ChainParams {
  int size = 24;
  bool has_inertia = true;
  int pinned = 0;     ///< so many unknowns at the front are prescribed,
  int pieces = 1;     ///< and move in so many pieces,
  double travel = 0;  ///< so far along each axis, m
};

/// What the kernels of a chain share. `T` is what they compute in.
template <class Bond, class P, class S>
struct ChainData {
  using T = typename P::real;
  using Positions = VectorField<typename P::position, S>;
  using Field = VectorField<T, S>;

  Bond bond;
  int size, pinned;
  T inertia;
  Positions target;
  Array<T, S> mass;

  template <class View>
  KOKKOS_FUNCTION static Vec3<T> at(View const& field, int i) {
    return {T(field(i, 0)), T(field(i, 1)), T(field(i, 2))};
  }
  KOKKOS_FUNCTION Vec3<T> stretch(Positions const& x, int i) const {
    return {T(x(i + 1, 0) - x(i, 0)), T(x(i + 1, 1) - x(i, 1)), T(x(i + 1, 2) - x(i, 2))};
  }
  KOKKOS_FUNCTION Vec3<T> offset(Positions const& x, int i) const {
    return {T(x(i, 0) - target(i, 0)), T(x(i, 1) - target(i, 1)), T(x(i, 2) - target(i, 2))};
  }
  /// Entry i of a step; pinned unknowns take no part in it.
  KOKKOS_FUNCTION Vec3<T> step(Field const& p, int i) const {
    return i < pinned ? Vec3<T>{} : at(p, i);
  }
  KOKKOS_FUNCTION Mat3<T> block(Positions const& x, int i) const {
    Mat3<T> k = (i < pinned ? mass(i) : inertia * mass(i)) * identity3<T>();
    if (i >= pinned && i > 0) k = k + bond.curvature(stretch(x, i - 1));
    if (i >= pinned && i + 1 < size) k = k + bond.curvature(stretch(x, i));
    return k;
  }
};

template <class Data>
struct ChainGradient {
  Data data;
  typename Data::Positions x;
  typename Data::Field g;
  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<typename Data::T> sum{};
    if (i >= data.pinned) {
      sum = data.inertia * data.mass(i) * data.offset(x, i);
      if (i > 0) sum = sum + data.bond.gradient(data.stretch(x, i - 1));
      if (i + 1 < data.size) sum = sum - data.bond.gradient(data.stretch(x, i));
    }
    for (int c = 0; c < 3; ++c) g(i, c) = sum[c];
  }
};

/// The diagonal (3 numbers per unknown) or the diagonal blocks (6) of the curvature.
template <class Data, class View>
struct ChainCurvature {
  Data data;
  typename Data::Positions x;
  View out;
  KOKKOS_FUNCTION void operator()(int i) const {
    auto const k = data.block(x, i);
    for (int c = 0; c < 3; ++c) out(i, c) = k(c, c);
    if constexpr (View::static_extent(1) == 6) {
      for (int c = 0; c < 3; ++c) out(i, 3 + c) = k(c == 1 ? 1 : 0, c == 0 ? 1 : 2);
    }
  }
};

template <class Data>
struct ChainProduct {
  Data data;
  typename Data::Positions x;
  typename Data::Field p, hp;
  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<typename Data::T> sum{};
    if (i >= data.pinned) {
      sum = data.block(x, i) * data.step(p, i);
      if (i > 0) sum = sum - data.bond.curvature(data.stretch(x, i - 1)) * data.step(p, i - 1);
      if (i + 1 < data.size)
        sum = sum - data.bond.curvature(data.stretch(x, i)) * data.step(p, i + 1);
    }
    for (int c = 0; c < 3; ++c) hp(i, c) = sum[c];
  }
};

/// E(x), or E(x + alpha p) - E(x), or p'Hp.
template <class Data, class Sum>
struct ChainSum {
  enum What { value, difference, quadratic_form };
  Data data;
  What what;
  typename Data::Positions x;
  typename Data::Field p;
  typename Data::T alpha;
  KOKKOS_FUNCTION void operator()(int i, Sums<Sum, 1>& sums) const {
    using T = typename Data::T;
    T const m = data.inertia * data.mass(i);
    Vec3<T> const u = data.offset(x, i);
    Vec3<T> s{}, d{}, q{};
    bool const bonded = i + 1 < data.size;
    if (what != value) s = alpha * data.step(p, i);
    if (bonded) d = data.stretch(x, i);
    if (bonded && what != value) q = alpha * data.step(p, i + 1) - s;
    if (what == value) {
      sums[0] += Sum(m / 2 * dot(u, u));
      if (bonded) sums[0] += Sum(data.bond.value(d));
    } else if (what == difference) {
      sums[0] += Sum(m * dot(s, u + T(0.5) * s));
      if (bonded) sums[0] += Sum(data.bond.difference(d, q));
    } else {
      sums[0] += Sum(m * dot(s, s));
      if (bonded) sums[0] += Sum(dot(q, data.bond.curvature(d) * q));
    }
  }
};

template <class Data>
struct ChainMaxStep {
  Data data;
  typename Data::Positions x;
  typename Data::Field p;
  KOKKOS_FUNCTION void operator()(int i, double& least) const {
    auto const q = data.step(p, i + 1) - data.step(p, i);
    least = Kokkos::min(least, double(data.bond.max_step(data.stretch(x, i), q)));
  }
};

template <class Data, class Matrix>
struct ChainAssemble {
  Data data;
  typename Data::Positions x;
  Matrix matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int k = matrix.row_begin(i); k < matrix.row_begin(i + 1); ++k) {
      int const j = matrix.column(k), low = Kokkos::min(i, j);
      Mat3<typename Data::T> b{};
      if (i == j) {
        b = data.block(x, i);
      } else if (low >= data.pinned) {
        b = typename Data::T(-1) * data.bond.curvature(data.stretch(x, low));
      }
      for (int e = 0; e < 9; ++e) matrix.block(k).a[e] = b.a[e];
    }
  }
};

template <class Positions>
struct Translate {
  Positions x;
  double by;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) x(i, c) += by;
  }
};

/// to = x - alpha p
template <class Data>
struct UndoStep {
  typename Data::Positions to, x;
  typename Data::Field p;
  double alpha;
  KOKKOS_FUNCTION void operator()(int i) const {
    using T = typename Data::Positions::non_const_value_type;
    for (int c = 0; c < 3; ++c) to(i, c) = x(i, c) - T(alpha) * T(p(i, c));
  }
};

template <class Bond, class P = Fp64, class S = DefaultSpace>
class Chain {
public:
  using Space = S;
  using Precision = P;
  using real = typename P::real;
  using Positions = VectorField<typename P::position, S>;
  using Field = VectorField<real, S>;
  using Blocks = BlockField<real, S>;

  explicit Chain(ChainParams const& params = {}, Bond const& bond = {})
      : params_(params),
        pieces_left_(params.pinned > 0 ? params.pieces : 0),
        before_("chain_before", params.size),
        reducer_(params.size) {
    data_ = {bond,
             params.size,
             params.pinned,
             real(params.has_inertia ? 1 : 0),
             Positions("chain_target", params.size),
             Array<real, S>("chain_mass", params.size)};
    auto const target = Kokkos::create_mirror_view(data_.target);
    auto const mass = Kokkos::create_mirror_view(data_.mass);
    for (int i = 0; i < params.size; ++i) {
      mass(i) = real(1 + 0.5 * std::sin(2.0 * i));
      if (i >= params.pinned) total_mass_ += mass(i);
      for (int c = 0; c < 3; ++c)
        target(i, c) = real(0.4 * i * (c == 0) + 0.3 * std::sin(1.0 + 3.0 * i + 5.0 * c));
    }
    assign(data_.target, target);
    assign(data_.mass, mass);
  }

  /// Somewhere to start from: unknowns in order along the first axis, away from every minimum.
  Positions start() const {
    Positions const x("chain_x", size());
    auto const host = Kokkos::create_mirror_view(x);
    for (int i = 0; i < size(); ++i)
      for (int c = 0; c < 3; ++c)
        host(i, c) = real(0.5 * i * (c == 0) + 0.2 * std::sin(7.0 * i + 2.0 * c));
    assign(x, host);
    return x;
  }

  int size() const { return data_.size; }
  Scale scale() const { return {total_mass_, 0.5, 0.01, params_.has_inertia}; }
  Array<real, S> mass() const { return data_.mass; }

  double value(Positions const& x) const { return sum(Sum::value, x, Field(), 0); }
  double difference(Positions const& x, Field const& p, double alpha) const {
    return sum(Sum::difference, x, p, alpha);
  }
  double quadratic_form(Positions const& x, Field const& p) const {
    return sum(Sum::quadratic_form, x, p, 1);
  }

  void gradient(Positions const& x, Field const& g) const {
    for_each<S>("chain_gradient", size(), ChainGradient<Data>{data_, x, g});
  }
  template <class View>
  void gradient(Positions const& x, Field const& g, View const& curvature) const {
    gradient(x, g);
    for_each<S>("chain_curvature", size(), ChainCurvature<Data, View>{data_, x, curvature});
  }
  template <class... Curvature>
  double gradient_after(Positions const& x, Field const& p, double alpha, Field const& g,
                        Curvature const&... curvature) const {
    gradient(x, g, curvature...);
    for_each<S>("chain_undo", size(), UndoStep<Data>{before_, x, p, alpha});
    return difference(before_, p, alpha);
  }

  void product(Positions const& x, Field const& p, Field const& hp) const {
    for_each<S>("chain_product", size(), ChainProduct<Data>{data_, x, p, hp});
  }
  std::int64_t pattern_version(Positions const&) const { return 0; }
  BlockCsr<S, double> pattern(Positions const&) const {
    BlockPattern pattern{{0}, {}};
    for (int i = 0; i < size(); ++i) {
      for (int j = std::max(i - 1, 0); j <= std::min(i + 1, size() - 1); ++j)
        pattern.column.push_back(j);
      pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
    }
    return BlockCsr<S, double>(pattern);
  }
  void assemble(Positions const& x, BlockCsr<S, double>& matrix) const {
    for_each<S>("chain_assemble", size(),
                ChainAssemble<Data, BlockCsr<S, double>>{data_, x, matrix});
  }

  /// Half of the way to where a bond breaks.
  double max_step(Positions const& x, Field const& p, double at_most) const {
    return 0.5 * longest_step(x, p, 2 * at_most);
  }
  double longest_step(Positions const& x, Field const& p, double at_most = infinity) const {
    return minimum<S>("chain_max_step", size() - 1, at_most, ChainMaxStep<Data>{data_, x, p});
  }
  bool advance_prescribed(Positions const& x) {
    if (pieces_left_ == 0) return false;
    --pieces_left_;
    for_each<S>("chain_advance", params_.pinned,
                Translate<Positions>{x, params_.travel / params_.pieces});
    return true;
  }

private:
  using Data = ChainData<Bond, P, S>;
  using Sum = ChainSum<Data, typename P::sum>;

  double sum(typename Sum::What what, Positions const& x, Field const& p, double alpha) const {
    return double(
        reducer_.template sum<1>("chain_sum", size(), Sum{data_, what, x, p, real(alpha)})[0]);
  }

  ChainParams params_;
  int pieces_left_;
  double total_mass_ = 0;
  Data data_;
  Positions before_;
  Reducer<S, typename P::sum> reducer_;
};

}  // namespace taut::toy
