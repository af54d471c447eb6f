// Matrices over the nodes of a grid: one 3x3 block for each offset within `radius` nodes along each
// axis, (2 radius + 1)^3 in all, of whatever nodes there are. The offset says which column a block
// belongs to, so there are no column indices; blocks to nodes that are not active are zero.
//
// A row of blocks is stored as runs along z: for each (dx, dy), three rows of 3 (2 radius + 1)
// numbers, which meet the vectors of consecutive places in a window (node_block.hpp).
#pragma once

#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/floored_inverse.hpp>
#include <taut/core/math/scalar.hpp>
#include <taut/core/sparse/block_csr.hpp>
#include <taut/mpm/node_block.hpp>

namespace taut {

/// The shape of a row.
template <int radius>
struct StencilRow {
  static constexpr int width = 2 * radius + 1, runs = width * width, offsets = runs * width;
  static constexpr int padded = (3 * width + 3) / 4 * 4;  ///< of a run; the pad is zero
  static constexpr int numbers = 3 * runs * padded;

  /// Where entry (r, c) of the block to the node at (dx, dy, dz) is.
  KOKKOS_FORCEINLINE_FUNCTION static int place(int dx, int dy, int dz, int r, int c) {
    return (3 * ((dx + radius) * width + dy + radius) + r) * padded + 3 * (dz + radius) + c;
  }
};

/// A square matrix over grid nodes. A plain view: copies share the numbers.
template <class S, class T, int radius_>
struct GridMatrix {
  static constexpr int radius = radius_;
  using Row = StencilRow<radius>;
  using Scalar = T;

  GridNodes<S> nodes;
  Kokkos::View<T * [Row::numbers], typename S::layout, typename S::memory> entry;

  /// Takes on the nodes, with the numbers not set. Allocates only where there are more nodes than
  /// ever.
  void resize(GridNodes<S> const& on) {
    nodes = on;
    grow(entry, "grid_matrix", static_cast<std::size_t>(on.count));
  }
  KOKKOS_FUNCTION int size() const { return nodes.count; }

  KOKKOS_FUNCTION Mat3<T> block(int i, int dx, int dy, int dz) const {
    Mat3<T> b;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) b(r, c) = entry(i, Row::place(dx, dy, dz, r, c));
    return b;
  }
  KOKKOS_FUNCTION void set(int i, int dx, int dy, int dz, Mat3<T> const& b) const {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) entry(i, Row::place(dx, dy, dz, r, c)) = b(r, c);
  }
  /// Bytes held.
  std::size_t memory() const { return entry.span() * sizeof(T); }
};

namespace kernels {

template <class Matrix>
struct ZeroRow {
  Matrix a;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int e = 0; e < Matrix::Row::numbers; ++e) a.entry(i, e) = 0;
  }
};

/// Whether a sweep that counts `part` finds anything but zero in the run (dx, dy) of a node that is
/// at (x, y) of a block. Blocks that differ in x and y are before or after as a whole; in the
/// block's own column of blocks, z decides between blocks, and the order of runs within one.
KOKKOS_FORCEINLINE_FUNCTION bool run_counts(Part part, int octant, int x, int y, int dx, int dy) {
  if (part == Part::all) return true;
  int const bx = (x + dx) < 0 || (x + dx) > 3, by = (y + dy) < 0 || (y + dy) > 3;
  int const own = octant >> 1, column = own ^ (2 * bx + by);
  bool const before = part == Part::before;
  if (column != own) return before == (column < own);
  if (before == ((octant & 1) == 1)) return true;
  int const order = 8 * dx + dy;
  return before ? order <= 0 : order >= 0;
}

