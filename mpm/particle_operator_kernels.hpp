// The Hessian of particles at one iterate as 45 numbers for each: with G = Sum_n p_n (grad w_n)^T,
// per cell, and vec by columns,
//
//   vec f_p = K_p vec G,      (H p)_n = Sum_p f_p grad w_np,
//   K_p = h^2 V_p / dx^2 (F^n (x) 1) (d2Psi/dF2) (F^nT (x) 1),     9x9 and symmetric.
//
// A product reads these instead of decomposing F anew, and does not know of materials.
#pragma once

#include <taut/mpm/particle_kernels.hpp>

namespace taut::kernels {

/// Of a particle: t (3), and the lower triangle of K by rows.
inline constexpr int operator_numbers = 48;
KOKKOS_FORCEINLINE_FUNCTION constexpr int operator_number(int q, int r) {
  return q >= r ? 3 + q * (q + 1) / 2 + r : 3 + r * (r + 1) / 2 + q;
}

template <class S, class T>
using OperatorLayout = SlotLayout<S, T, operator_numbers>;

/// Where they are written to, one or a pack at a time, which may be narrower or wider than one of
/// T.
template <class S, class T>
struct OperatorNumbers {
  using Layout = OperatorLayout<S, T>;
  Kokkos::View<T*, typename S::memory> to;

  /// Number k of the particles from `slot` on.
  template <class Value>
  KOKKOS_FORCEINLINE_FUNCTION void set(int slot, int k, Value const& value) const {
    constexpr int width = ScalarTraits<Value>::lanes;
    if constexpr (width <= Layout::lanes) {
      store_as(value, to.data() + Layout::place(slot, k));
    } else {
      ValueType<Value> own[width];
      store(value, own);
      for (int l = 0; l < width; ++l) to(Layout::place(slot + l, k)) = static_cast<T>(own[l]);
    }
  }
};

/// Writes them, as numbers of To.
template <class S, class Precision, class Material, Spline K, bool packed,
          class To = typename Precision::real>
struct LineariseParticles : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  Real scale;  ///< h^2
  OperatorNumbers<S, To> to;

  std::size_t scratch_bytes() const { return Base::row_bytes(3); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    team.team_barrier();
    auto const of_patch = this->material(patch);
    auto const points = this->points(patch, this->data.data());
    auto const body = [&](int g) __attribute__((always_inline)) {
      int const slot = this->blocks.slot_begin(patch) + g * Base::width;
      Mat3<T> const before = points.deformation(g);
      auto const state = Material::evaluate(
          this->own(of_patch, patch, g),
          before + this->change_of_F(points.weights(g), points.corners(g), local_x.data(), before));
      auto const frame = Material::frame(state);
      T const weight = T(scale / (this->dx * this->dx)) * points.weight(g);
      Mat3<T> const to_b = transpose(before);
      for (int k = 0; k < 3; ++k) to.set(slot, k, points.number(g, k));
      for (int r = 0; r < 9; ++r) {
        Mat3<T> dF;
        for (int i = 0; i < 3; ++i)
          for (int c = 0; c < 3; ++c) dF(i, c) = i == r % 3 ? before(r / 3, c) : T(0);
        Mat3<T> const f = frame.apply(dF) * to_b;
        for (int q = r; q < 9; ++q) to.set(slot, operator_number(q, r), T(weight * f.a[q]));
      }
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), body);
  }
};

/// What sweeps with these numbers read.
template <class S, class T_, Spline K, bool packed>
struct OperatorSweep : BlockSweep<S, T_, K, packed> {
  using Base = BlockSweep<S, T_, K, packed>;
  using T = typename Base::Value;
  Kokkos::View<T_ const*, typename S::memory> data;
  Kokkos::View<T_*, typename S::memory> partial;

  KOKKOS_FORCEINLINE_FUNCTION T_ const* group(int patch, int g) const {
    return data.data() +
           OperatorLayout<S, T_>::place(this->blocks.slot_begin(patch) + g * Base::width);
  }
  KOKKOS_FORCEINLINE_FUNCTION static T number(T_ const* group, int k) {
    return load<T>(group + k * Base::lanes);
  }
  KOKKOS_FORCEINLINE_FUNCTION static Weights<K, T> weights(T_ const* group) {
    return Weights<K, T>({number(group, 0), number(group, 1), number(group, 2)});
  }
};

/// Blocks of another scalar.
template <class S, class From, class To>
struct RoundBlocks {
  BlockField<From, S> from;
  BlockField<To, S> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int k = 0; k < 6; ++k) to(i, k) = static_cast<To>(from(i, k));
  }
};

/// p, where fixed nodes do not move.
template <class S, class T>
struct FreeField {
  Kokkos::View<std::uint8_t const*, typename S::memory> fixed;
  VectorField<T, S> p;
  KOKKOS_FORCEINLINE_FUNCTION T operator()(int node, int c) const {
    return fixed(node) == 0 ? p(node, c) : T(0);
  }
};

template <class S, class T_, Spline K, bool packed>
struct OperatorProduct : OperatorSweep<S, T_, K, packed> {
  using Base = OperatorSweep<S, T_, K, packed>;
  using T = typename Base::T;
  using Local = typename Base::Local;
  FreeField<S, T_> p;

