// Matrices over grid nodes from particles, by the numbers of particle_operator_kernels.hpp: the
// fine matrix, or at once that of the next coarser level, P'AP, which needs no fine one. A particle
// sees coarse node J with the gradient
//
//   grad w_J = Sum_n P_nJ grad w_n,      block (I, J) += Sum_uv (grad w_I)_u K_uv (grad w_J)_v,
//
// over the fine nodes that are free (embedding.hpp). Particles of a cell see the same nodes, so
// their blocks are added up in registers before they go to memory, a row of nodes at a time:
//
//   y_p = (grad w_I)_u K_uv (3 x 9 numbers per particle),   row of I += Sum_p y_pv (grad w_J)_v
//
// for the J in I's line along z and after it; the other half of the matrix is the mirror image of
// this one, and is taken from it at the end.
//
// Blocks of 4^3 cells of one colour, two blocks apart, share no row, and each is one thread's.
#pragma once

#include <taut/core/exec/sort.hpp>
#include <taut/mpm/embedding.hpp>
#include <taut/mpm/grid_matrix.hpp>
#include <taut/mpm/particle_operator_kernels.hpp>

namespace taut {

/// The level as it is: P = 1.
struct NoEmbedding {
  static constexpr int radius = 0;
  KOKKOS_FORCEINLINE_FUNCTION static double weight(int) { return 1; }
};

namespace kernels {

template <Spline K, class S>
struct ColourOfBlock {
  BlockViews<K, S> blocks;
  Kokkos::View<int*, typename S::memory> colour;
  KOKKOS_FUNCTION void operator()(int block) const {
    int parity = 0;
    for (int c = 0; c < 3; ++c) {
      parity = 2 * parity + (blocks.origin(block, c) / BlockViews<K, S>::cells & 1);
    }
    colour(block) = parity;
  }
};

template <class S, class T, Spline K, class Embedding, class TM, int R>
struct AssembleCells {
  static constexpr int r = Embedding::radius;
  static constexpr int factor = r == 0 ? 1 : 2;  ///< of the spacings
  /// Blocks of a colour must share no row.
  static_assert(r <= 1, "a wider embedding is taken from the fine matrix (galerkin.hpp)");
  static constexpr int along = (K::width - 1 + 2 * r) / factor + 1;  ///< nodes along an axis
  using Pack = std::conditional_t<S::on_host, HostPack<TM>, TM>;
  static constexpr int width = ScalarTraits<Pack>::lanes;
  KOKKOS_FORCEINLINE_FUNCTION static constexpr int whole(int n) {
    return (n + width - 1) / width * width;
  }
  static constexpr int most = along * along * along, padded = whole(most);
  static constexpr int chunk = 8;  ///< particles at a time
  static_assert(along - 1 <= R);
  using Row = StencilRow<R>;

  BlockViews<K, S> blocks;
  Kokkos::View<T const*, typename S::memory> data;
  FixedNodes<S> fixed;
  Kokkos::View<int const*, typename S::memory> order;  ///< blocks, colour after colour
  int first;                                           ///< of the colour
  GridMatrix<S, TM, R> matrix;
  /// Per node of the matrix's grid: its row, or -1; empty: its number.
  Kokkos::View<int const*, typename S::memory> row_of;
  bool half;  ///< only the lines of nodes from a node's own on, see MirrorRow

  /// The nodes that a cell sees of the matrix's grid.
  struct Cell {
    int base[3];       ///< lowest fine node
    int low[3], n[3];  ///< lowest node, and how many along each axis
    int count;         ///< in all
    int row[most];     ///< or -1
    int const* fine;   ///< number of the fine node at the cell's corner in the block's table
    bool free;         ///< no fine node is fixed
    bool wanted;       ///< there is a row
  };
  /// What a particle has to do with them.
  struct Seen {
    TM w[3][padded];            ///< the gradients of the nodes
    TM stiffness[9][whole(9)];  ///< K_(k u)(l v) at [k + 3 u][l + 3 v]
  };

  KOKKOS_FUNCTION void operator()(int k) const {
    int const block = order(first + k);
    for (int patch = blocks.patch_begin(block); patch < blocks.patch_begin(block + 1); ++patch) {
      add_patch(patch);
    }
  }

private:
  KOKKOS_FORCEINLINE_FUNCTION T number(int slot, int k) const {
    return data(OperatorLayout<S, T>::place(slot, k));
  }