/// Brings a run of row i near. Rows are read once per sweep, and half of one is no stream that
/// hardware would see through.
template <class S, class T, int radius>
KOKKOS_FORCEINLINE_FUNCTION void prefetch_run(GridMatrix<S, T, radius> const& a, int i, int first) {
#if defined(__GNUC__) && !defined(__CUDACC__)
  if constexpr (S::on_host && std::is_same_v<typename S::layout, Kokkos::LayoutRight>) {
    constexpr int line = 64 / sizeof(T), numbers = 3 * StencilRow<radius>::padded;
    T const* const run = &a.entry(i, first);
    for (int k = 0; k < numbers; k += line) __builtin_prefetch(run + k);
  }
#endif
  (void)a, (void)i, (void)first;
}

/// What is summed up side by side: a register on the host, where a run is as many as one.
template <class S, class T, int radius>
using RunPack = std::conditional_t<S::on_host && StencilRow<radius>::padded % host_lanes<T> == 0,
                                   HostPack<T>, T>;

/// sum_j A_ij x_j over the runs of the t-th node of a block that count; `x` is a window of `part`,
/// and `next` the node that comes after. On the host in as many sums as a run has numbers, which
/// are added up last: additions may not be reordered, and this is an order that fills the
/// registers.
template <class S, class T, int radius>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> row_times(GridMatrix<S, T, radius> const& a,
                                              NodeBlock<S> const& block, int t, int next,
                                              Window<T, radius>& window, Part part) {
  using Row = StencilRow<radius>;
  using Pack = RunPack<S, T, radius>;
  constexpr int width = ScalarTraits<Pack>::lanes, packs = S::on_host ? Row::padded / width : 1;
  Pack sum[3][packs];
  for (int r = 0; r < 3; ++r)
    for (int k = 0; k < packs; ++k) sum[r][k] = Pack(T(0));
  int const place = block.place[t], px = place / 16, py = place / 4 % 4, pz = place % 4;
  bool const ahead = next >= 0 && next < block.count;
  int const after = ahead ? block.node[next] : 0, after_place = ahead ? block.place[next] : 0;
  T const* const row = &a.entry(block.node[t], 0);
  std::size_t const stride = a.entry.stride_1();
  for (int dx = -radius; dx <= radius; ++dx)
    for (int dy = -radius; dy <= radius; ++dy) {
      int const first = Row::place(dx, dy, -radius, 0, 0);
      if (ahead && run_counts(part, block.octant, after_place / 16, after_place / 4 % 4, dx, dy)) {
        prefetch_run(a, after, first);
      }
      if (!run_counts(part, block.octant, px, py, dx, dy)) continue;
      T const* const x = window.at(px + dx, py + dy, pz - radius);
      for (int k = 0; k < Row::padded; k += width) {
        Pack const own = load<Pack>(x + k);
        for (int r = 0; r < 3; ++r) {
          Pack& to = sum[r][k / width % packs];
          if constexpr (std::is_same_v<typename S::layout, Kokkos::LayoutRight>) {
            to = to + load<Pack>(row + first + r * Row::padded + k) * own;
          } else {
            T const* const run = row + (first + r * Row::padded + k) * stride;
            if constexpr (width == 1) {
              to = to + *run * own;
            } else {
              to = to + Pack([&](std::size_t lane) { return run[lane * stride]; }) * own;
            }
          }
        }
      }
    }
  Vec3<T> total;
  for (int r = 0; r < 3; ++r) {
    for (int k = 1; k < packs; ++k) sum[r][0] = sum[r][0] + sum[r][k];
    T value[width];
    store(sum[r][0], value);
    for (int half = width / 2; half > 0; half /= 2)
      for (int k = 0; k < half; ++k) value[k] += value[k + half];
    total[r] = value[0];
  }
  return total;
}

/// A sweep over the nodes of blocks: hands `update` each node i, its vector in the window and its
/// sum_j A_ij x_j; what that returns takes the node's place in the window. Compiled once
/// ([[gnu::noinline]]), see contact_kernels.hpp.
template <class S, class T, int radius, class Update>
struct SweepBlocks {
  GridMatrix<S, T, radius> a;
  VectorField<T, S> x;  ///< what the window shows
  Update update;
  Part part;
  bool backward;
  int colour;  ///< which block of each leaf; -1: all, one iteration for each

