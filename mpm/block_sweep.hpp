// The frame of a sweep over patches of particles (particle_blocks.hpp): what a team does with a
// patch, whatever it computes for the particles. As in sweeps over tets (core/fem/patch_sweep.hpp),
// on the host one thread computes a SIMD pack of particles at a time, on a device one particle.
//
// Sums over the nodes of a particle are taken axis by axis, which costs 9 products per node instead
// of 18: with g_i a field on the nodes,
//
//   Sum_i g_i w_i' = Sum_a Sum_b (.) Sum_c (.) g_abc
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/fem/patch_sweep.hpp>
#include <taut/mpm/particle_blocks.hpp>

namespace taut::kernels {

/// Numbers that sweeps read for each particle.
inline constexpr int point_numbers = 13;  ///< t (3), F^n (9), weight (1)

/// x - X: how far a node has gone.
template <class S, class Position>
struct Displacement {
  VectorField<Position, S> x, rest;
  KOKKOS_FORCEINLINE_FUNCTION Position operator()(int node, int c) const {
    return x(node, c) - rest(node, c);
  }
};
/// A field as it is.
template <class S, class Position>
struct NodeField {
  VectorField<Position, S> v;
  KOKKOS_FORCEINLINE_FUNCTION Position operator()(int node, int c) const { return v(node, c); }
};

/// `packed`: one thread per patch, which computes packs; otherwise threads with a particle each.
template <class S, class Real, Spline K, bool packed>
struct BlockSweep {
  using Views = BlockViews<K, S>;
  using Value = std::conditional_t<packed, HostPack<Real>, Real>;
  using Local = ScratchField<S, Real>;
  static constexpr int width = ScalarTraits<Value>::lanes;
  using Layout = SlotLayout<S, Real, point_numbers>;
  static constexpr int lanes = Layout::lanes;
  static constexpr int nodes = Views::nodes, side = Views::side;

  Views blocks;

  /// Numbers in the rows of four that hold `numbers`.
  KOKKOS_FORCEINLINE_FUNCTION static constexpr int padded(int numbers) {
    return (numbers + 3) / 4 * 4;
  }
  static std::size_t row_bytes(int numbers) {
    return Local::shmem_size(std::size_t(padded(numbers)) * nodes);
  }

  /// What sweeps read of the particles of a patch.
  struct Points {
    std::uint16_t const* corner;
    Real const* data;

    KOKKOS_FORCEINLINE_FUNCTION std::uint16_t const* corners(int g) const {
      return corner + g * width;
    }
    KOKKOS_FORCEINLINE_FUNCTION Value number(int g, int k) const {
      return load<Value>(data + Layout::place(g * width, k));
    }
    KOKKOS_FORCEINLINE_FUNCTION Weights<K, Value> weights(int g) const {
      return Weights<K, Value>({number(g, 0), number(g, 1), number(g, 2)});
    }
    KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> deformation(int g) const {
      Mat3<Value> F;
      for (int k = 0; k < 9; ++k) F.a[k] = number(g, 3 + k);
      return F;
    }
    /// Volume at rest, times what hardens the material.
    KOKKOS_FORCEINLINE_FUNCTION Value weight(int g) const { return number(g, 12); }
  };
  KOKKOS_FORCEINLINE_FUNCTION Points points(int patch, Real const* data) const {
    int const begin = blocks.slot_begin(patch);
    return {blocks.corner.data() + begin, data + Layout::place(begin)};
  }
  /// Groups of `width` particles, padding included.
  KOKKOS_FORCEINLINE_FUNCTION int groups(int patch) const {
    return (blocks.slot_end(patch) - blocks.slot_begin(patch)) / width;
  }

