// The inverse of a small symmetric positive definite matrix, by Cholesky's factors, applied as a
// dense matrix: what the coarsest level of a hierarchy is solved with, without leaving the device.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>

#include <vector>

namespace taut {

/// Overwrites A (n x n numbers; its lower triangle is read) by the inverse of A + shift D, with D
/// the diagonal of A, and returns the shift: 0, or the least of round_off, 4 round_off, 16
/// round_off,
/// ... for which Cholesky's method finds no negative pivot. Rows that depend on those before them,
/// to round-off, are cut off and become zero, which still solves A x = b where there is a solution;
/// so are rows whose diagonal is not positive and finite.
double invert_positive(std::vector<double>& a, int n, double round_off);

namespace kernels {

template <class S, class X>
struct DenseRowProduct {
  Kokkos::View<double const**, Kokkos::LayoutRight, typename S::memory> a;
  VectorField<X, S> x, y;
  int n;
  KOKKOS_FUNCTION void operator()(int i) const { y(i / 3, i % 3) = X(sum(i)); }
  [[gnu::noinline]] KOKKOS_FUNCTION double sum(int i) const {
    double total[4] = {};  // additions may not be reordered: four sums side by side
    for (int j = 0; j < n; ++j) total[j % 4] += a(i, j) * double(x(j / 3, j % 3));
    return (total[0] + total[1]) + (total[2] + total[3]);
  }
};

}  // namespace kernels

/// z = A^-1 b over 3-vectors.
template <class S>
class DenseInverse {
public:
  /// Inverts A, of 3 nodes x 3 nodes numbers. `round_off` is the relative error of its entries.
  /// Returns the shift, see invert_positive.
  double factorize(std::vector<double> a, int nodes, double round_off) {
    numbers_ = 3 * nodes;
    double const shift = invert_positive(a, numbers_, round_off);
    if (static_cast<int>(inverse_.extent(0)) < numbers_) {
      inverse_ = Matrix("dense_inverse", numbers_, numbers_);
      host_ = Kokkos::create_mirror_view(inverse_);
    }
    for (int i = 0; i < numbers_; ++i)
      for (int j = 0; j < numbers_; ++j) host_(i, j) = a[std::size_t(numbers_) * i + j];
    assign_on<S>(inverse_, host_);
    S::instance().fence("taut: dense inverse");
    return shift;
  }
  /// Allocates nothing.
  template <class X>
  void apply(VectorField<X, S> const& b, VectorField<X, S> const& z) const {
    for_each<S>("dense_inverse", numbers_,
                kernels::DenseRowProduct<S, X>{inverse_, b, z, numbers_});
  }
  std::size_t memory() const { return inverse_.span() * sizeof(double); }

private:
  using Matrix = Kokkos::View<double**, Kokkos::LayoutRight, typename S::memory>;
  int numbers_ = 0;
  Matrix inverse_;
  typename Matrix::HostMirror host_;
};

}  // namespace taut