  KOKKOS_FUNCTION void operator()(int t) const {
    if (colour < 0) {
      sweep(t / 8, t % 8);
    } else {
      sweep(t, colour);
    }
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void sweep(int leaf, int octant) const {
    NodeBlock<S> const block(a.nodes, leaf, octant);
    if (block.count == 0) return;
    Window<T, radius> window;
    window.load(a.nodes, block, x, part);
    for (int t = 0; t < block.count; ++t) {
      int const m = backward ? block.count - 1 - t : t;
      int const i = block.node[m], place = block.place[m];
      Vec3<T> const sum = row_times(a, block, m, backward ? m - 1 : m + 1, window, part);
      T* const own = window.at(place / 16, place / 4 % 4, place % 4);
      Vec3<T> const value = update(i, Vec3<T>{own[0], own[1], own[2]}, sum);
      for (int c = 0; c < 3; ++c) own[c] = value[c];
    }
  }
};

/// A forward sweep that tells what it has passed from what is before it: hands `update` each node
/// with its sums over the nodes before and after, and takes its new vector.
template <class S, class T, int radius, class Update>
struct RelaxBlocks {
  GridMatrix<S, T, radius> a;
  VectorField<T, S> x;
  Update update;
  int octant;

  KOKKOS_FUNCTION void operator()(int leaf) const { sweep(leaf); }
  [[gnu::noinline]] KOKKOS_FUNCTION void sweep(int leaf) const {
    NodeBlock<S> const block(a.nodes, leaf, octant);
    if (block.count == 0) return;
    Window<T, radius> before, after;
    before.load(a.nodes, block, x, Part::before);
    after.load(a.nodes, block, x, Part::after);
    auto const at = [&](Window<T, radius>& window, int t) {
      int const place = block.place[t];
      return window.at(place / 16, place / 4 % 4, place % 4);
    };
    for (int t = 0; t < block.count; ++t)
      for (int c = 0; c < 3; ++c) at(after, t)[c] = x(block.node[t], c);
    for (int t = 0; t < block.count; ++t) {
      for (int c = 0; c < 3; ++c) at(after, t)[c] = 0;
      Vec3<T> const passed = row_times(a, block, t, t + 1, before, Part::before);
      Vec3<T> const to_come = row_times(a, block, t, t + 1, after, Part::after);
      Vec3<T> const value = update(block.node[t], passed, to_come);
      for (int c = 0; c < 3; ++c) at(before, t)[c] = value[c];
    }
  }
};

/// y = A x
template <class S, class T>
struct StoreProduct {
  VectorField<T, S> y;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const& own,
                                                 Vec3<T> const& sum) const {
    set_vector(y, i, sum);
    return own;
  }
};

template <class S, class T, int radius>
struct InvertDiagonal {
  GridMatrix<S, T, radius> a;
  BlockField<T, S> inverse;
  KOKKOS_FUNCTION void operator()(int i) const {
    Sym3<T> const d = floored_inverse(symmetric_part(a.block(i, 0, 0, 0)), 1e-6, 0.0);
    for (int k = 0; k < 6; ++k) inverse(i, k) = d.s[k];
  }
};

/// Cuts fixed nodes off: their rows and columns are zero but for their own blocks.
template <class S, class T, int radius>
struct CutOffFixed {
  GridMatrix<S, T, radius> a;
  Kokkos::View<std::uint8_t const*, typename S::memory> fixed;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dz = -radius; dz <= radius; ++dz) {
          int const j = a.nodes.beside(i, dx, dy, dz);
          if (j >= 0 && j != i && (fixed(i) != 0 || fixed(j) != 0)) {
            a.set(i, dx, dy, dz, Mat3<T>{});
          }
        }
  }
};