  /// Of every cell the particles of `chunk` rounds, then of the next.
  KOKKOS_FUNCTION void add_patch(int patch) const {
    constexpr int cells = 64;
    using Views = BlockViews<K, S>;
    int const begin = blocks.slot_begin(patch), count = blocks.count(patch);
    for (int from = 0, round = 0; from < count; round += chunk) {
      int slot[cells][chunk], held[cells] = {};
      for (int now = round; now < round + chunk && from < count; ++now) {
        for (int const end = blocks.round_end(begin + now); from < end; ++from) {
          int const local = blocks.corner(begin + from) / 4;
          int const c = 16 * (local / (Views::side * Views::side)) +
                        4 * (local / Views::side % Views::side) + local % Views::side;
          slot[c][held[c]++] = begin + from;
        }
      }
      for (int c = 0; c < cells; ++c) {
        if (held[c] == 0) continue;
        Cell cell;
        see(patch, c, Views::local(c >> 4, c >> 2 & 3, c & 3), cell);
        if (cell.wanted) add(cell, slot[c], held[c]);
      }
    }
  }

  KOKKOS_FUNCTION void see(int patch, int c, int local, Cell& cell) const {
    int const block = blocks.block(patch);
    int const at[3] = {c >> 4, c >> 2 & 3, c & 3};
    for (int d = 0; d < 3; ++d) {
      cell.base[d] = blocks.origin(block, d) + at[d];
      if constexpr (factor == 1) {
        cell.low[d] = cell.base[d];
        cell.n[d] = K::width;
      } else {
        cell.low[d] = (cell.base[d] - r + 1) >> 1;
        cell.n[d] = ((cell.base[d] + K::width - 1 + r) >> 1) - cell.low[d] + 1;
      }
    }
    cell.fine = blocks.nodes_of(patch) + local;
    cell.free = true;
    for (int a = 0; a < K::width; ++a)
      for (int b = 0; b < K::width; ++b)
        for (int e = 0; e < K::width; ++e) {
          if (is_fixed<S>(fixed, cell.fine[BlockViews<K, S>::local(a, b, e)])) cell.free = false;
        }
    cell.count = 0;
    cell.wanted = false;
    for (int i = 0; i < cell.n[0]; ++i)
      for (int j = 0; j < cell.n[1]; ++j)
        for (int k = 0; k < cell.n[2]; ++k) {
          int const node = matrix.nodes.node(cell.low[0] + i, cell.low[1] + j, cell.low[2] + k);
          int const row = node < 0 || row_of.extent(0) == 0 ? node : row_of(node);
          cell.row[cell.count++] = row;
          cell.wanted = cell.wanted || row >= 0;
        }
  }

  /// The gradients of the nodes of the cell at a particle, per fine cell.
  KOKKOS_FUNCTION void gradients(Cell const& cell, int slot, Seen& to) const {
    Weights<K, TM> const at({TM(number(slot, 0)), TM(number(slot, 1)), TM(number(slot, 2))});
    for (int u = 0; u < 3; ++u)
      for (int j = 0; j < padded; ++j) to.w[u][j] = 0;
    if (cell.free) {
      TM w[3][along], d[3][along];
      for (int c = 0; c < 3; ++c)
        for (int j = 0; j < cell.n[c]; ++j) {
          w[c][j] = d[c][j] = 0;
          for (int i = 0; i < K::width; ++i) {
            TM const share = embedded(cell.base[c] + i - factor * (cell.low[c] + j));
            w[c][j] += share * at.w[c][i];
            d[c][j] += share * at.d[c][i];
          }
        }
      int n = 0;
      for (int i = 0; i < cell.n[0]; ++i)
        for (int j = 0; j < cell.n[1]; ++j)
          for (int k = 0; k < cell.n[2]; ++k, ++n) {
            to.w[0][n] = d[0][i] * w[1][j] * w[2][k];
            to.w[1][n] = w[0][i] * d[1][j] * w[2][k];
            to.w[2][n] = w[0][i] * w[1][j] * d[2][k];
          }
      return;
    }
    for (int a = 0; a < K::width; ++a)
      for (int b = 0; b < K::width; ++b)
        for (int c = 0; c < K::width; ++c) {
          if (is_fixed<S>(fixed, cell.fine[BlockViews<K, S>::local(a, b, c)])) continue;
          Vec3<TM> const g = at.gradient(a, b, c);
          int n = 0;
          for (int i = 0; i < cell.n[0]; ++i)
            for (int j = 0; j < cell.n[1]; ++j)
              for (int k = 0; k < cell.n[2]; ++k, ++n) {
                TM const share = embedded(cell.base[0] + a - factor * (cell.low[0] + i)) *
                                 embedded(cell.base[1] + b - factor * (cell.low[1] + j)) *
                                 embedded(cell.base[2] + c - factor * (cell.low[2] + k));
                for (int u = 0; u < 3; ++u) to.w[u][n] += share * g[u];
              }
        }
  }
  KOKKOS_FORCEINLINE_FUNCTION static TM embedded(int d) {
    return d < -r || d > r ? TM(0) : TM(Embedding::weight(d));
  }

