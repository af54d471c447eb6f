// The loops of ghost_penalty.hpp.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/mpm/block_sweep.hpp>
#include <taut/mpm/embedding.hpp>
#include <taut/mpm/grid_matrix.hpp>
#include <taut/mpm/transfer.hpp>

namespace taut {

/// The rows w of the penalty. Entry k = 9 a + 3 b + c of a row is the node at (a - 1, b - 1, c - 1)
/// from the middle of its window. A plain view: copies share the numbers.
template <class S>
struct GhostRows {
  static constexpr int entries = 27;
  template <class T>
  using List = Kokkos::View<T, typename S::layout, typename S::memory>;
  using Indices = Kokkos::View<int*, typename S::memory>;

  int count = 0;
  GridNodes<S> nodes;
  List<int* [3]> middle;           ///< of the window, as ijk
  List<int* [entries]> node;       ///< -1: the row has nothing to do with it
  List<double* [entries]> weight;  ///< their sum, and that of weight times place, is 0
  List<double*> stiffness;         ///< N/m
  List<double* [3]> force;         ///< room for a vector of each row
  Indices row;                     ///< per node: that of its own, or -1
  Indices begin;                   ///< per node, +1: the first of its entries
  Indices entry;                   ///< 27 row + k

  /// Sum_k w_k field(k)
  template <class Field>
  KOKKOS_FUNCTION Vec3<double> stretch(int r, Field const& field) const {
    Vec3<double> sum{0, 0, 0};
    for (int k = 0; k < entries; ++k) {
      int const n = node(r, k);
      if (n < 0) continue;
      for (int c = 0; c < 3; ++c) sum[c] += weight(r, k) * double(field(n, c));
    }
    return sum;
  }
};

namespace kernels {

KOKKOS_FORCEINLINE_FUNCTION Vec3<double> place_in_window(int k) {
  return {double(k / 9 - 1), double(k / 3 % 3 - 1), double(k % 3 - 1)};
}

/// Sum_p w V of what the particles of a patch give to its nodes.
template <class S, class Precision, Spline K>
struct VolumeOfPatch {
  BlockViews<K, S> blocks;
  PlaceInCell<S, Precision, K> place;
  Kokkos::View<double*, typename S::memory> partial;

  KOKKOS_FUNCTION void operator()(int patch) const {
    constexpr int nodes = BlockViews<K, S>::nodes;
    double* const rows = partial.data() + std::size_t(nodes) * patch;
    for (int k = 0; k < nodes; ++k) rows[k] = 0;
    int const first = blocks.slot_begin(patch);
    for (int slot = first; slot < first + blocks.count(patch); ++slot) {
      int const p = blocks.particle(slot);
      double const volume = double(place.particles.volume(p));
      Weights<K, double> const at(place(p));
      double* const corner = rows + blocks.corner(slot) / 4;
      for (int a = 0; a < K::width; ++a)
        for (int b = 0; b < K::width; ++b) {
          double const w = volume * at.w[0][a] * at.w[1][b];
          for (int c = 0; c < K::width; ++c) {
            corner[BlockViews<K, S>::local(a, b, c)] += w * at.w[2][c];
          }
        }
    }
  }
};
template <class S>
struct WriteVolume {
  Kokkos::View<double*, typename S::memory> volume;
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, double const (&sum)[numbers]) const {
    volume(node) = sum[0];
  }
};

/// What resists a motion of nodes elastically, N/m, and h^2 / m times that: about the square of how
/// many cells a wave crosses in a step.
template <class S, class Precision>
struct NodeStiffness {
  Array<typename Precision::real, S> stiffness, mass;  ///< that of all, with inertia if `inertia`
  double square;                                       ///< h^2
  bool inertia;
  KOKKOS_FUNCTION double elastic(int i) const {
    double const all = double(stiffness(i));
    return Kokkos::max(0.0, inertia ? all - double(mass(i)) / square : all);
  }
  KOKKOS_FUNCTION double ratio(int i) const { return square * elastic(i) / double(mass(i)); }
  KOKKOS_FUNCTION void operator()(int i, double& most) const { most = Kokkos::max(most, ratio(i)); }
};

/// 1 where a free node holds less than `share` of what a neighbour does that is stiff.
template <class S, class Precision>
struct IsLight {
  GridNodes<S> nodes;
  Kokkos::View<double const*, typename S::memory> volume;
  FixedMask<S> fixed;
  NodeStiffness<S, Precision> stiff;
  double share, least_ratio;
  KOKKOS_FUNCTION int operator()(int i) const {
    if (fixed(i) != 0) return 0;
    for (int k = 0; k < 27; ++k) {
      int const j = nodes.beside(i, k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
      if (j >= 0 && volume(i) < share * volume(j) && stiff.ratio(j) >= least_ratio) return 1;
    }
    return 0;
  }
};

/// The weights with which a linear function is known at 0 from its values in a window: least
/// squares, e_k = W_k (1, X_k)' N^-1 (1, 0), N = Sum_k W_k (1, X_k)(1, X_k)'.
struct LinearExtrapolation {
  double n[4][4] = {}, y[4] = {1, 0, 0, 0};

