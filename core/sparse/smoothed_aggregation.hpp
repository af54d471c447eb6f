// Coarse levels by smoothed aggregation (Vanek, Mandel and Brezina 1996): the unknowns are joined
// in short runs, each of which may move as a rigid body, and these motions are smoothed once,
//   P = (1 - w D^-1 A) Q,   coarse A = P' A P,
// with D the 3x3 diagonal blocks of A and Q the orthonormal motions of the runs. Unsmoothed, runs
// that turn against each other strain the elements between them, and what bends costs far too much
// on the coarse level: that is what makes thin bodies slow.
//
// Which motions cost nothing is kept per unknown, as six columns N (of translations and rotations).
// The QR decomposition of those of a run gives its Q, and its R is the same of the coarse unknowns,
// so that levels follow each other. Where runs are lines or points, some columns are zero.
//
// Unknowns that nothing couples to (fixed ones) have zero rows in N and P: they stay out of it.
#pragma once

#include <taut/core/exec/buckets.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/math/floored_inverse.hpp>
#include <taut/core/sparse/block_csr.hpp>
#include <taut/core/sparse/prolongation.hpp>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

namespace taut {

/// Runs of unknowns: where they begin, and where the last one ends.
using RunBegins = std::vector<int>;

/// Runs of up to `length` of n unknowns.
RunBegins equal_runs(int n, int length);
/// The same, each within one body, `of` per unknown, and all of a body about as long.
RunBegins runs_of_bodies(std::span<int const> of, int length);

/// Per unknown the motions that cost nothing: translations, then rotations.
template <class S>
using FreeMotions = Kokkos::View<MotionRows<double>*, typename S::memory>;

/// Which blocks P, A P and P' A P have, on the host: the runs of each row, ascending.
struct AggregationPattern {
  BlockPattern p, ap, coarse;  ///< rows of unknowns, of unknowns and of runs
  BlockPattern blocks;         ///< of P' A P as a block matrix
  Buckets by_run;              ///< the places of each run in p
  std::vector<int> row;        ///< the unknown of each of these
};
/// Of a matrix over n unknowns; `run` per unknown.
AggregationPattern aggregation_pattern(std::span<int const> row_begin, std::span<int const> column,
                                       std::span<int const> run, int runs);

namespace kernels {

/// to += A q
KOKKOS_FORCEINLINE_FUNCTION void add_product(MotionRows<double>& to, Mat3<double> const& a,
                                             MotionRows<double> const& q) {
  constexpr int padded = MotionRows<double>::padded;
  for (int m = 0; m < 3; ++m) {
    double const x = a(m, 0), y = a(m, 1), z = a(m, 2);
    double sum[padded];  // which cannot overlap q
    TAUT_SIDE_BY_SIDE
    for (int c = 0; c < padded; ++c) {
      sum[c] = to.v[m][c] + (x * q.v[0][c] + y * q.v[1][c] + z * q.v[2][c]);
    }
    for (int c = 0; c < padded; ++c) to.v[m][c] = sum[c];
  }
}

/// Of unknowns with a nonzero block off the diagonal; with positions, rotations as well.
template <class S, class Positions>
struct RigidMotions {
  BlockCsr<S, double> a;
  Positions x;  ///< empty: translations alone
  FreeMotions<S> motions;

  KOKKOS_FUNCTION void operator()(int i) const {
    MotionRows<double> rows{};
    if (coupled(i)) {
      for (int c = 0; c < 3; ++c) rows.v[c][c] = 1;
      if (x.extent(0) > 0) {
        Vec3<double> const d{double(x(i, 0)), double(x(i, 1)), double(x(i, 2))};
        for (int c = 0; c < 3; ++c) {
          Vec3<double> axis{};
          axis[c] = 1;
          Vec3<double> const turned = cross(axis, d);
          for (int m = 0; m < 3; ++m) rows.v[m][3 + c] = turned[m];
        }
      }
    }
    motions(i) = rows;
  }
  KOKKOS_FUNCTION bool coupled(int i) const {
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k) {
      if (a.column(k) == i) continue;
      for (double const entry : a.block(k).a)
        if (entry != 0) return true;
    }
    return false;
  }
};

/// The motions of one run become orthonormal, by Gram and Schmidt's method, twice; those that are
/// not independent of those before them become zero.
template <class S>
struct OrthonormaliseRun {
  Kokkos::View<int const*, typename S::memory> begin;
  FreeMotions<S> motions, coarse;
  /// Of the length of a column: what is left of it is noise.
  static constexpr double dependent = 1e-8;