  [[gnu::noinline]] KOKKOS_FUNCTION void add(Cell const& cell, int const (&slot)[chunk],
                                             int count) const {
    Seen seen[chunk];
    for (int m = 0; m < count; ++m) {
      gradients(cell, slot[m], seen[m]);
      for (int q = 0; q < 9; ++q) {
        for (int p = 0; p < 9; ++p)
          seen[m].stiffness[q][p] = TM(number(slot[m], operator_number(q, p)));
        for (int p = 9; p < whole(9); ++p) seen[m].stiffness[q][p] = 0;
      }
    }
    int const across = cell.n[1] * cell.n[2];
    for (int i = 0; i < cell.count; ++i) {
      int const row = cell.row[i];
      if (row < 0) continue;
      int const x = i / across, y = i / cell.n[2] % cell.n[1], z = i % cell.n[2];
      int const line = half ? cell.n[1] * x + y : 0;
      bring_near(cell, row, x, y, line);
      TM sum[9][padded];
      add_row(seen, count, i, line * cell.n[2], cell.count, sum);
      flush(cell, row, x, y, z, line, sum);
    }
  }

  /// sum[3 k + l][j] for the nodes j from `begin` on.
  KOKKOS_FORCEINLINE_FUNCTION void add_row(Seen const (&seen)[chunk], int count, int i, int begin,
                                           int end, TM (&sum)[9][padded]) const {
    TM y[chunk][3][whole(9)];
    for (int m = 0; m < count; ++m) {
      Pack const g[3] = {Pack(seen[m].w[0][i]), Pack(seen[m].w[1][i]), Pack(seen[m].w[2][i])};
      for (int k = 0; k < 3; ++k)
        for (int q = 0; q < whole(9); q += width) {
          store(Pack(g[0] * load<Pack>(&seen[m].stiffness[k][q]) +
                     g[1] * load<Pack>(&seen[m].stiffness[k + 3][q]) +
                     g[2] * load<Pack>(&seen[m].stiffness[k + 6][q])),
                &y[m][k][q]);
        }
    }
    for (int j = begin / width * width; j < end; j += width) {
      Pack own[9];
      for (Pack& s : own) s = Pack(TM(0));
      for (int m = 0; m < count; ++m)
        for (int v = 0; v < 3; ++v) {
          Pack const w = load<Pack>(&seen[m].w[v][j]);
          for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l)
              own[3 * k + l] = own[3 * k + l] + Pack(y[m][k][3 * v + l]) * w;
        }
      for (int kl = 0; kl < 9; ++kl) store(own[kl], &sum[kl][j]);
    }
  }

  /// What `flush` is going to add to, while there is something else to do.
  KOKKOS_FORCEINLINE_FUNCTION void bring_near(Cell const& cell, int row, int x, int y,
                                              int line) const {
    for (; line < cell.n[0] * cell.n[1]; ++line) {
      prefetch_run(matrix, row, Row::place(line / cell.n[1] - x, line % cell.n[1] - y, -R, 0, 0));
    }
  }
  KOKKOS_FORCEINLINE_FUNCTION void flush(Cell const& cell, int row, int x, int y, int z, int line,
                                         TM const (&sum)[9][padded]) const {
    int const nz = factor == 1 ? K::width : cell.n[2];
    for (; line < cell.n[0] * cell.n[1]; ++line) {
      int const place = Row::place(line / cell.n[1] - x, line % cell.n[1] - y, -z, 0, 0);
      for (int k = 0; k < 3; ++k)
        for (int c = 0; c < nz; ++c)
          for (int l = 0; l < 3; ++l) {
            matrix.entry(row, place + k * Row::padded + 3 * c + l) += sum[3 * k + l][line * nz + c];
          }
    }
  }
};

/// Row i in the lines of nodes before its own, from the rows of the nodes there.
template <class S, class TM, int R>
struct MirrorRow {
  GridMatrix<S, TM, R> matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    using Row = StencilRow<R>;
    auto const& nodes = matrix.nodes;
    int const leaf = nodes.leaf(i), at[3] = {nodes.ijk(i, 0), nodes.ijk(i, 1), nodes.ijk(i, 2)};
    for (int run = 0; run < Row::runs / 2; ++run) {
      int const dx = run / Row::width - R, dy = run % Row::width - R;
      int next = -1;
      TM own[3][Row::padded] = {};
      for (int dz = -R; dz <= R; ++dz) {
        int const j = nodes.near(leaf, at[0] + dx, at[1] + dy, at[2] + dz);
        if (j < 0) continue;
        next = j + 1;
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r) {
            own[r][3 * (dz + R) + c] = matrix.entry(j, Row::place(-dx, -dy, -dz, c, r));
          }
      }
      // The next row along z is mostly what is wanted next.
      if (next >= 0 && next < nodes.count) {
        prefetch_run(matrix, next, Row::place(-dx, -dy, -R, 0, 0));
      }
      int const first = Row::place(dx, dy, -R, 0, 0);
      for (int r = 0; r < 3; ++r)
        for (int k = 0; k < Row::padded; ++k)
          matrix.entry(i, first + r * Row::padded + k) = own[r][k];
    }
  }
};

