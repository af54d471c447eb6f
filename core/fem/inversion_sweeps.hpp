// How far a step may go before an element inverts: a cheap certificate for whole patches, and the
// exact root of det(D + t d) for the elements of those that it does not clear.
#pragma once

#include <taut/core/fem/patch_sweep.hpp>
#include <taut/core/math/cubic.hpp>
#include <taut/core/math/edges.hpp>

namespace taut::kernels {

/// What terms that forbid inversion use, at most, of the way to where an element inverts.
inline constexpr double inversion_margin = 0.5;

/// The step that they agree to, of `at_most`: `first(t)` is the length of the first inversion, or
/// anything from t on if there is none below t.
template <class First>
double step_with_margin(double at_most, First const& first) {
  double const asked = at_most / inversion_margin, length = first(asked);
  // What is valid in full is to come back as it was asked for.
  return length < asked ? inversion_margin * length : at_most;
}

/// A length t such that x + s p certainly inverts no element for |s| <= t, found without roots.
/// With the edges D, their change d and C = det(B) cof(D), so that D^-1 = C' / J,
///   det(D + s d) = det(D) det(1 + s D^-1 d) > 0 while |s| |C' d| < J.
/// Zero where an element is so flat that round-off counts, or where anything is not a number. All
/// in squares, and with |cof D| <= |D|^2 / sqrt 3, so that one root per patch is enough.
///
/// Round-off: with m the largest local coordinate, a number of D is off by at most 2 eps m, D by E
/// = 6 eps m. While J > 16 |C| E that takes 1/16 from the bound on the right, and while J > 1e-4
/// |det B| |D|^3 the errors of C and J themselves are far below that; the factor 0.9 covers both.
/// What the same errors do to C' d,
///   e = |det B| |D|^2 (8 eps |d| + 8 eps m_p),
/// is added to it: (|C' d| + e)^2 <= 17/16 |C' d|^2 + 17 e^2. The squares are kept from the
/// smallest numbers by `least_square`, and what has overflowed certifies nothing.
template <class T>
struct InversionCertificate {
  using Real = ValueType<T>;
  static constexpr Real eps = Kokkos::Experimental::epsilon_v<Real>;
  static constexpr Real least_square = Real(1e-30);

  T flat;   ///< (96 eps m)^2 / 3
  T shaky;  ///< m_p^2

  /// `largest_x`, `largest_p`: m and m_p, the largest numbers of the local fields.
  KOKKOS_FORCEINLINE_FUNCTION InversionCertificate(Real largest_x, Real largest_p)
      : flat(square(96 * eps * largest_x) / 3), shaky(square(largest_p)) {}

  /// t^2 of an element.
  KOKKOS_FORCEINLINE_FUNCTION T square_length(Mat3<T> const& B, Mat3<T> const& D,
                                              Mat3<T> const& d) const {
    T const det_B = determinant(B);
    auto const [C, J] = scaled_cofactor(det_B, D);
    Mat3<T> const G = transpose_times(C, d);
    Sym3<T> const dd = gram_of_columns(d);
    T const D2 = contract_columns(D, D), size = square(det_B * D2);
    T const least = size * max(T(Real(1e-8)) * D2, flat) + T(least_square);
    T const error = size * (T(34 * square(8 * eps)) * (dd.s[0] + dd.s[1] + dd.s[2] + shaky));
    T const motion = T(Real(17) / 16) * contract_columns(G, G) + error + T(least_square);
    T const length = select(J * abs(J) > least, T(Real(0.81)) * square(J) / motion, T(0));
    return select(length <= T(Kokkos::Experimental::finite_max_v<Real>), length, T(0));
  }
};

/// The largest step along p up to `at_most` that inverts no element of the patch, in fp64: the
/// certificate where it is enough, otherwise the smallest root of the elements. An element that is
/// flat or inverted already allows no step if `strict`, and any otherwise.
template <class S, class Precision>
struct InversionSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  double at_most;
  bool strict;
  Kokkos::View<double*, typename S::memory> bound;  ///< per patch

  std::size_t scratch_bytes() const {
    return ScratchField<S, Real>::shmem_size(this->row_numbers());
  }

  template <class Field>
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> edge(Field const& field, int from, int to) const {
    Vec3<double> d;
    for (int c = 0; c < 3; ++c) d[c] = double(field(to, c)) - double(field(from, c));
    return d;
  }

  /// What is beyond `shortest` may be answered by infinity.
  KOKKOS_FORCEINLINE_FUNCTION double step_to_flat(int e, int const* vertex, double shortest) const {
    constexpr int pack = Base::lanes;
    auto const& v = this->patches;
    std::uint16_t const* corner = v.corner.data() + std::size_t(e / pack) * 4 * pack + e % pack;
    int at[4];
    for (int a = 0; a < 4; ++a) at[a] = vertex[corner[a * pack] / 4];
    Mat3<double> D, d;
    double motion = 0;
    for (int a = 0; a < 3; ++a) {
      D.set_column(a, edge(x, at[3], at[a]));
      d.set_column(a, edge(p, at[3], at[a]));
      motion += dot(d.column(a), d.column(a));
    }
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    if (motion == 0) return infinity;
    // J has the sign of det(D) det(B): a rest tet may be numbered either way round.
    Mat3<double> B;
    auto const* rest = v.rest.data() + std::size_t(e / pack) * 10 * pack + e % pack;
    for (int k = 0; k < 9; ++k) B.a[k] = double(rest[k * pack]);
    double const sign = determinant(B) < 0 ? -1 : 1;
    Mat3<double> const C = cofactor(D), c = cofactor(d);
    double const det = sign * dot(D.column(0), C.column(0));
    if (!(det > 0)) return strict ? 0 : infinity;
    return smallest_positive_root(det, sign * contract(C, d), sign * contract(D, c),
                                  sign * determinant(d), shortest);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    auto const local = this->room(team, this->row_numbers());
    Real const largest_x = this->template load_relative<true>(team, patch, x, 0, local);
    Real const largest_p = this->template load_relative<true>(team, patch, p, 1, local);
    team.team_barrier();
    InversionCertificate<T> const certificate(largest_x, largest_p);
    auto const elements = this->elements(patch);
    T square_length(Kokkos::Experimental::finite_max_v<Real>);
    auto const certify = [&](int g) __attribute__((always_inline)) {
      Mat3<T> D, d;
      elements.edges(g, local.data(), D, d);
      square_length = min(square_length, certificate.square_length(elements.inverse_rest(g), D, d));
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), certify);
    double length = this->smallest(team, square_length);
    if (length < at_most) {
      int const* vertex = v.vertex.data() + v.local_begin(patch);
      length = at_most;
      auto const solve = [&](int e) {
        length = Kokkos::min(length, step_to_flat(e, vertex, length));
      };
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, v.pack_begin(patch) * Base::lanes,
                                                   v.pack_begin(patch + 1) * Base::lanes),
                           solve);
      team.team_reduce(Kokkos::Min<double>(length));
    }
    Kokkos::single(Kokkos::PerTeam(team), [&]() { bound(patch) = Kokkos::min(length, at_most); });
  }
};

/// The smallest number of a list, for `minimum`.
template <class S>
struct SmallestOf {
  Kokkos::View<double*, typename S::memory> list;
  KOKKOS_FUNCTION void operator()(int i, double& least) const {
    least = Kokkos::min(least, list(i));
  }
};

}  // namespace taut::kernels