  KOKKOS_FUNCTION void operator()(int run) const { decompose(run); }

private:
  KOKKOS_FUNCTION double& entry(int row, int c) const { return motions(row / 3).v[row % 3][c]; }
  KOKKOS_FUNCTION double product(int first, int last, int c, int d) const {
    double sum = 0;
    for (int row = first; row < last; ++row) sum += entry(row, c) * entry(row, d);
    return sum;
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void decompose(int run) const {
    int const first = 3 * begin(run), last = 3 * begin(run + 1);
    coarse(2 * run) = coarse(2 * run + 1) = MotionRows<double>{};
    for (int c = 0; c < 6; ++c) {
      double const whole = Kokkos::sqrt(product(first, last, c, c));
      for (int again = 0; again < 2; ++again) {
        for (int d = 0; d < c; ++d) {
          double const along = product(first, last, c, d);
          coarse(2 * run + d / 3).v[d % 3][c] += along;
          for (int row = first; row < last; ++row) entry(row, c) -= along * entry(row, d);
        }
      }
      double const rest = Kokkos::sqrt(product(first, last, c, c));
      bool const independent = rest > dependent * whole;
      for (int row = first; row < last; ++row) {
        entry(row, c) = independent ? entry(row, c) / rest : 0;
      }
      coarse(2 * run + c / 3).v[c % 3][c] = independent ? rest : 0;
    }
  }
};

/// Where a run stands in a row of ascending ones.
template <class Indices>
KOKKOS_FORCEINLINE_FUNCTION int find_run(Indices const& runs, int first, int last, int run) {
  while (first < last) {
    int const middle = (first + last) / 2;
    if (runs(middle) < run) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  return first;
}

/// One row of (1 - w D^-1 A) Q.
template <class S>
struct SmoothMotions {
  /// 4 / 3 of the inverse of the largest eigenvalue of D^-1 A, which is 2 to 3 for elements of four
  /// vertices (and never above 4), and much the same on coarse levels. Iterations hardly depend on
  /// it from 0.4 to 0.7.
  static constexpr double damping = 0.5;
  BlockCsr<S, double> a;
  FreeMotions<S> q;
  Kokkos::View<int const*, typename S::memory> run;  ///< per unknown
  Prolongation<S, double> p;

  KOKKOS_FUNCTION void operator()(int i) const { smooth(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void smooth(int i) const {
    int const first = p.row_begin(i), last = p.row_begin(i + 1);
    for (int k = first; k < last; ++k) p.block(k) = MotionRows<double>{};
    Mat3<double> diagonal{};
    int at = first;
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k) {
      int const j = a.column(k);
      if (i == j) diagonal = a.block(k);
      if (p.run(at) != run(j)) at = find_run(p.run, first, last, run(j));
      add_product(p.block(at), a.block(k), q(j));
    }
    Mat3<double> const scale =
        -damping * to_matrix(floored_inverse(symmetric_part(diagonal), 1e-12, 0));
    for (int k = first; k < last; ++k) {
      MotionRows<double> smooth = p.run(k) == run(i) ? q(i) : MotionRows<double>{};
      add_product(smooth, scale, p.block(k));
      p.block(k) = smooth;
    }
  }
};

/// One row of A P.
template <class S>
struct MultiplyProlongation {
  BlockCsr<S, double> a;
  Prolongation<S, double> p;
  Kokkos::View<int const*, typename S::memory> row_begin, run;
  Kokkos::View<MotionRows<double>*, typename S::memory> block;

  KOKKOS_FUNCTION void operator()(int i) const { multiply(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void multiply(int i) const {
    int const first = row_begin(i), last = row_begin(i + 1);
    for (int k = first; k < last; ++k) block(k) = MotionRows<double>{};
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k) {
      int const j = a.column(k);
      int at = first;
      for (int m = p.row_begin(j); m < p.row_begin(j + 1); ++m, ++at) {
        if (run(at) != p.run(m)) at = find_run(run, at, last, p.run(m));
        add_product(block(at), a.block(k), p.block(m));
      }
    }
  }
};

/// The two rows of P' A P of one run, with `shift` times what the diagonal of A gives each motion
/// on the diagonal, and 1 where there is no motion.
template <class S>
struct GalerkinRows {
  using Motion = MotionRows<double>;
  BlockCsr<S, double> a;
  Prolongation<S, double> p;
  Kokkos::View<int const*, typename S::memory> ap_begin, ap_run, coarse_begin, coarse_run;
  Kokkos::View<Motion*, typename S::memory> ap;
  Kokkos::View<Motion* [2], Kokkos::LayoutRight, typename S::memory> sums;  ///< as coarse_run
  BlockCsr<S, double> coarse;
  double shift;

  KOKKOS_FUNCTION void operator()(int r) const { multiply(r); }
  [[gnu::noinline]] KOKKOS_FUNCTION void multiply(int r) const {
    int const first = coarse_begin(r), last = coarse_begin(r + 1);
    for (int k = first; k < last; ++k) sums(k, 0) = sums(k, 1) = Motion{};
    double scale[Motion::count] = {};
    for (int k = p.column_begin(r); k < p.column_begin(r + 1); ++k) {
      int const i = p.row(k);
      Motion const& left = p.block(p.place(k));
      double const mean = trace(a.block(a.find(i, i))) / 3;
      for (int c = 0; c < Motion::count; ++c) {
        scale[c] += mean * dot(left.column(c), left.column(c));
      }
      int at = first;
      for (int m = ap_begin(i); m < ap_begin(i + 1); ++m, ++at) {
        if (coarse_run(at) != ap_run(m)) at = find_run(coarse_run, at, last, ap_run(m));
        for (int half = 0; half < 2; ++half) {
          Mat3<double> transposed;
          for (int u = 0; u < 3; ++u)
            for (int n = 0; n < 3; ++n) transposed(u, n) = left.v[n][3 * half + u];
          add_product(sums(at, half), transposed, ap(m));
        }
      }
    }
    for (int half = 0; half < 2; ++half) {
      int const row = coarse.row_begin(2 * r + half);
      for (int k = first; k < last; ++k)
        for (int c = 0; c < Motion::count; ++c)
          coarse.block(row + 2 * (k - first) + c / 3).set_column(c % 3, sums(k, half).column(c));
    }
    for (int c = 0; c < Motion::count; ++c) {
      int const i = 2 * r + c / 3;
      Mat3<double>& to = coarse.block(coarse.find(i, i));
      to(c % 3, c % 3) += scale[c] > 0 ? shift * scale[c] : 1;
    }
  }
};

template <class S, class T>
struct CopyMotions {
  Kokkos::View<MotionRows<double>*, typename S::memory> from;
  Kokkos::View<MotionRows<T>*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const {
    for (int m = 0; m < 3; ++m)
      for (int c = 0; c < MotionRows<T>::padded; ++c) to(k).v[m][c] = T(from(k).v[m][c]);
  }
};

}  // namespace kernels

/// Translations, and rotations where `x` has the positions of the unknowns (m), of A's unknowns.
template <class S, class X>
FreeMotions<S> rigid_motions(BlockCsr<S, double> const& a, VectorField<X, S> const& x) {
  FreeMotions<S> const motions("free_motions", a.rows());
  for_each<S>("rigid_motions", a.rows(),
              kernels::RigidMotions<S, VectorField<X, S>>{a, x, motions});
  return motions;
}

/// A coarse level: how it is reached from the finer one, its matrix, and what costs nothing in it.
template <class S>
struct Aggregation {
  Prolongation<S, double> p;
  BlockCsr<S, double> coarse;
  FreeMotions<S> motions;

  /// Of A by these runs. `fine`, the motions of its unknowns, become orthonormal by runs, and
  /// `motions` what they are on the coarse level. `shift` times what the diagonal of
  /// A gives a motion is added to the diagonal of P'AP: a body that floats without inertia, whose
  /// translations cost nothing, must leave it invertible, and amplify the round-off of r by no more
  /// than 1 / shift.
  Aggregation(BlockCsr<S, double> const& a, RunBegins const& begin, FreeMotions<S> const& fine,
              double shift) {
    int const n = a.rows(), runs = static_cast<int>(begin.size()) - 1;
    std::vector<int> run(n);
    for (int r = 0; r < runs; ++r) std::fill(run.begin() + begin[r], run.begin() + begin[r + 1], r);
    auto const row_begin = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.row_begin);
    auto const column = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.column);
    AggregationPattern const pattern = aggregation_pattern(
        {row_begin.data(), row_begin.extent(0)}, {column.data(), column.extent(0)}, run, runs);
    p.row_begin = to_space<S>("prolongation_begin", pattern.p.row_begin);
    p.run = to_space<S>("prolongation_run", pattern.p.column);
    p.column_begin = to_space<S>("prolongation_column", pattern.by_run.begin);
    p.row = to_space<S>("prolongation_row", pattern.row);
    p.place = to_space<S>("prolongation_place", pattern.by_run.item);
    p.block = uninitialized("prolongation", pattern.p.column.size());
    motions = FreeMotions<S>("free_motions", 2 * runs);
    coarse = BlockCsr<S, double>(pattern.blocks);

    for_each<S>("orthonormalise", runs,
                kernels::OrthonormaliseRun<S>{to_space<S>("runs", begin), fine, motions});
    for_each<S>("smooth_motions", n,
                kernels::SmoothMotions<S>{a, fine, to_space<S>("run", run), p});
    kernels::MultiplyProlongation<S> const ap{a, p,
                                              to_space<S>("product_begin", pattern.ap.row_begin),
                                              to_space<S>("product_run", pattern.ap.column),
                                              uninitialized("product", pattern.ap.column.size())};
    for_each<S>("multiply_prolongation", n, ap);
    using Sums = decltype(kernels::GalerkinRows<S>::sums);
    Sums const sums(Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string("galerkin")),
                    pattern.coarse.column.size());
    kernels::GalerkinRows<S> const galerkin{a,
                                            p,
                                            ap.row_begin,
                                            ap.run,
                                            to_space<S>("coarse_begin", pattern.coarse.row_begin),
                                            to_space<S>("coarse_run", pattern.coarse.column),
                                            ap.block,
                                            sums,
                                            coarse,
                                            shift};
    for_each<S>("galerkin", runs, galerkin);
  }

private:
  static FreeMotions<S> uninitialized(char const* name, std::size_t count) {
    return FreeMotions<S>(Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string(name)),
                          count);
  }
};

/// A copy in another scalar, or in the same one; the pattern is shared.
template <class T, class S>
Prolongation<S, T> copy_as(Prolongation<S, double> const& p) {
  Prolongation<S, T> to{p.row_begin, p.run, {}, p.column_begin, p.row, p.place};
  to.block = decltype(to.block)("prolongation", p.block.extent(0));
  for_each<S>("copy_motions", static_cast<int>(p.block.extent(0)),
              kernels::CopyMotions<S, T>{p.block, to.block});
  return to;
}

}  // namespace taut