/// Copies a row; raises `lost` where a block does not fit the stencil.
template <class S, class T, int radius>
struct CopyRow {
  BlockCsr<S, double> from;
  GridMatrix<S, T, radius> to;
  KOKKOS_FUNCTION void operator()(int i, int& lost) const {
    for (int e = 0; e < StencilRow<radius>::numbers; ++e) to.entry(i, e) = 0;
    for (int k = from.row_begin(i); k < from.row_begin(i + 1); ++k) {
      int const j = from.column(k);
      int d[3];
      bool fits = true;
      for (int c = 0; c < 3; ++c) {
        d[c] = to.nodes.ijk(j, c) - to.nodes.ijk(i, c);
        fits = fits && d[c] >= -radius && d[c] <= radius;
      }
      if (!fits) {
        lost = 1;
        continue;
      }
      Mat3<T> b;
      for (int m = 0; m < 9; ++m) b.a[m] = T(from.block(k).a[m]);
      to.set(i, d[0], d[1], d[2], b);
    }
  }
};

}  // namespace kernels

template <class S, class T, int radius>
void set_zero(GridMatrix<S, T, radius> const& a) {
  for_each<S>("grid_matrix_zero", a.size(), kernels::ZeroRow<GridMatrix<S, T, radius>>{a});
}

/// A sweep over all blocks at once, or over colour after colour, in reverse if `backward`.
template <class S, class T, int radius, class Update>
void sweep_blocks(char const* name, GridMatrix<S, T, radius> const& a, VectorField<T, S> const& x,
                  Update const& update, kernels::Part part, bool coloured, bool backward) {
  kernels::SweepBlocks<S, T, radius, Update> kernel{a, x, update, part, backward, -1};
  int const leaves = a.nodes.leaves.count;
  if (!coloured) {
    for_each<S>(name, 8 * leaves, kernel);
    return;
  }
  for (int c = 0; c < 8; ++c) {
    kernel.colour = backward ? 7 - c : c;
    for_each<S>(name, leaves, kernel);
  }
}

/// The same in two sums, over colour after colour.
template <class S, class T, int radius, class Update>
void relax_blocks(char const* name, GridMatrix<S, T, radius> const& a, VectorField<T, S> const& x,
                  Update const& update) {
  for (int c = 0; c < 8; ++c) {
    for_each<S>(name, a.nodes.leaves.count,
                kernels::RelaxBlocks<S, T, radius, Update>{a, x, update, c});
  }
}

/// y = A x; x and y are different.
template <class S, class T, int radius>
void product(GridMatrix<S, T, radius> const& a, VectorField<T, S> const& x,
             VectorField<T, S> const& y) {
  sweep_blocks("grid_product", a, x, kernels::StoreProduct<S, T>{y}, kernels::Part::all, false,
               false);
}

/// Inverses of the diagonal blocks, their eigenvalues at least 1e-6 of the largest of the block.
template <class S, class T, int radius>
void invert_diagonal(GridMatrix<S, T, radius> const& a, BlockField<T, S> const& inverse) {
  for_each<S>("grid_invert", a.size(), kernels::InvertDiagonal<S, T, radius>{a, inverse});
}

/// Zeroes the rows and columns of fixed nodes (one entry per node, not 0 where it is), but for
/// their diagonal blocks.
template <class S, class T, int radius>
void cut_off_fixed(GridMatrix<S, T, radius> const& a,
                   Kokkos::View<std::uint8_t const*, typename S::memory> const& fixed) {
  for_each<S>("grid_cut_off", a.size(), kernels::CutOffFixed<S, T, radius>{a, fixed});
}

/// `to` becomes an assembled matrix whose row i belongs to node i. Throws Error if a node is
/// coupled to one that is farther than the radius.
template <class S, class T, int radius>
void copy(BlockCsr<S, double> const& from, GridMatrix<S, T, radius> const& to) {
  if (from.rows() != to.size()) {
    throw Error("grid matrix: {} rows do not fit {} nodes", from.rows(), to.size());
  }
  if (maximum<S>("grid_copy", to.size(), 0, kernels::CopyRow<S, T, radius>{from, to}) != 0) {
    throw Error("grid matrix: nodes more than {} apart are coupled; take a larger radius", radius);
  }
}

}  // namespace taut