/// coarse += P' D P with the blocks D of single fine nodes.
template <class S, class Embedding, class T, class TM, int R>
struct AddCoarseBlocks {
  static constexpr int r = Embedding::radius;
  GridNodes<S> fine;
  FixedNodes<S> fixed;
  BlockField<T, S> blocks;
  GridMatrix<S, TM, R> coarse;

  KOKKOS_FUNCTION void operator()(int i) const { row(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void row(int i) const {
    using Row = StencilRow<R>;
    int const x = 2 * coarse.nodes.ijk(i, 0), y = 2 * coarse.nodes.ijk(i, 1),
              z = 2 * coarse.nodes.ijk(i, 2);
    for (int a = -r; a <= r; ++a)
      for (int b = -r; b <= r; ++b)
        for (int c = -r; c <= r; ++c) {
          int const f = fine.node(x + a, y + b, z + c);
          if (f < 0 || is_fixed<S>(fixed, f)) continue;
          double const w = Embedding::weight(a) * Embedding::weight(b) * Embedding::weight(c);
          Sym3<double> own;
          for (int k = 0; k < 6; ++k) own.s[k] = w * double(blocks(f, k));
          Mat3<double> const block = to_matrix(own);
          // Nodes D from here with |(a, b, c) - 2D| <= r along each axis.
          for (int dx = (a - r + 1) >> 1; 2 * dx <= a + r; ++dx)
            for (int dy = (b - r + 1) >> 1; 2 * dy <= b + r; ++dy)
              for (int dz = (c - r + 1) >> 1; 2 * dz <= c + r; ++dz) {
                double const share = Embedding::weight(a - 2 * dx) * Embedding::weight(b - 2 * dy) *
                                     Embedding::weight(c - 2 * dz);
                for (int k = 0; k < 3; ++k)
                  for (int l = 0; l < 3; ++l) {
                    coarse.entry(i, Row::place(dx, dy, dz, k, l)) += TM(share * block(k, l));
                  }
              }
        }
  }
};

/// The blocks of single nodes in the fine matrix.
template <class S, class T, class TM, int R>
struct AddNodeBlocks {
  BlockField<T, S> blocks;
  Kokkos::View<int const*, typename S::memory> row_of;  ///< as that of AssembleCells
  GridMatrix<S, TM, R> matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    int const row = row_of.extent(0) == 0 ? i : row_of(i);
    if (row < 0) return;
    Sym3<T> own;
    for (int k = 0; k < 6; ++k) own.s[k] = blocks(i, k);
    Mat3<T> const block = to_matrix(own);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) {
        matrix.entry(row, StencilRow<R>::place(0, 0, 0, k, l)) += TM(block(k, l));
      }
  }
};

}  // namespace kernels

/// The blocks of a grid, colour after colour.
template <Spline K, class S>
class BlockColours {
public:
  static constexpr int colours = 8;
  explicit BlockColours(BlockViews<K, S> const& blocks) : order_("colour_order", blocks.blocks) {
    Kokkos::View<int*, typename S::memory> const colour("block_colour", blocks.blocks),
        begin("colour_begin", colours + 1);
    for_each<S>("block_colour", blocks.blocks, kernels::ColourOfBlock<K, S>{blocks, colour});
    BucketSort<S>(blocks.blocks).sort(blocks.blocks, colour, colours, begin, order_);
    begin_ = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), begin);
  }
  Kokkos::View<int*, typename S::memory> const& order() const { return order_; }
  int begin(int colour) const { return begin_(colour); }
  int size(int colour) const { return begin_(colour + 1) - begin_(colour); }

private:
  Kokkos::View<int*, typename S::memory> order_;
  Kokkos::View<int*, Kokkos::HostSpace> begin_;
};

}  // namespace taut
