// From the unknowns of a coarse level to those of a fine one: P, whose rows follow the motions of a
// few runs of unknowns, six of each. The six of run r are the coarse unknowns 2r and 2r + 1.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/exec/side_by_side.hpp>
#include <taut/core/math/matrix.hpp>

namespace taut {

/// What six motions do to one unknown: 3 rows of six, padded with zeros to what a register holds.
template <class T>
struct MotionRows {
  static constexpr int count = 6, padded = 8;
  T v[3][padded];

  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> column(int c) const { return {v[0][c], v[1][c], v[2][c]}; }
};

/// `T` is the scalar of its blocks.
template <class S, class T = double>
struct Prolongation {
  using Indices = Kokkos::View<int const*, typename S::memory>;

  Indices row_begin;  ///< per fine unknown, +1
  Indices run;        ///< of each block, ascending in each row
  Kokkos::View<MotionRows<T>*, typename S::memory> block;
  // The same by columns.
  Indices column_begin;  ///< per run, +1
  Indices row, place;    ///< the fine unknown, ascending for each run, and which of the blocks

  KOKKOS_FUNCTION int rows() const { return static_cast<int>(row_begin.extent(0)) - 1; }
  KOKKOS_FUNCTION int runs() const { return static_cast<int>(column_begin.extent(0)) - 1; }
};

namespace kernels {

/// P' r for one run.
template <class S, class T, class R, class C>
struct RestrictRun {
  Prolongation<S, T> p;
  VectorField<R, S> r;
  VectorField<C, S> coarse;
  KOKKOS_FUNCTION void operator()(int run) const {
    constexpr int padded = MotionRows<T>::padded;
    C sum[padded] = {};
    int const last = p.column_begin(run + 1);
    for (int k = p.column_begin(run); k < last; ++k) {
      MotionRows<T> const& b = p.block(p.place(k));
      int const i = p.row(k);
      for (int m = 0; m < 3; ++m) {
        C const x = C(r(i, m));
        for (int c = 0; c < padded; ++c) sum[c] += C(b.v[m][c]) * x;
      }
    }
    for (int c = 0; c < MotionRows<T>::count; ++c) coarse(2 * run + c / 3, c % 3) = sum[c];
  }
};

/// z += P coarse in one row.
template <class S, class T, class R, class C>
struct AddProlonged {
  Prolongation<S, T> p;
  VectorField<C, S> coarse;
  VectorField<R, S> z;
  KOKKOS_FUNCTION void operator()(int i) const {
    constexpr int padded = MotionRows<T>::padded;
    C sum[3][padded] = {};
    int const last = p.row_begin(i + 1);
    for (int k = p.row_begin(i); k < last; ++k) {
      MotionRows<T> const& b = p.block(k);
      C y[padded] = {};
      for (int c = 0; c < MotionRows<T>::count; ++c) y[c] = coarse(2 * p.run(k) + c / 3, c % 3);
      for (int m = 0; m < 3; ++m) {
        TAUT_SIDE_BY_SIDE
        for (int c = 0; c < padded; ++c) sum[m][c] += C(b.v[m][c]) * y[c];
      }
    }
    for (int m = 0; m < 3; ++m) {
      C const* const s = sum[m];
      z(i, m) += R(((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5]));
    }
  }
};

}  // namespace kernels

/// coarse = P' r.
template <class S, class T, class R, class C>
void restrict_to(Prolongation<S, T> const& p, VectorField<R, S> const& r,
                 VectorField<C, S> const& coarse) {
  for_each<S>("restrict", p.runs(), kernels::RestrictRun<S, T, R, C>{p, r, coarse});
}

/// z += P coarse.
template <class S, class T, class R, class C>
void add_prolonged(Prolongation<S, T> const& p, VectorField<C, S> const& coarse,
                   VectorField<R, S> const& z) {
  for_each<S>("prolong", p.rows(), kernels::AddProlonged<S, T, R, C>{p, coarse, z});
}

}  // namespace taut