  /// Copies what `field(node, c)` says of the nodes of the patch, less that of its heart, into rows
  /// of four; zero where the grid has no node. Less that of a node that hardly any particle sees,
  /// which may be far off, the others would lose digits.
  template <class Team, class Field>
  KOKKOS_FORCEINLINE_FUNCTION void load_relative(Team const& team, int patch, Field const& field,
                                                 Local const& to) const {
    int const heart = blocks.nodes_of(patch)[blocks.heart(patch)];
    std::decay_t<decltype(field(0, 0))> origin[3];
    for (int c = 0; c < 3; ++c) origin[c] = field(heart, c);
    load_from(team, patch, field, origin, to);
  }
  /// The same, less `origin`.
  template <class Team, class Field, class Origin>
  KOKKOS_FORCEINLINE_FUNCTION void load_from(Team const& team, int patch, Field const& field,
                                             Origin const (&origin)[3], Local const& to) const {
    int const* const node = blocks.nodes_of(patch);
    Real* const row = to.data();
    auto const body = [&](int l) __attribute__((always_inline)) {
      int const n = node[l];
      for (int c = 0; c < 3; ++c) {
        row[4 * l + c] = n >= 0 ? static_cast<Real>(field(n, c) - origin[c]) : Real(0);
      }
      row[4 * l + 3] = 0;
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, nodes), body);
  }
  /// The largest number of such a field, without sign; what is not a number is passed over.
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION Real largest(Team const& team, Local const& field) const {
    Real most(0);
    auto const body = [&](int k) __attribute__((always_inline)) {
      most = max(most, abs(field(k)));
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, 4 * nodes), body);
    team.team_reduce(Kokkos::Max<Real>(most));
    return most;
  }
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION void clear(Team const& team, Local const& rows, int numbers) const {
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, padded(numbers) * nodes),
                         [&](int k) { rows(k) = 0; });
  }

  /// Calls body(g, active) for the groups of a patch so that the threads of a team are in the same
  /// round, and all of them the same number of times: a body that adds to nodes may wait for the
  /// others at each node of the stencil.
  template <class Team, class Body>
  KOKKOS_FORCEINLINE_FUNCTION void in_rounds(Team const& team, int patch, Body const& body) const {
    if (packed || team.team_size() == 1) {
      for (int g = 0; g < groups(patch); ++g) body(g, true);
      return;
    }
    int const* const round_end = blocks.round_end.data() + blocks.slot_begin(patch);
    int const count = blocks.count(patch), threads = team.team_size();
    for (int round = 0, first = 0; first < count; ++round) {
      int const end = round_end[round];
      for (int from = first; from < end; from += threads) {
        int const g = from + team.team_rank();
        body(Kokkos::min(g, end - 1), g < end);
      }
      first = end;
    }
  }

  /// Sum_i g_i (w_i')^T, per cell, of the rows of `field`.
  KOKKOS_FORCEINLINE_FUNCTION static Mat3<Value> gradient(Weights<K, Value> const& at,
                                                          std::uint16_t const* corner,
                                                          Real const* field) {
    Value value[3];
    return sums(at.w, at.d, corner, field, value);
  }
  /// value = Sum_i g_i w_i, and Sum_i g_i (s_i)^T, where s_i has along each axis the numbers `d` in
  /// the place of the weights.
  KOKKOS_FORCEINLINE_FUNCTION static Mat3<Value> sums(Value const (&w)[3][K::width],
                                                      Value const (&d)[3][K::width],
                                                      std::uint16_t const* corner,
                                                      Real const* field, Value (&value)[3]) {
    Value const zero(0);
    for (int k = 0; k < 3; ++k) value[k] = zero;
    Value sum[3][3] = {{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};  // [axis]
    for (int a = 0; a < K::width; ++a) {
      Value plane[3] = {zero, zero, zero}, plane_y[3] = {zero, zero, zero},
            plane_z[3] = {zero, zero, zero};
      for (int b = 0; b < K::width; ++b) {
        Value line[3] = {zero, zero, zero}, line_z[3] = {zero, zero, zero};
        for (int c = 0; c < K::width; ++c) {
          Value g[3];
          load_rows(field + 4 * Views::local(a, b, c), corner, g);
          for (int k = 0; k < 3; ++k) {
            line[k] = line[k] + w[2][c] * g[k];
            line_z[k] = line_z[k] + d[2][c] * g[k];
          }
        }
        for (int k = 0; k < 3; ++k) {
          plane[k] = plane[k] + w[1][b] * line[k];
          plane_y[k] = plane_y[k] + d[1][b] * line[k];
          plane_z[k] = plane_z[k] + w[1][b] * line_z[k];
        }
      }
      for (int k = 0; k < 3; ++k) {
        value[k] = value[k] + w[0][a] * plane[k];
        sum[0][k] = sum[0][k] + d[0][a] * plane[k];
        sum[1][k] = sum[1][k] + w[0][a] * plane_y[k];
        sum[2][k] = sum[2][k] + w[0][a] * plane_z[k];
      }
    }
    return {{sum[0][0], sum[0][1], sum[0][2], sum[1][0], sum[1][1], sum[1][2], sum[2][0], sum[2][1],
             sum[2][2]}};
  }

  /// Gives each node of the stencil what `received(a, b, c, numbers)` writes for it. All threads of
  /// the team come here together.
  template <int numbers, class Team, class Received>
  KOKKOS_FORCEINLINE_FUNCTION void give(Team const& team, bool active, std::uint16_t const* corner,
                                        Real* rows, Received const& received) const {
    constexpr int scale = padded(numbers) / 4;
    for (int a = 0; a < K::width; ++a)
      for (int b = 0; b < K::width; ++b)
        for (int c = 0; c < K::width; ++c) {
          Value row[numbers];
          received(a, b, c, row);
          Real* const to = rows + 4 * scale * Views::local(a, b, c);
          if constexpr (packed) {
            add_rows<numbers, scale>(row, to, corner);
          } else {
            if (active) {
              for (int k = 0; k < numbers; ++k) to[scale * corner[0] + k] += row[k];
            }
            if (team.team_size() > 1) team.team_barrier();
          }
        }
  }
  /// Hands over the sum of each local node.
  template <int numbers, class Team>
  KOKKOS_FORCEINLINE_FUNCTION void take(
      Team const& team, int patch, Local const& rows,
      Kokkos::View<Real*, typename S::memory> const& partial) const {
    Real* const to = partial.data() + std::size_t(numbers) * nodes * patch;
    Real const* const from = rows.data();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, nodes), [&](int l) {
      for (int c = 0; c < numbers; ++c) to[numbers * l + c] = from[padded(numbers) * l + c];
    });
  }
};

/// Adds up what the patches left for a node.
template <class S, class Real, Spline K, int numbers, class Output>
struct GatherRows {
  BlockViews<K, S> blocks;
  Kokkos::View<Real*, typename S::memory> partial;
  Output output;

  KOKKOS_FUNCTION void operator()(int node) const {
    Real sum[numbers] = {};
    for (int r = blocks.row_begin(node); r < blocks.row_begin(node + 1); ++r) {
      Real const* from = partial.data() + std::size_t(numbers) * blocks.row(r);
      for (int c = 0; c < numbers; ++c) sum[c] += from[c];
    }
    output.template add<numbers>(node, sum);
  }
};

}  // namespace taut::kernels
