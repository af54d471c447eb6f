// Coarse level of a two-level preconditioner: a few functions for each run of consecutive unknowns,
//   z = R' (R A R')^-1 R r,   R = their values, once per component (three rows each),
// with the Galerkin matrix factored on the host. It carries across the body in one step what the
// fine level hands on from neighbour to neighbour. The functions are 1, and where positions are
// known the coordinates along the principal axes of the run: a run can then turn, stretch and shear
// as a whole, which is what bending and twisting cost little for. Along an axis along which a run
// is (nearly) flat there is none, so that they are independent.
//
// Unknowns that nothing couples to (fixed ones) are left out of R: their z stays zero.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/math/symmetric_eigen.hpp>
#include <taut/core/sparse/block_csr.hpp>
#include <taut/core/sparse/direct_solver.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

namespace taut {

/// What R is made of: `count` functions of each run of unknowns, 1 or 4.
template <class S>
struct CoarseFunctions {
  static constexpr int most = 4;
  Kokkos::View<double* [most], Kokkos::LayoutRight, typename S::memory> value;  ///< per unknown
  Kokkos::View<int const*, typename S::memory> begin;                           ///< per run, +1
  Kokkos::View<int const*, typename S::memory> run;                             ///< per unknown
  int count = 1;

  KOKKOS_FUNCTION bool has(int i) const { return value(i, 0) != 0; }
};

/// Runs of unknowns: where they begin, and where the last one ends.
using RunBegins = std::vector<int>;

/// Runs of up to `length` of n unknowns.
inline RunBegins equal_runs(int n, int length) {
  RunBegins begin;
  for (int first = 0; first < n; first += length) begin.push_back(first);
  begin.push_back(n);
  return begin;
}

/// The same, each within one body, `of` per unknown, and all of a body about as long.
inline RunBegins runs_of_bodies(std::span<int const> of, int length) {
  int const n = static_cast<int>(of.size());
  RunBegins begin;
  for (int first = 0, last = 0; first < n; first = last) {
    while (last < n && of[last] == of[first]) ++last;
    int const size = last - first, runs = (size + length - 1) / length;
    for (int k = 0; k < runs; ++k)
      begin.push_back(first + static_cast<int>(std::int64_t(size) * k / runs));
  }
  begin.push_back(n);
  return begin;
}

namespace kernels {

/// The first function: 1 for unknowns with a nonzero block off the diagonal.
template <class S>
struct FindCoupled {
  BlockCsr<S, double> a;
  CoarseFunctions<S> functions;
  KOKKOS_FUNCTION void operator()(int i) const {
    bool found = false;
    for (int k = a.row_begin(i); k < a.row_begin(i + 1) && !found; ++k) {
      if (a.column(k) == i) continue;
      for (double const entry : a.block(k).a) found = found || entry != 0;
    }
    functions.value(i, 0) = found ? 1 : 0;
  }
};

/// The others, of one run: coordinates from its centre along its principal axes, over their rms.
template <class S, class Positions>
struct LinearFunctions {
  Positions x;
  CoarseFunctions<S> functions;
  /// Of the variance along the longest axis; below it the run is flat along an axis.
  static constexpr double flat = 1e-6;

