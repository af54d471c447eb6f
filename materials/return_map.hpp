// Plasticity between steps: a return map takes the deformation gradient that a step would have if
// it were all elastic, F = U diag(s) V^T, to the nearest one whose stress the material can bear,
// and with it the state of its hardening. All maps here are isotropic, so they change s alone.
//
// A gradient that the material can bear, up to round-off in its singular values, comes back bitwise
// unchanged; what is not a number does, too. Maps are small structs of parameters that kernels
// copy.
#pragma once

#include <taut/core/math/svd.hpp>

#include <concepts>

namespace taut {

template <class T>
struct Returned {
  Mat3<T> F;             ///< the elastic part of the trial gradient
  bool yielded = false;  ///< false: F is the trial gradient itself
};

/// `M` is a return map: what a particle remembers (`State`, which starts as `State<T>()`), the map,
/// and the factor by which the state has changed the Lame parameters.
template <class M>
concept ReturnMap = requires(M const& m, Mat3<double> const& trial,
                             typename M::template State<double>& state) {
  { M::name } -> std::convertible_to<char const*>;
  { m.map(trial, state) } -> std::same_as<Returned<double>>;
  { m.stiffening(state) } -> std::same_as<double>;
};

namespace kernels {

/// Round-off of a singular value near one, in units in which the errors of an svd are few.
template <class T>
inline constexpr T svd_round_off = 32 * Kokkos::Experimental::epsilon_v<T>;

/// U diag(s) V^T.
template <class T>
KOKKOS_FUNCTION Mat3<T> compose(Svd<T> const& d, Vec3<T> const& s) {
  Mat3<T> us;
  for (int c = 0; c < 3; ++c) us.set_column(c, s[c] * d.U.column(c));
  return us * transpose(d.V);
}

/// Singular values below this are raised to it where a logarithm or a root is taken of them: a flat
/// or inverted gradient becomes a very thin one.
template <class T>
inline constexpr T thinnest = T(1e-4);

template <class T>
KOKKOS_FUNCTION Vec3<T> raised(Vec3<T> const& s) {
  T const least = thinnest<T>;  // a device has no address for the constant
  return {max(s[0], least), max(s[1], least), max(s[2], least)};
}

template <class T>
KOKKOS_FUNCTION T mean(Vec3<T> const& a) {
  return (a[0] + a[1] + a[2]) / T(3);
}

template <class T>
KOKKOS_FUNCTION Vec3<T> deviator(Vec3<T> const& a) {
  T const m = mean(a);
  return {a[0] - m, a[1] - m, a[2] - m};
}

}  // namespace kernels

/// No plasticity.
struct NeverYields {
  static constexpr char const* name = "elastic";
  template <class T>
  struct State {};
  template <class T>
  KOKKOS_FUNCTION Returned<T> map(Mat3<T> const& trial, State<T>&) const {
    return {trial, false};
  }
  template <class T>
  KOKKOS_FUNCTION T stiffening(State<T> const&) const {
    return T(1);
  }
};

}  // namespace taut
