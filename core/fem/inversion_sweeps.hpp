// How far a step may go before an element inverts: a cheap certificate for whole patches, and the
// exact root of det(D + t d) for the elements of those that it does not clear.
#pragma once

#include <taut/core/fem/patch_sweep.hpp>
#include <taut/core/math/cubic.hpp>

namespace taut::kernels {

/// A step along p that certainly inverts no element of the patch, found without roots: det (F + t
/// dF) > 0 while t |F^-1 dF| < 1, and F^-1 dF = cof(F)' dF / J. Zero where an element is so flat
/// that round-off counts, or where anything is not a number.
///
/// Round-off: with m the largest local coordinate, an edge is off by at most 2 eps m and F by dF0 =
/// 2 eps m |B|. While J > 32 |C| dF0 that changes F^-1 by less than 1/16, and while J > 1e-4 |F|^3
/// the errors of C and J themselves are far below that; the factor 0.9 covers both. What the same
/// errors do to F^-1 dF is added to it.
template <class S, class Precision>
struct CertificateSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  Kokkos::View<Real*, typename S::memory> certified;

  std::size_t scratch_bytes() const {
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(4) * this->patches.max_locals);
  }

  /// Largest number of the patch's rows.
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION Real largest(Team const& team, int patch,
                                           ScratchField<S, Real> const& field) const {
    Real result = 0;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, 4 * this->locals(patch)),
        [&](int k, Real& most) { most = Kokkos::max(most, Kokkos::abs(field(k))); },
        Kokkos::Max<Real>(result));
    return result;
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double& smallest) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 4 * v.max_locals);
    this->load_relative(team, patch, x, local_x);
    this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    constexpr Real eps = Kokkos::Experimental::epsilon_v<Real>;
    T const flat(64 * eps * largest(team, patch, local_x));
    T const shaky(8 * eps * largest(team, patch, local_p));
    auto const elements = this->elements(patch);
    Real best = Kokkos::Experimental::finite_max_v<Real>;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, this->groups(patch)),
        [&](int g, Real& least) __attribute__((always_inline)) {
          Mat3<T> const B = elements.inverse_rest(g);
          Mat3<T> const F = elements.edges(g, local_x.data()) * B;
          Mat3<T> const dF = elements.edges(g, local_p.data()) * B;
          Mat3<T> const C = cofactor(F), G = transpose_times(C, dF);
          T const J = dot(F.column(0), C.column(0)), I2 = contract(F, F);
          T const norm_B = sqrt(contract(B, B)), norm_C = sqrt(contract(C, C));
          T const least_J = max(T(Real(1e-4)) * I2 * sqrt(I2), flat * norm_B * norm_C);
          T const error = I2 * (T(8 * eps) * sqrt(contract(dF, dF)) + shaky * norm_B);
          T const length = T(Real(0.9)) * J / (sqrt(contract(G, G)) + error + T(Real(1e-30)));
          T const safe = select(J > least_J, length, T(0));
          least = Kokkos::min(least, min_lanes(select(safe >= T(0), safe, T(0))));
        },
        Kokkos::Min<Real>(best));
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      certified(patch) = best;
      smallest = Kokkos::min(smallest, double(best));
    });
  }
};

/// Smallest step along p up to `at_most` at which an element of the patch reaches J = 0, in fp64.
/// An element that is flat or inverted already allows no step if `strict`, and any otherwise.
template <class S, class Precision>
struct InversionSweep {
  PatchViews<S, typename Precision::real> patches;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  Kokkos::View<typename Precision::real*, typename S::memory> certified;
  double at_most;
  bool strict;

  template <class Field>
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> edge(Field const& field, int from, int to) const {
    Vec3<double> d;
    for (int c = 0; c < 3; ++c) d[c] = double(field(to, c)) - double(field(from, c));
    return d;
  }

  KOKKOS_FORCEINLINE_FUNCTION double bound(int e, int const* vertex) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    std::uint16_t const* corner =
        patches.corner.data() + std::size_t(e / lanes) * 4 * lanes + e % lanes;
    int v[4];
    for (int a = 0; a < 4; ++a) v[a] = vertex[corner[a * lanes] / 4];
    Mat3<double> D, d;
    double motion = 0;
    for (int a = 0; a < 3; ++a) {
      D.set_column(a, edge(x, v[3], v[a]));
      d.set_column(a, edge(p, v[3], v[a]));
      motion += dot(d.column(a), d.column(a));
    }
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    if (motion == 0) return infinity;
    // J has the sign of det(D) det(B): a rest tet may be numbered either way round.
    Mat3<double> B;
    auto const* rest = patches.rest.data() + std::size_t(e / lanes) * 10 * lanes + e % lanes;
    for (int k = 0; k < 9; ++k) B.a[k] = double(rest[k * lanes]);
    double const sign = determinant(B) < 0 ? -1 : 1;
    Mat3<double> const C = cofactor(D), c = cofactor(d);
    double const det = sign * dot(D.column(0), C.column(0));
    if (!(det > 0)) return strict ? 0 : infinity;
    return smallest_positive_root(det, sign * contract(C, d), sign * contract(D, c),
                                  sign * determinant(d));
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double& smallest) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    int const patch = team.league_rank();
    if (double(certified(patch)) >= at_most) return;
    int const* vertex = patches.vertex.data() + patches.local_begin(patch);
    double best = smallest;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, patches.pack_begin(patch) * lanes,
                                patches.pack_begin(patch + 1) * lanes),
        [&](int e, double& least) { least = Kokkos::min(least, bound(e, vertex)); },
        Kokkos::Min<double>(best));
    Kokkos::single(Kokkos::PerTeam(team), [&]() { smallest = Kokkos::min(smallest, best); });
  }
};

}  // namespace taut::kernels
