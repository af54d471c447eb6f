// Operations on a block matrix, one row per thread and each row in the order of its columns, so
// that every result is bitwise the same for any number of threads.
#pragma once

#include <taut/core/sparse/block_csr.hpp>

#include <string>
#include <type_traits>

namespace taut {
namespace kernels {

/// A x in row i.
template <class S, class T, class X>
KOKKOS_FORCEINLINE_FUNCTION auto row_product(BlockCsr<S, T> const& a, VectorField<X, S> const& x,
                                             int i) {
  using Sum = std::common_type_t<T, X>;
  Vec3<Sum> sum{};
  int const last = a.row_begin(i + 1);
  for (int k = a.row_begin(i); k < last; ++k) {
    int const j = a.column(k);
    Mat3<T> const& b = a.block(k);
    for (int c = 0; c < 3; ++c) {
      Sum const xc = x(j, c);
      for (int r = 0; r < 3; ++r) sum[r] += Sum(b(r, c)) * xc;
    }
  }
  return sum;
}

template <class S, class T, class X>
struct BlockRowProduct {
  BlockCsr<S, T> a;
  VectorField<X, S> x, y;
  KOKKOS_FUNCTION void operator()(int i) const {
    auto const sum = row_product(a, x, i);
    for (int r = 0; r < 3; ++r) y(i, r) = X(sum[r]);
  }
};

template <class S, class T, class X>
struct RowResidual {
  BlockCsr<S, T> a;
  VectorField<X, S> x, b, r;
  KOKKOS_FUNCTION void operator()(int i) const {
    auto const sum = row_product(a, x, i);
    for (int c = 0; c < 3; ++c) r(i, c) = X(b(i, c) - sum[c]);
  }
};

template <class S, class T, class R>
struct DiagonalBlocks {
  BlockCsr<S, T> a;
  BlockField<R, S> diagonal;
  KOKKOS_FUNCTION void operator()(int i) const {
    Mat3<T> const& b = a.block(a.find(i, i));
    for (int c = 0; c < 3; ++c) diagonal(i, c) = R(b(c, c));
    diagonal(i, 3) = R((b(0, 1) + b(1, 0)) / 2);
    diagonal(i, 4) = R((b(1, 2) + b(2, 1)) / 2);
    diagonal(i, 5) = R((b(0, 2) + b(2, 0)) / 2);
  }
};

template <class S, class T>
struct RowAsymmetry {
  BlockCsr<S, T> a;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k) {
      int const mirror = a.find(a.column(k), i);
      if (mirror < 0) {
        largest = Kokkos::Experimental::infinity_v<double>;
        return;
      }
      Mat3<T> const &b = a.block(k), &c = a.block(mirror);
      for (int m = 0; m < 9; ++m) {
        double const difference = Kokkos::abs(double(b(m % 3, m / 3)) - double(c(m / 3, m % 3)));
        largest = Kokkos::max(largest, difference);
      }
    }
  }
};

template <class S, class T>
struct LargestEntry {
  BlockCsr<S, T> a;
  KOKKOS_FUNCTION void operator()(int k, double& largest) const {
    for (T const entry : a.block(k).a) largest = Kokkos::max(largest, double(Kokkos::abs(entry)));
  }
};

template <class S, class T>
struct CopyBlocks {
  Kokkos::View<Mat3<double>*, typename S::memory> from;
  Kokkos::View<Mat3<T>*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const {
    for (int m = 0; m < 9; ++m) to(k).a[m] = T(from(k).a[m]);
  }
};

}  // namespace kernels

/// y = A x. Sums in the wider of the scalars of A and x.
template <class S, class T, class X>
void product(BlockCsr<S, T> const& a, VectorField<X, S> const& x, VectorField<X, S> const& y) {
  for_each<S>("block_csr_product", a.rows(), kernels::BlockRowProduct<S, T, X>{a, x, y});
}

/// r = b - A x, the same way.
template <class S, class T, class X>
void residual(BlockCsr<S, T> const& a, VectorField<X, S> const& x, VectorField<X, S> const& b,
              VectorField<X, S> const& r) {
  for_each<S>("block_csr_residual", a.rows(), kernels::RowResidual<S, T, X>{a, x, b, r});
}

/// The diagonal blocks of A, of which the symmetric parts are taken.
template <class S, class T, class R>
void diagonal_blocks(BlockCsr<S, T> const& a, BlockField<R, S> const& diagonal) {
  for_each<S>("block_csr_diagonal", a.rows(), kernels::DiagonalBlocks<S, T, R>{a, diagonal});
}

/// A copy in another scalar, or in the same one; the pattern is shared.
template <class T, class S>
BlockCsr<S, T> copy_as(BlockCsr<S, double> const& a) {
  BlockCsr<S, T> to;
  to.row_begin = a.row_begin;
  to.column = a.column;
  to.block = decltype(to.block)(
      Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string("block")), a.block.extent(0));
  for_each<S>("copy_blocks", static_cast<int>(a.block.extent(0)),
              kernels::CopyBlocks<S, T>{a.block, to.block});
  return to;
}

/// max |A - A'| / max |A|, entry by entry; infinity if a stored block has no mirror image.
template <class S, class T>
double asymmetry(BlockCsr<S, T> const& a) {
  double const difference =
      maximum<S>("block_csr_asymmetry", a.rows(), 0.0, kernels::RowAsymmetry<S, T>{a});
  double const largest = maximum<S>("block_csr_largest", static_cast<int>(a.block.extent(0)), 0.0,
                                    kernels::LargestEntry<S, T>{a});
  return difference == 0 ? 0 : difference / largest;
}

}  // namespace taut