  KOKKOS_FUNCTION static void row(Vec3<double> const& at, double (&x)[4]) {
    x[0] = 1;
    for (int c = 0; c < 3; ++c) x[1 + c] = at[c];
  }
  KOKKOS_FUNCTION void add(Vec3<double> const& at, double w) {
    double x[4];
    row(at, x);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j <= i; ++j) n[i][j] += w * x[i] * x[j];
  }
  /// False if what was added does not tell a linear function from its values.
  KOKKOS_FUNCTION bool solve() {
    constexpr double enough = 1e-6;  // of what the pivot was before the others
    for (int j = 0; j < 4; ++j) {
      double const before = n[j][j];
      for (int k = 0; k < j; ++k) n[j][j] -= n[j][k] * n[j][k];
      if (!(n[j][j] > enough * before)) return false;
      n[j][j] = Kokkos::sqrt(n[j][j]);
      for (int i = j + 1; i < 4; ++i) {
        for (int k = 0; k < j; ++k) n[i][j] -= n[i][k] * n[j][k];
        n[i][j] /= n[j][j];
      }
    }
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < i; ++k) y[i] -= n[i][k] * y[k];
      y[i] /= n[i][i];
    }
    for (int i = 3; i >= 0; --i) {
      for (int k = i + 1; k < 4; ++k) y[i] -= n[k][i] * y[k];
      y[i] /= n[i][i];
    }
    return true;
  }
  KOKKOS_FUNCTION double weight(Vec3<double> const& at, double w) const {
    double x[4];
    row(at, x);
    return w * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3]);
  }
};

/// Writes the row of a light node, in the place of the number of those before it; -1 to others.
template <class S, class Precision>
struct WriteGhostRow {
  IsLight<S, Precision> is_light;
  GhostRows<S> to;

