// Rotation-variant singular value decomposition of a 3x3 matrix,
//
//   F = U diag(s) V^T,   det U = det V = +1,   s0 >= s1 >= |s2|,   sign of s2 = sign of det F,
//
// from the polar decomposition F = R S and the eigenvectors of S = V diag(s) V^T: U = R V. Both
// halves are backward stable for every F (inverted, flat, zero, repeated singular values), so no
// case is special. Errors are a few epsilon |F|, absolute: for a small singular value that is what
// rounding the entries of F does to it, too.
#pragma once

#include <taut/core/math/polar.hpp>
#include <taut/core/math/symmetric_eigen.hpp>

namespace taut {

template <class T>
struct Svd {
  Mat3<T> U;
  Vec3<T> s;
  Mat3<T> V;
};

template <class T>
KOKKOS_INLINE_FUNCTION Svd<T> svd(Mat3<T> const& F) {
  Mat3<T> const R = polar_rotation(F);
  SymmetricEigen<T> const e = symmetric_eigen(symmetric_part(transpose_times(R, F)));
  return {R * e.vectors, e.values, e.vectors};
}

}  // namespace taut
