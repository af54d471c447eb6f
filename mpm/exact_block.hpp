// Blocks of grid matrices that are solved with exactly: all nodes of a level, or some of them, by a
// sparse factor on the host (core/sparse/direct_solver.hpp).
#pragma once

#include <taut/core/exec/scan.hpp>
#include <taut/core/sparse/direct_solver.hpp>
#include <taut/mpm/level_operator.hpp>

#include <limits>
#include <span>

namespace taut {
namespace kernels {

template <class S>
using NodeIndices = Kokkos::View<int*, typename S::memory>;

/// The blocks of a row whose columns are of the block: `part` is the number of a node in it, or -1.
template <class S, class T, int radius>
struct ExactRow {
  static constexpr int most = StencilRow<radius>::offsets;
  GridMatrix<S, T, radius> rows;  ///< of the nodes of the block if `by_part`, else of all
  NodeIndices<S> part;
  bool by_part;
  BlockCsr<S, double> to;

  KOKKOS_FUNCTION int column(int i, int k) const {
    constexpr int width = 2 * radius + 1;
    int const j = rows.nodes.beside(i, k / (width * width) - radius, k / width % width - radius,
                                    k % width - radius);
    return j < 0 ? -1 : part(j);
  }
  KOKKOS_FUNCTION int count(int i) const {
    int found = 0;
    if (part(i) >= 0)
      for (int k = 0; k < most; ++k) found += column(i, k) >= 0;
    return found;
  }
  /// Columns in order, each with its block; what has no diagonal is the identity.
  KOKKOS_FUNCTION void operator()(int i) const {
    int const row = part(i);
    if (row < 0) return;
    constexpr int width = 2 * radius + 1;
    int const first = to.row_begin(row);
    int offset[most];
    int found = 0;
    for (int k = 0; k < most; ++k) {
      int const j = column(i, k);
      if (j < 0) continue;
      int at = found++;
      for (; at > 0 && to.column(first + at - 1) > j; --at) {
        to.column(first + at) = to.column(first + at - 1);
        offset[at] = offset[at - 1];
      }
      to.column(first + at) = j;
      offset[at] = k;
    }
    for (int e = 0; e < found; ++e) {
      int const k = offset[e];
      Mat3<T> const from = rows.block(by_part ? row : i, k / (width * width) - radius,
                                      k / width % width - radius, k % width - radius);
      Mat3<double>& block = to.block(first + e);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) block(r, c) = double(from(r, c));
      if (to.column(first + e) == row) {
        for (int c = 0; c < 3; ++c)
          if (!(block(c, c) > 0)) block(c, c) = 1;
      }
    }
  }
};

/// How many blocks a row has.
template <class S, class T, int radius>
struct CountExactRow {
  ExactRow<S, T, radius> row;
  NodeIndices<S> count;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (row.part(i) >= 0) count(row.part(i)) = row.count(i);
  }
};
/// The diagonal times 1 + by.
template <class S>
struct ShiftDiagonal {
  BlockCsr<S, double> a;
  double by;
  KOKKOS_FUNCTION void operator()(int i) const {
    Mat3<double>& block = a.block(a.find(i, i));
    for (int c = 0; c < 3; ++c) block(c, c) *= 1 + by;
  }
};

template <class S, class X>
struct TakePart {
  NodeIndices<S> part;
  VectorField<X, S> from;
  Kokkos::View<double*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (part(i) < 0) return;
    for (int c = 0; c < 3; ++c) to(3 * part(i) + c) = double(from(i, c));
  }
};
/// x is the solution where the block is, and otherwise 0, or what it was if `add`.
template <class S, class X>
struct GivePart {
  NodeIndices<S> part;
  Kokkos::View<double*, typename S::memory> from;
  VectorField<X, S> x;
  bool add;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      X const found = part(i) < 0 ? X(0) : X(from(3 * part(i) + c));
      x(i, c) = add ? x(i, c) + found : found;
    }
  }
};

}  // namespace kernels

/// x = R' (R A R')^-1 R b, with R the nodes of a block.
template <class S>
class ExactBlock {
public:
  using Part = kernels::NodeIndices<S>;

  /// Factors the block of `nodes` nodes whose numbers in it are `part` (-1: not of it). `rows` are
  /// those of the block (`by_part`), or of all nodes. The diagonal is raised by as little as makes
  /// it positive definite, beginning with `round_off` of itself, the relative error of its entries.
  /// False if it takes more than 1e-3; the block must then not be used.
  template <class T, int radius>
  bool factorize(GridMatrix<S, T, radius> const& rows, Part const& part, int nodes, bool by_part,
                 double round_off) {
    part_ = part;
    nodes_ = nodes;
    shift_ = 0;
    if (nodes == 0) return false;
    BlockCsr<S, double> a = matrix(rows, by_part);
    grow(unknowns_, host_, "exact_unknowns", std::size_t(3) * nodes);
    for (double next = round_off;; next *= 16) {
      if (solver_.factorize(a) == Definiteness::positive) return true;
      if (!(next < 1e-3)) return false;
      for_each<S>("exact_shift", nodes, kernels::ShiftDiagonal<S>{a, next});
      shift_ += next;
    }
  }
  /// Over all nodes that there are, x = .., or x += .. if `add`.
  template <class B, class X>
  void solve(VectorField<B, S> const& b, VectorField<X, S> const& x, int size, bool add) const {
    for_each<S>("exact_take", size, kernels::TakePart<S, B>{part_, b, unknowns_});
    std::size_t const n = std::size_t(3) * nodes_;
    copy_front<S>(unknowns_, host_, n);
    std::span<double> const numbers(host_.data(), n);
    solver_.solve(numbers, numbers);
    copy_front<S>(host_, unknowns_, n);
    for_each<S>("exact_give", size, kernels::GivePart<S, X>{part_, unknowns_, x, add});
  }
  int nodes() const { return nodes_; }
  double shift() const { return shift_; }
  std::size_t memory() const { return nodes_ == 0 ? 0 : solver_.memory(); }

private:
  template <class T, int radius>
  BlockCsr<S, double> matrix(GridMatrix<S, T, radius> const& rows, bool by_part) const {
    using Memory = typename S::memory;
    int const size = rows.nodes.count;
    kernels::ExactRow<S, T, radius> row{rows, part_, by_part, {}};
    row.to.row_begin = Kokkos::View<int*, Memory>("exact_rows", nodes_ + 1);
    for_each<S>("exact_count", size, kernels::CountExactRow<S, T, radius>{row, row.to.row_begin});
    int const total = exclusive_scan<S, int>("exact_rows", row.to.row_begin);
    row.to.column = Kokkos::View<int*, Memory>("exact_columns", total);
    row.to.block = Kokkos::View<Mat3<double>*, Memory>("exact_blocks", total);
    for_each<S>("exact_blocks", size, row);
    S::instance().fence("taut: exact block");
    return row.to;
  }

  Part part_;
  int nodes_ = 0;
  double shift_ = 0;
  DirectSolver solver_;
  Kokkos::View<double*, typename S::memory> unknowns_;
  typename decltype(unknowns_)::HostMirror host_;
};

}  // namespace taut