  KOKKOS_FUNCTION void operator()(int row) const { find(row); }
  [[gnu::noinline]] KOKKOS_FUNCTION void find(int row) const {
    int const first = functions.begin(row), last = functions.begin(row + 1);
    Vec3<double> centre{};
    double n = 0;
    for (int i = first; i < last; ++i) {
      if (!functions.has(i)) continue;
      centre = centre + load3<double>(x, i);
      ++n;
    }
    double const share = n > 0 ? 1 / n : 0;
    centre = share * centre;
    Mat3<double> variance{};
    for (int i = first; i < last; ++i) {
      if (!functions.has(i)) continue;
      Vec3<double> const d = load3<double>(x, i) - centre;
      variance = variance + share * outer(d, d);
    }
    auto const axes = symmetric_eigen(symmetric_part(variance));
    for (int i = first; i < last; ++i) {
      Vec3<double> const d = load3<double>(x, i) - centre;
      for (int k = 0; k < 3; ++k) {
        double const square = axes.values[k];
        bool const thick = square > 0 && square > flat * axes.values[0];
        double along = 0;
        for (int c = 0; c < 3; ++c) along += axes.vectors(c, k) * d[c];
        functions.value(i, 1 + k) = thick && functions.has(i) ? along / Kokkos::sqrt(square) : 0;
      }
    }
  }
};

/// The rows of R A R' that belong to one run, summed in the order of the rows of A, with `shift`
/// times what the diagonal of A gives each function on the diagonal.
template <class S>
struct GalerkinRow {
  static constexpr int most = CoarseFunctions<S>::most;
  BlockCsr<S, double> a, coarse;
  CoarseFunctions<S> functions;
  double shift;

  KOKKOS_FUNCTION void operator()(int row) const {
    int const count = functions.count;
    for (int k = coarse.row_begin(count * row); k < coarse.row_begin(count * (row + 1)); ++k)
      coarse.block(k) = Mat3<double>{};
    double scale[most] = {};
    for (int i = functions.begin(row); i < functions.begin(row + 1); ++i) {
      if (!functions.has(i)) continue;
      int const end = a.row_begin(i + 1);
      for (int k = a.row_begin(i); k < end;) {
        int const other = functions.run(a.column(k));
        Mat3<double> sum[most] = {};
        for (; k < end && functions.run(a.column(k)) == other; ++k) {
          int const j = a.column(k);
          for (int n = 0; n < count; ++n) {
            sum[n] = sum[n] + functions.value(j, n) * a.block(k);
            if (i == j)
              scale[n] += functions.value(i, n) * functions.value(i, n) * (trace(a.block(k)) / 3);
          }
        }
        add(row, other, i, sum);
      }
    }
    for (int m = 0; m < count; ++m) {
      double const added = scale[m] > 0 ? shift * scale[m] : 1;
      coarse.add(count * row + m, count * row + m, added * identity3<double>());
    }
  }

private:
  /// The blocks between two runs lie side by side in each of the rows.
  KOKKOS_FUNCTION void add(int row, int other, int i, Mat3<double> const (&sum)[most]) const {
    int const count = functions.count;
    int const offset = coarse.find(count * row, count * other) - coarse.row_begin(count * row);
    for (int m = 0; m < count; ++m) {
      int const begin = coarse.row_begin(count * row + m) + offset;
      for (int n = 0; n < count; ++n) {
        coarse.block(begin + n) = coarse.block(begin + n) + functions.value(i, m) * sum[n];
      }
    }
  }
};

template <class S, class R>
struct RestrictRun {
  CoarseFunctions<S> functions;
  VectorField<R, S> r;
  Kokkos::View<double*, typename S::memory> coarse;
  KOKKOS_FUNCTION void operator()(int row) const {
    Vec3<double> sum[CoarseFunctions<S>::most] = {};
    for (int i = functions.begin(row); i < functions.begin(row + 1); ++i)
      for (int m = 0; m < functions.count; ++m)
        sum[m] = sum[m] + functions.value(i, m) * load3<double>(r, i);
    for (int m = 0; m < functions.count; ++m)
      for (int c = 0; c < 3; ++c) coarse(3 * (functions.count * row + m) + c) = sum[m][c];
  }
};

template <class S, class R>
struct AddProlonged {
  CoarseFunctions<S> functions;
  Kokkos::View<double*, typename S::memory> coarse;
  VectorField<R, S> z;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!functions.has(i)) return;
    int const first = 3 * functions.count * functions.run(i);
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (int m = 0; m < functions.count; ++m)
        sum += functions.value(i, m) * coarse(first + 3 * m + c);
      z(i, c) += R(sum);
    }
  }
};

}  // namespace kernels