  std::size_t scratch_bytes() const { return 2 * Base::row_bytes(3); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_p(team.team_scratch(0), 4 * Base::nodes);
    Local const rows(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, p, local_p);
    this->clear(team, rows, 3);
    team.team_barrier();
    std::uint16_t const* const corners =
        this->blocks.corner.data() + this->blocks.slot_begin(patch);
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      std::uint16_t const* const corner = corners + g * Base::width;
      T_ const* const own = this->group(patch, g);
      Weights<K, T> const at = this->weights(own);
      Mat3<T> const G = this->gradient(at, corner, local_p.data());
      Mat3<T> f;
      for (int q = 0; q < 9; ++q) f.a[q] = T(0);
      for (int q = 0; q < 9; ++q)
        for (int r = 0; r <= q; ++r) {
          T const k = this->number(own, operator_number(q, r));
          f.a[q] = f.a[q] + k * G.a[r];
          if (r != q) f.a[r] = f.a[r] + k * G.a[q];
        }
      // f grad w of a node, axis by axis: slopes along z apart from the others.
      T x[3][3], xy[3], xy_z[3];
      auto const received = [&](int a, int b, int c, T(&row)[3]) __attribute__((always_inline)) {
        for (int k = 0; k < 3; ++k) {
          if (b == 0 && c == 0) {
            x[0][k] = at.d[0][a] * f(k, 0);
            x[1][k] = at.w[0][a] * f(k, 1);
            x[2][k] = at.w[0][a] * f(k, 2);
          }
          if (c == 0) {
            xy[k] = at.w[1][b] * x[0][k] + at.d[1][b] * x[1][k];
            xy_z[k] = at.w[1][b] * x[2][k];
          }
          row[k] = at.w[2][c] * xy[k] + at.d[2][c] * xy_z[k];
        }
      };
      this->template give<3>(team, active, corner, rows.data(), received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<3>(team, patch, rows, this->partial);
  }
};

/// The diagonal blocks.
template <class S, class T_, Spline K, bool packed>
struct OperatorDiagonal : OperatorSweep<S, T_, K, packed> {
  using Base = OperatorSweep<S, T_, K, packed>;
  using T = typename Base::T;
  using Local = typename Base::Local;

  std::size_t scratch_bytes() const { return Base::row_bytes(6); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const rows(team.team_scratch(0), Base::padded(6) * Base::nodes);
    this->clear(team, rows, 6);
    team.team_barrier();
    std::uint16_t const* const corners =
        this->blocks.corner.data() + this->blocks.slot_begin(patch);
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      T_ const* const own = this->group(patch, g);
      Weights<K, T> const at = this->weights(own);
      // Sum_uv K_uv (grad w)_u (grad w)_v of a node, axis by axis, for each of the six pairs of
      // components: x_uv, of which those with as many slopes along z are added up along y.
      constexpr int first[6] = {0, 1, 2, 0, 1, 0}, second[6] = {0, 1, 2, 1, 2, 2};
      T x[6][6], xy[6][3];
      auto const received = [&](int a, int b, int c, T(&row)[6]) __attribute__((always_inline)) {
        for (int k = 0; k < 6; ++k) {
          if (b == 0 && c == 0) {
            for (int uv = 0; uv < 6; ++uv) {
              int const u = first[uv], v = second[uv];
              T sum = this->number(own, operator_number(first[k] + 3 * u, second[k] + 3 * v));
              if (u != v) {
                sum = sum + this->number(own, operator_number(first[k] + 3 * v, second[k] + 3 * u));
              }
              x[k][uv] =
                  (u == 0 ? at.d[0][a] : at.w[0][a]) * (v == 0 ? at.d[0][a] : at.w[0][a]) * sum;
            }
          }
          if (c == 0) {
            T const w = at.w[1][b], d = at.d[1][b];
            xy[k][0] = w * (w * x[k][0] + d * x[k][3]) + d * d * x[k][1];
            xy[k][1] = w * (w * x[k][5] + d * x[k][4]);
            xy[k][2] = w * w * x[k][2];
          }
          T const w = at.w[2][c], d = at.d[2][c];
          row[k] = w * (w * xy[k][0] + d * xy[k][1]) + d * d * xy[k][2];
        }
      };
      this->template give<6>(team, active, corners + g * Base::width, rows.data(), received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<6>(team, patch, rows, this->partial);
  }
};

/// y = the sum, and what the node itself resists with.
template <class S, class T>
struct OperatorProductOutput {
  Kokkos::View<std::uint8_t const*, typename S::memory> fixed;
  BlockField<T, S> local;
  VectorField<T, S> x, y;
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, T const (&sum)[numbers]) const {
    Sym3<T> own;
    for (int k = 0; k < 6; ++k) own.s[k] = local(node, k);
    Vec3<T> const resisted = own * Vec3<T>{x(node, 0), x(node, 1), x(node, 2)};
    bool const free = fixed(node) == 0;
    for (int c = 0; c < 3; ++c) y(node, c) = resisted[c] + (free ? sum[c] : T(0));
  }
};

template <class S, class T>
struct OperatorDiagonalOutput {
  Kokkos::View<std::uint8_t const*, typename S::memory> fixed;
  BlockField<T, S> local, blocks;
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, T const (&sum)[numbers]) const {
    bool const free = fixed(node) == 0;
    for (int k = 0; k < 6; ++k) blocks(node, k) = local(node, k) + (free ? sum[k] : T(0));
  }
};

}  // namespace taut::kernels