  KOKKOS_FUNCTION void operator()(int i) const {
    if (is_light(i) == 0) {
      to.row(i) = -1;
    } else {
      write(i, to.row(i));
    }
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void write(int i, int r) const {
    auto const& volume = is_light.volume;
    int shift[3];
    inwards(i, shift);
    for (int c = 0; c < 3; ++c) to.middle(r, c) = is_light.nodes.ijk(i, c) + shift[c];
    double most = 0;
    for (int k = 0; k < 27; ++k) {
      to.node(r, k) = is_light.nodes.beside(i, shift[0] + k / 9 - 1, shift[1] + k / 3 % 3 - 1,
                                            shift[2] + k % 3 - 1);
      if (to.node(r, k) >= 0) most = Kokkos::max(most, volume(to.node(r, k)));
    }
    Vec3<double> const from{double(shift[0]), double(shift[1]), double(shift[2])};
    // From nodes that are well seen by far, or else by any more than this one.
    LinearExtrapolation fit;
    double least = 0;
    bool known = false;
    for (int attempt = 0; attempt < 2 && !known; ++attempt) {
      least = attempt == 0 ? 3 * volume(i) : volume(i);
      fit = {};
      for (int k = 0; k < 27; ++k) {
        int const j = to.node(r, k);
        if (j >= 0 && volume(j) > least) fit.add(from + place_in_window(k), trust(j, most));
      }
      known = fit.solve();
    }
    for (int k = 0; k < 27; ++k) {
      int const j = to.node(r, k);
      bool const used = known && j >= 0 && (j == i || volume(j) > least);
      to.weight(r, k) = !used    ? 0
                        : j == i ? 1
                                 : -fit.weight(from + place_in_window(k), trust(j, most));
      if (!used) to.node(r, k) = -1;
    }
  }

private:
  KOKKOS_FUNCTION double trust(int j, double most) const {
    return Kokkos::max(1e-3, is_light.volume(j) / most);
  }
  /// Where from a node the body is, along each axis: -1, 0 or 1.
  KOKKOS_FUNCTION void inwards(int i, int (&shift)[3]) const {
    Vec3<double> pull{0, 0, 0};
    for (int k = 0; k < 27; ++k) {
      Vec3<double> const at = place_in_window(k);
      int const j = is_light.nodes.beside(i, int(at[0]), int(at[1]), int(at[2]));
      if (j >= 0) pull = pull + is_light.volume(j) * at;
    }
    double most = 0;
    for (int c = 0; c < 3; ++c) most = Kokkos::max(most, Kokkos::abs(pull[c]));
    for (int c = 0; c < 3; ++c) {
      shift[c] = Kokkos::abs(pull[c]) > 0.25 * most ? (pull[c] > 0 ? 1 : -1) : 0;
    }
  }
};

/// The node of entry 27 row + k, or `none`.
template <class S>
struct NodeOfEntry {
  GhostRows<S> rows;
  Kokkos::View<int*, typename S::memory> bucket;
  int none;
  KOKKOS_FUNCTION void operator()(int e) const {
    int const n = rows.node(e / GhostRows<S>::entries, e % GhostRows<S>::entries);
    bucket(e) = n < 0 ? none : n;
  }
};

/// So stiff that the row adds no more than a part of what resists to any free node but its own.
template <class S, class Precision>
struct StiffenGhosts {
  GhostRows<S> rows;
  FixedMask<S> fixed;
  NodeStiffness<S, Precision> stiff;
  double strength;
  KOKKOS_FUNCTION void operator()(int r) const {
    double least = Kokkos::Experimental::infinity_v<double>;
    for (int k = 0; k < GhostRows<S>::entries; ++k) {
      int const n = rows.node(r, k);
      double const w = rows.weight(r, k);
      if (n < 0 || rows.row(n) == r || w == 0 || fixed(n) != 0) continue;
      least = Kokkos::min(least, stiff.elastic(n) / (w * w));
    }
    rows.stiffness(r) = least < Kokkos::Experimental::infinity_v<double> ? strength * least : 0;
  }
};

/// Sum of 1/2 k |w x|^2 (of what: value), of its change by alpha p, or of k |w p|^2 (form).
enum class GhostSumOf { value, change, form };
template <class S, class X, class Vectors>
struct GhostSum {
  GhostRows<S> rows;
  X x;
  Vectors p;
  double alpha;
  GhostSumOf what;
  template <class Sum>
  KOKKOS_FUNCTION void operator()(int r, Sums<Sum, 1>& sum) const {
    double const k = rows.stiffness(r);
    if (what == GhostSumOf::value) {
      Vec3<double> const s = rows.stretch(r, x);
      sum[0] += static_cast<Sum>(0.5 * k * dot(s, s));
      return;
    }
    Vec3<double> const d = rows.stretch(r, p);
    if (what == GhostSumOf::form) {
      sum[0] += static_cast<Sum>(k * dot(d, d));
    } else {
      sum[0] += static_cast<Sum>(k * alpha * dot(d, rows.stretch(r, x) + 0.5 * alpha * d));
    }
  }
};

/// force = scale k w field
template <class S, class Field>
struct GhostForce {
  GhostRows<S> rows;
  Field field;
  double scale;
  KOKKOS_FUNCTION void operator()(int r) const {
    set_vector(rows.force, r, (scale * rows.stiffness(r)) * rows.stretch(r, field));
  }
};

/// Adds w' force to `to`, and scale w' k w to a diagonal of three or of blocks, where they are
/// there.
template <class S, class T>
struct SpreadGhosts {
  GhostRows<S> rows;
  FixedNodes<S> fixed;
  double scale;
  VectorField<T, S> to, diagonal;
  BlockField<T, S> blocks;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (rows.begin(i) == rows.begin(i + 1) || is_fixed<S>(fixed, i)) return;
    Vec3<double> sum{0, 0, 0};
    double own = 0;
    for (int e = rows.begin(i); e < rows.begin(i + 1); ++e) {
      int const r = rows.entry(e) / 27, k = rows.entry(e) % 27;
      double const w = rows.weight(r, k);
      sum = sum + w * vector_of<double>(rows.force, r);
      own += scale * rows.stiffness(r) * w * w;
    }
    for (int c = 0; c < 3; ++c) {
      if (to.extent(0) > 0) to(i, c) += static_cast<T>(sum[c]);
      if (diagonal.extent(0) > 0) diagonal(i, c) += static_cast<T>(own);
      if (blocks.extent(0) > 0) blocks(i, c) += static_cast<T>(own);
    }
  }
};

