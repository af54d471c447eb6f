// The exactly projected second derivative of an isotropic energy, in the frame of the singular
// vectors F = U diag(s) V^T (Smith, de Goes and Kim 2019; Kim and Eberle 2022, chapter 7). With M =
// U^T dF V and {i, j, k} = {0, 1, 2}, the nine eigenmodes decouple into
//
//   twist (i, j):   (M_ij - M_ji) / sqrt 2,  eigenvalue 2 dPsi/dI2 + dPsi/dJ s_k + 2 dPsi/dI1 /
//   (s_i + s_j) flip  (i, j):   (M_ij + M_ji) / sqrt 2,  eigenvalue 2 dPsi/dI2 - dPsi/dJ s_k
//   scaling:        (M_00, M_11, M_22),      a symmetric 3x3, projected by its own eigenvalues
//
// Projection sets the negative eigenvalues to zero.
#pragma once

#include <taut/core/math/psd_projection.hpp>
#include <taut/core/math/svd.hpp>
#include <taut/materials/isotropic.hpp>

namespace taut {

template <class T>
struct SingularFrame {
  Mat3<T> U, V;
  Sym3<T> scaling;  ///< projected
  Vec3<T> twist;    ///< eigenvalue of the pair opposite to index k, projected
  Vec3<T> flip;

  /// Makes negative eigenvalues zero.
  KOKKOS_FORCEINLINE_FUNCTION void project() {
    for (int k = 0; k < 3; ++k) {
      flip[k] = max(flip[k], T(0));
      twist[k] = max(twist[k], T(0));
    }
    scaling = project_psd(scaling);
  }

  /// dP = H : dF with the projected H.
  KOKKOS_FORCEINLINE_FUNCTION Mat3<T> apply(Mat3<T> const& dF) const {
    Mat3<T> const M = transpose_times(U, dF) * V;
    Mat3<T> D;
    D(0, 0) = scaling.s[0] * M(0, 0) + scaling.s[3] * M(1, 1) + scaling.s[5] * M(2, 2);
    D(1, 1) = scaling.s[3] * M(0, 0) + scaling.s[1] * M(1, 1) + scaling.s[4] * M(2, 2);
    D(2, 2) = scaling.s[5] * M(0, 0) + scaling.s[4] * M(1, 1) + scaling.s[2] * M(2, 2);
    for (int k = 0; k < 3; ++k) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      T const odd = T(0.5) * twist[k] * (M(i, j) - M(j, i));
      T const even = T(0.5) * flip[k] * (M(i, j) + M(j, i));
      D(i, j) = even + odd;
      D(j, i) = even - odd;
    }
    return U * D * transpose(V);
  }

  /// The 3x3 block H_ab that couples two vertices with dF = u_a b_a^T and dF = u_b b_b^T;
  /// `beta_a` = V^T b_a, `beta_b` = V^T b_b.
  KOKKOS_FORCEINLINE_FUNCTION Mat3<T> vertex_pair(Vec3<T> const& beta_a,
                                                  Vec3<T> const& beta_b) const {
    Mat3<T> B;
    for (int i = 0; i < 3; ++i) B(i, i) = scaling.s[i] * beta_a[i] * beta_b[i];
    constexpr int off[3] = {4, 5, 3};  // entry of `scaling` that couples the pair opposite to k
    for (int k = 0; k < 3; ++k) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      T const sum = T(0.5) * (twist[k] + flip[k]);
      T const difference = T(0.5) * (flip[k] - twist[k]);
      B(i, i) = B(i, i) + sum * beta_a[j] * beta_b[j];
      B(j, j) = B(j, j) + sum * beta_a[i] * beta_b[i];
      B(i, j) = scaling.s[off[k]] * beta_a[i] * beta_b[j] + difference * beta_a[j] * beta_b[i];
      B(j, i) = scaling.s[off[k]] * beta_a[j] * beta_b[i] + difference * beta_a[i] * beta_b[j];
    }
    return U * B * transpose(U);
  }
};

/// `project` = false keeps the negative eigenvalues (to test the eigensystem itself).
template <class Model, bool project = true, class T>
KOKKOS_FORCEINLINE_FUNCTION SingularFrame<T> singular_frame(IsotropicState<Model, T> const& state) {
  SingularFrame<T> frame;
  Svd<T> const f = svd(state.F);
  frame.U = f.U;
  frame.V = f.V;
  Vec3<T> const& s = f.s;
  InvariantDerivatives<T> const& d = state.d;
  constexpr int off[3] = {4, 5, 3};
  for (int k = 0; k < 3; ++k) {
    int const i = (k + 1) % 3, j = (k + 2) % 3;
    T const minor = s[i] * s[j];
    T const two_d2 = T(2) * d.d2;
    frame.flip[k] = two_d2;
    frame.twist[k] = two_d2;
    frame.scaling.s[k] = two_d2;
    frame.scaling.s[off[k]] = T(0);
    if constexpr (Model::use.d3) {
      frame.flip[k] = frame.flip[k] - d.d3 * s[k];
      frame.twist[k] = frame.twist[k] + d.d3 * s[k];
      frame.scaling.s[k] = frame.scaling.s[k] + d.d33 * minor * minor;
      // the pair (i, j): (ds J)_i (ds J)_j = (s_j s_k)(s_i s_k)
      frame.scaling.s[off[k]] = d.d33 * minor * s[k] * s[k] + d.d3 * s[k];
    }
    if constexpr (Model::use.d1) {
      frame.twist[k] = frame.twist[k] + T(2) * d.d1 / floored_sum(s[i], s[j], f.s);
    }
    if constexpr (Model::use.d11) {
      frame.scaling.s[k] = frame.scaling.s[k] + d.d11;
      frame.scaling.s[off[k]] = frame.scaling.s[off[k]] + d.d11;
    }
    if constexpr (Model::use.d22) {
      frame.scaling.s[k] = frame.scaling.s[k] + T(4) * d.d22 * s[k] * s[k];
      frame.scaling.s[off[k]] = frame.scaling.s[off[k]] + T(4) * d.d22 * minor;
    }
  }
  if constexpr (project) frame.project();
  return frame;
}

}  // namespace taut
