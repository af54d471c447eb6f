// Coarse level of a two-level preconditioner: one translation for each run of consecutive unknowns,
//   z = R' (R A R')^-1 R r,   R = piecewise constants (three per run),
// with the Galerkin matrix factored on the host. It carries across the body in one step what the
// fine level hands on from neighbour to neighbour.
//
// Unknowns that nothing couples to (fixed ones) are left out of R: their z stays zero.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/sparse/block_csr.hpp>
#include <taut/core/sparse/direct_solver.hpp>

#include <cstddef>
#include <set>
#include <span>

namespace taut {
namespace kernels {

/// Marks the unknowns with a nonzero block off the diagonal.
template <class S>
struct FindCoupled {
  BlockCsr<S, double> a;
  Array<int, S> coupled;
  KOKKOS_FUNCTION void operator()(int i) const {
    bool found = false;
    for (int k = a.row_begin(i); k < a.row_begin(i + 1) && !found; ++k) {
      if (a.column(k) == i) continue;
      for (double const entry : a.block(k).a) found = found || entry != 0;
    }
    coupled(i) = found;
  }
};

/// One row of R A R', summed in the order of the rows of A, with `shift` times the sum of the
/// diagonal of A on the diagonal.
template <class S>
struct GalerkinRow {
  BlockCsr<S, double> a, coarse;
  Array<int, S> coupled;
  int run;
  double shift;
  KOKKOS_FUNCTION void operator()(int row) const {
    for (int k = coarse.row_begin(row); k < coarse.row_begin(row + 1); ++k)
      coarse.block(k) = Mat3<double>{};
    double scale = 0;
    int const last = Kokkos::min(a.rows(), (row + 1) * run);
    for (int i = row * run; i < last; ++i) {
      if (!coupled(i)) continue;
      for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k) {
        int const j = a.column(k);
        if (!coupled(j)) continue;
        coarse.add(row, j / run, a.block(k));
        if (i == j) scale += trace(a.block(k)) / 3;
      }
    }
    double const added = scale > 0 ? shift * scale : 1;
    coarse.add(row, row, added * identity3<double>());
  }
};

template <class S, class R>
struct RestrictRun {
  Array<int, S> coupled;
  VectorField<R, S> r;
  Kokkos::View<double*, typename S::memory> coarse;
  int run;
  KOKKOS_FUNCTION void operator()(int row) const {
    double sum[3] = {};
    int const last = Kokkos::min(int(r.extent(0)), (row + 1) * run);
    for (int i = row * run; i < last; ++i)
      if (coupled(i))
        for (int c = 0; c < 3; ++c) sum[c] += double(r(i, c));
    for (int c = 0; c < 3; ++c) coarse(3 * row + c) = sum[c];
  }
};

template <class S, class R>
struct AddProlonged {
  Array<int, S> coupled;
  Kokkos::View<double*, typename S::memory> coarse;
  VectorField<R, S> z;
  int run;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!coupled(i)) return;
    for (int c = 0; c < 3; ++c) z(i, c) += R(coarse(3 * (i / run) + c));
  }
};

}  // namespace kernels

/// The pattern of R A R' for runs of `run` unknowns.
template <class S>
BlockPattern coarse_pattern(BlockCsr<S, double> const& a, int run) {
  auto const begin = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.row_begin);
  auto const column = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.column);
  BlockPattern pattern{{0}, {}};
  for (int first = 0; first < a.rows(); first += run) {
    int const last = Kokkos::min(a.rows(), first + run);
    std::set<int> runs;
    for (int k = begin(first); k < begin(last); ++k) runs.insert(column(k) / run);
    pattern.column.insert(pattern.column.end(), runs.begin(), runs.end());
    pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
  }
  return pattern;
}

template <class S>
class CoarseLevel {
public:
  /// Builds and factors R A R' for runs of `run` unknowns. `shift` times the sum of the diagonal of
  /// A over a run is added to the diagonal: a body that floats without inertia, whose translations
  /// cost nothing, must leave it invertible, and amplify the round-off of r by no more than 1 /
  /// shift. Anything but `positive` means that A is not positive semi-definite, and that the level
  /// must not be used.
  Definiteness factorize(BlockCsr<S, double> const& a, int run, double shift) {
    BlockCsr<S, double> const coarse(coarse_pattern(a, run));
    if (coarse.rows() != runs_) {
      runs_ = coarse.rows();
      unknowns_ = Kokkos::View<double*, typename S::memory>("coarse_unknowns", 3 * runs_);
      host_ = Kokkos::create_mirror_view(unknowns_);
    }
    if (int(coupled_.extent(0)) != a.rows()) coupled_ = Array<int, S>("coarse_coupled", a.rows());
    run_ = run;
    for_each<S>("coarse_coupled", a.rows(), kernels::FindCoupled<S>{a, coupled_});
    for_each<S>("coarse_galerkin", runs_, kernels::GalerkinRow<S>{a, coarse, coupled_, run, shift});
    return solver_.factorize(coarse);
  }

  /// z += R' (R A R')^-1 R r. Allocates nothing.
  template <class R>
  void add(VectorField<R, S> const& r, VectorField<R, S> const& z) const {
    for_each<S>("coarse_restrict", runs_, kernels::RestrictRun<S, R>{coupled_, r, unknowns_, run_});
    assign(host_, unknowns_);
    std::span<double> const numbers(host_.data(), host_.extent(0));
    solver_.solve(numbers, numbers);
    assign(unknowns_, host_);
    for_each<S>("coarse_prolong", static_cast<int>(z.extent(0)),
                kernels::AddProlonged<S, R>{coupled_, unknowns_, z, run_});
  }

  int runs() const { return runs_; }
  std::size_t memory() const { return solver_.memory() + coupled_.span() * sizeof(int); }

private:
  int run_ = 0, runs_ = 0;
  Array<int, S> coupled_;
  Kokkos::View<double*, typename S::memory> unknowns_;
  typename Kokkos::View<double*, typename S::memory>::HostMirror host_;
  DirectSolver solver_;
};

}  // namespace taut