/// Adds the row of node i of scale w' k w: calls add(node, dx, dy, dz, number) for what stands on
/// the diagonal of its blocks.
template <class S, class Add>
KOKKOS_FORCEINLINE_FUNCTION void add_ghost_row(GhostRows<S> const& rows, FixedNodes<S> const& fixed,
                                               double scale, int i, Add const& add) {
  if (is_fixed<S>(fixed, i)) return;
  for (int e = rows.begin(i); e < rows.begin(i + 1); ++e) {
    int const r = rows.entry(e) / 27, k = rows.entry(e) % 27;
    double const own = scale * rows.stiffness(r) * rows.weight(r, k);
    for (int m = 0; m < 27; ++m) {
      int const j = rows.node(r, m);
      if (j < 0 || is_fixed<S>(fixed, j)) continue;
      add(j, m / 9 - k / 9, m / 3 % 3 - k / 3 % 3, m % 3 - k % 3, own * rows.weight(r, m));
    }
  }
}
template <class S, class Matrix>
struct AssembleGhosts {
  GhostRows<S> rows;
  FixedNodes<S> fixed;
  double scale;
  Matrix matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    add_ghost_row(rows, fixed, scale, i, [&](int j, int, int, int, double number) {
      matrix.add(i, j, number * identity3<double>());
    });
  }
};
template <class S, class TM, int R>
struct AddGhostRows {
  GhostRows<S> rows;
  FixedNodes<S> fixed;
  double scale;
  Kokkos::View<int const*, typename S::memory> row_of;  ///< as that of AssembleCells
  GridMatrix<S, TM, R> matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    int const to = row_of.extent(0) == 0 ? i : row_of(i);
    if (to < 0) return;
    add_ghost_row(rows, fixed, scale, i, [&](int, int dx, int dy, int dz, double number) {
      for (int c = 0; c < 3; ++c) {
        matrix.entry(to, StencilRow<R>::place(dx, dy, dz, c, c)) += TM(number);
      }
    });
  }
};

/// coarse += P' (scale w' k w) P: all of a coarse row by one thread, from the rows that reach it.
template <class S, class Embedding, class TM, int R>
struct AddCoarseGhosts {
  static constexpr int r = Embedding::radius;
  static constexpr int along = (2 + 2 * r) / 2 + 1;  ///< coarse nodes that a window reaches
  static_assert(along - 1 <= R);
  GhostRows<S> rows;
  FixedNodes<S> fixed;
  double scale;
  GridMatrix<S, TM, R> coarse;

  KOKKOS_FUNCTION void operator()(int i) const { row(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void row(int i) const {
    int const at[3] = {coarse.nodes.ijk(i, 0), coarse.nodes.ijk(i, 1), coarse.nodes.ijk(i, 2)};
    if (!reached(at)) return;
    constexpr int reach = r + 2;
    for (int a = -reach; a <= reach; ++a)
      for (int b = -reach; b <= reach; ++b)
        for (int c = -reach; c <= reach; ++c) {
          int const l = rows.nodes.node(2 * at[0] + a, 2 * at[1] + b, 2 * at[2] + c);
          int const g = l >= 0 ? rows.row(l) : -1;
          if (g >= 0) add(i, at, g);
        }
  }

private:
  /// Whether a row has to do with a node that the coarse one moves.
  KOKKOS_FUNCTION bool reached(int const (&at)[3]) const {
    for (int a = -r; a <= r; ++a)
      for (int b = -r; b <= r; ++b)
        for (int c = -r; c <= r; ++c) {
          int const f = rows.nodes.node(2 * at[0] + a, 2 * at[1] + b, 2 * at[2] + c);
          if (f >= 0 && rows.begin(f) < rows.begin(f + 1)) return true;
        }
    return false;
  }
  KOKKOS_FUNCTION void add(int i, int const (&at)[3], int g) const {
    // P' w, on the coarse nodes from `low` on.
    int low[3], own[3];
    for (int c = 0; c < 3; ++c) {
      low[c] = (rows.middle(g, c) - 1 - r + 1) >> 1;
      own[c] = at[c] - low[c];
      if (own[c] < 0 || own[c] >= along) return;
    }
    double w[along][along][along] = {};
    for (int k = 0; k < 27; ++k) {
      int const f = rows.node(g, k);
      if (f < 0 || is_fixed<S>(fixed, f)) continue;
      int const x = rows.middle(g, 0) + k / 9 - 1, y = rows.middle(g, 1) + k / 3 % 3 - 1,
                z = rows.middle(g, 2) + k % 3 - 1;
      for (int u = (x - r + 1) >> 1; 2 * u <= x + r; ++u)
        for (int v = (y - r + 1) >> 1; 2 * v <= y + r; ++v)
          for (int t = (z - r + 1) >> 1; 2 * t <= z + r; ++t) {
            w[u - low[0]][v - low[1]][t - low[2]] +=
                rows.weight(g, k) * Embedding::weight(x - 2 * u) * Embedding::weight(y - 2 * v) *
                Embedding::weight(z - 2 * t);
          }
    }
    double const share = scale * rows.stiffness(g) * w[own[0]][own[1]][own[2]];
    if (share == 0) return;
    for (int u = 0; u < along; ++u)
      for (int v = 0; v < along; ++v)
        for (int t = 0; t < along; ++t) {
          if (w[u][v][t] == 0) continue;
          for (int c = 0; c < 3; ++c) {
            coarse.entry(i, StencilRow<R>::place(u - own[0], v - own[1], t - own[2], c, c)) +=
                TM(share * w[u][v][t]);
          }
        }
  }
};

}  // namespace kernels
}  // namespace taut
