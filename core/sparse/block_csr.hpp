// Compressed sparse rows of 3x3 blocks: the assembled Hessian of a potential over 3-vectors.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/sparse/pattern.hpp>

namespace taut {

/// Square matrix of n x n blocks of 3x3. The columns of a row are sorted; the diagonal block is
/// always present. Both triangles are stored. A block's nine numbers are stored by columns.
template <class S, class T = double>
struct BlockCsr {
  using Block = Mat3<T>;

  Kokkos::View<int*, typename S::memory> row_begin;  ///< n + 1
  Kokkos::View<int*, typename S::memory> column;     ///< one per block
  Kokkos::View<Block*, typename S::memory> block;

  BlockCsr() = default;

  /// The matrix of this pattern whose blocks are zero.
  explicit BlockCsr(BlockPattern const& pattern)
      : row_begin("row_begin", pattern.row_begin.size()),
        column("column", pattern.column.size()),
        block("block", pattern.column.size()) {
    using Host = Kokkos::View<int const*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged>;
    assign(row_begin, Host(pattern.row_begin.data(), pattern.row_begin.size()));
    assign(column, Host(pattern.column.data(), pattern.column.size()));
  }

  KOKKOS_FUNCTION int rows() const {
    return static_cast<int>(row_begin.extent(0)) - (row_begin.extent(0) > 0 ? 1 : 0);
  }

  /// Position of block (i, j) in `block`, or -1 if it is not stored. O(log of the row's length).
  KOKKOS_FUNCTION int find(int i, int j) const {
    int low = row_begin(i), high = row_begin(i + 1);
    while (low < high) {
      int const middle = (low + high) / 2;
      if (column(middle) < j) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low < row_begin(i + 1) && column(low) == j ? low : -1;
  }

  /// Adds `b` to block (i, j), which must be stored. Not atomic, for an atomic sum would depend on
  /// the order of the threads: elements that run side by side must share no row (one colour at a
  /// time).
  KOKKOS_FUNCTION void add(int i, int j, Block const& b) const {
    int const k = find(i, j);
    if (k < 0) Kokkos::abort("taut: BlockCsr::add: the pattern has no such block");
    for (int m = 0; m < 9; ++m) block(k).a[m] += b.a[m];
  }
};

/// A copy in host memory (the matrix itself if it is there already).
template <class S, class T>
BlockCsr<SerialSpace, T> host_copy(BlockCsr<S, T> const& matrix) {
  BlockCsr<SerialSpace, T> host;
  host.row_begin = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), matrix.row_begin);
  host.column = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), matrix.column);
  host.block = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), matrix.block);
  return host;
}

}  // namespace taut
