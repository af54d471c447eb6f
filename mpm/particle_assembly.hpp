// Matrices over grid nodes from particles, by the numbers of particle_operator_kernels.hpp: the
// fine matrix, or at once that of the next coarser level, P'AP, which needs no fine one. A particle
// sees coarse node J with the gradient
//
//   grad w_J = Sum_n P_nJ grad w_n,      block (I, J) += Sum_uv (grad w_I)_u K_uv (grad w_J)_v,
//
// over the fine nodes that are free (embedding.hpp). Particles of a cell see the same nodes, so
// their blocks are added up before they go to memory: for each of the six pairs of components (k <=
// l) a dense matrix over the nodes of the cell, in loops that fill registers.
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
  static constexpr int most = along * along * along, padded = (most + 7) / 8 * 8;
  static constexpr int chunk = 8;  ///< particles at a time
  static constexpr int lanes = BlockSweep<S, T, K, false>::lanes;
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
  struct Gradients {
    TM w[3][padded];
  };

  KOKKOS_FUNCTION void operator()(int k) const {
    int const block = order(first + k);
    for (int patch = blocks.patch_begin(block); patch < blocks.patch_begin(block + 1); ++patch) {
      for (int c = 0; c < 64; ++c) add_cell(patch, c);
    }
  }

private:
  KOKKOS_FORCEINLINE_FUNCTION T number(int slot, int k) const {
    return data((std::size_t(slot / lanes) * operator_numbers + k) * lanes + slot % lanes);
  }

  KOKKOS_FUNCTION void add_cell(int patch, int c) const {
    int const local = BlockViews<K, S>::local(c >> 4, c >> 2 & 3, c & 3);
    std::uint16_t const corner = static_cast<std::uint16_t>(4 * local);
    int const begin = blocks.slot_begin(patch), end = begin + blocks.count(patch);
    Cell cell;
    int slot[chunk], count = 0;
    bool known = false;
    for (int s = begin; s < end; ++s) {
      if (blocks.corner(s) != corner) continue;
      if (!known) {
        see(patch, c, local, cell);
        known = true;
        if (!cell.wanted) return;
      }
      slot[count++] = s;
      if (count < chunk) continue;
      add(cell, slot, count);
      count = 0;
    }
    if (count > 0) add(cell, slot, count);
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
  KOKKOS_FUNCTION void gradients(Cell const& cell, int slot, Gradients& to) const {
    Weights<K, TM> const at({TM(number(slot, 0)), TM(number(slot, 1)), TM(number(slot, 2))});
    int const np = (cell.count + 7) / 8 * 8;
    for (int u = 0; u < 3; ++u)
      for (int j = 0; j < np; ++j) to.w[u][j] = 0;
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
    Gradients of[chunk];
    for (int m = 0; m < count; ++m) gradients(cell, slot[m], of[m]);
    int const np = (cell.count + 7) / 8 * 8;
    for (int k = 0; k < 3; ++k)
      for (int l = k; l < 3; ++l) {
        TM sum[most * padded];
        for (int i = 0; i < cell.count; ++i)
          for (int j = 0; j < np; ++j) sum[i * padded + j] = 0;
        for (int m = 0; m < count; ++m) {
          TM Kp[3][3];
          for (int u = 0; u < 3; ++u)
            for (int v = 0; v < 3; ++v) {
              Kp[u][v] = TM(number(slot[m], operator_number(k + 3 * u, l + 3 * v)));
            }
          Gradients const& own = of[m];
          for (int i = 0; i < cell.count; ++i) {
            TM y[3];
            for (int v = 0; v < 3; ++v) {
              y[v] = own.w[0][i] * Kp[0][v] + own.w[1][i] * Kp[1][v] + own.w[2][i] * Kp[2][v];
            }
            TM* const to = sum + i * padded;
            for (int j = 0; j < np; j += 8)
              for (int e = 0; e < 8; ++e) {
                to[j + e] +=
                    y[0] * own.w[0][j + e] + y[1] * own.w[1][j + e] + y[2] * own.w[2][j + e];
              }
          }
        }
        flush(cell, sum, k, l);
      }
  }

  KOKKOS_FUNCTION void flush(Cell const& cell, TM const* sum, int k, int l) const {
    int const across = cell.n[1] * cell.n[2];
    for (int i = 0; i < cell.count; ++i) {
      int const row = cell.row[i];
      if (row < 0) continue;
      int const x = i / across, y = i / cell.n[2] % cell.n[1], z = i % cell.n[2];
      int j = 0;
      for (int a = 0; a < cell.n[0]; ++a)
        for (int b = 0; b < cell.n[1]; ++b) {
          int const place = Row::place(a - x, b - y, -z, 0, 0);
          for (int c = 0; c < cell.n[2]; ++c, ++j) {
            matrix.entry(row, place + 3 * c + k * Row::padded + l) += sum[i * padded + j];
            if (k != l) {
              matrix.entry(row, place + 3 * c + l * Row::padded + k) += sum[j * padded + i];
            }
          }
        }
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