/// The pattern of R A R' with so many functions per run; `run` per unknown.
template <class S>
BlockPattern coarse_pattern(BlockCsr<S, double> const& a, RunBegins const& runs,
                            std::span<int const> run, int functions) {
  auto const begin = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.row_begin);
  auto const column = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.column);
  BlockPattern pattern{{0}, {}};
  for (std::size_t r = 0; r + 1 < runs.size(); ++r) {
    std::set<int> others;
    for (int k = begin(runs[r]); k < begin(runs[r + 1]); ++k) others.insert(run[column(k)]);
    for (int m = 0; m < functions; ++m) {
      for (int const other : others)
        for (int n = 0; n < functions; ++n) pattern.column.push_back(functions * other + n);
      pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
    }
  }
  return pattern;
}

template <class S>
class CoarseLevel {
public:
  /// Builds and factors R A R' for these runs, with linear functions where `x` has the positions of
  /// the unknowns. `shift` times what the diagonal of A gives a function is added to the diagonal:
  /// a body that floats without inertia, whose translations cost nothing, must leave it invertible,
  /// and amplify the round-off of r by no more than 1 / shift. Anything but `positive` means that A
  /// is not positive semi-definite, and that the level must not be used.
  template <class T = double>
  Definiteness factorize(BlockCsr<S, double> const& a, RunBegins const& begin, double shift,
                         VectorField<T, S> const& x = {}) {
    std::vector<int> run(a.rows());
    for (std::size_t r = 0; r + 1 < begin.size(); ++r)
      std::fill(run.begin() + begin[r], run.begin() + begin[r + 1], static_cast<int>(r));
    runs_ = static_cast<int>(begin.size()) - 1;
    functions_.begin = to_space<S>("coarse_begin", begin);
    functions_.run = to_space<S>("coarse_run", run);
    functions_.count = x.extent(0) > 0 ? CoarseFunctions<S>::most : 1;
    BlockCsr<S, double> const coarse(coarse_pattern(a, begin, run, functions_.count));
    if (3 * coarse.rows() != unknowns_.extent_int(0)) {
      unknowns_ = Kokkos::View<double*, typename S::memory>("coarse_unknowns", 3 * coarse.rows());
      host_ = Kokkos::create_mirror_view(unknowns_);
    }
    if (functions_.value.extent_int(0) != a.rows()) {
      functions_.value = decltype(functions_.value)("coarse_functions", a.rows());
    }
    for_each<S>("coarse_coupled", a.rows(), kernels::FindCoupled<S>{a, functions_});
    if (functions_.count > 1) {
      for_each<S>("coarse_functions", runs(),
                  kernels::LinearFunctions<S, VectorField<T, S>>{x, functions_});
    }
    for_each<S>("coarse_galerkin", runs(), kernels::GalerkinRow<S>{a, coarse, functions_, shift});
    return solver_.factorize(coarse);
  }

  /// z += R' (R A R')^-1 R r. Allocates nothing.
  template <class R>
  void add(VectorField<R, S> const& r, VectorField<R, S> const& z) const {
    for_each<S>("coarse_restrict", runs(), kernels::RestrictRun<S, R>{functions_, r, unknowns_});
    assign(host_, unknowns_);
    std::span<double> const numbers(host_.data(), host_.extent(0));
    solver_.solve(numbers, numbers);
    assign(unknowns_, host_);
    for_each<S>("coarse_prolong", static_cast<int>(z.extent(0)),
                kernels::AddProlonged<S, R>{functions_, unknowns_, z});
  }

  int runs() const { return runs_; }
  std::size_t memory() const {
    return solver_.memory() + functions_.value.span() * sizeof(double) +
           functions_.run.span() * sizeof(int);
  }

private:
  int runs_ = 0;
  CoarseFunctions<S> functions_;
  Kokkos::View<double*, typename S::memory> unknowns_;
  typename Kokkos::View<double*, typename S::memory>::HostMirror host_;
  DirectSolver solver_;
};

}  // namespace taut
