// What the element terms ask of a constitutive law. The laws themselves live in materials/; the
// discretisations know them through this concept alone.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <concepts>

namespace taut {

template <class M>
concept ElementMaterial = requires(typename M::template Parameters<double> const& parameters,
                                   typename M::template State<double> const& state,
                                   typename M::template State<double>& weighed,
                                   Mat3<double> const& F, Vec3<double> const& b) {
  { M::name } -> std::convertible_to<char const*>;
  { M::allows_inversion } -> std::convertible_to<bool>;
  {M::template cast<float>(parameters)};
  { M::energy(parameters, F) } -> std::same_as<double>;
  { M::evaluate(parameters, F) } -> std::same_as<typename M::template State<double>>;
  { M::change(parameters, state, F) } -> std::same_as<double>;
  {M::weigh(weighed, 1.0)};
  { M::stress(state) } -> std::same_as<Mat3<double>>;
  { M::diagonal(state, b) } -> std::same_as<Vec3<double>>;
  { M::block(state, b) } -> std::same_as<Sym3<double>>;
  { M::quadratic(state, F) } -> std::same_as<double>;
  { M::frame(state).apply(F) } -> std::same_as<Mat3<double>>;
  { M::frame(state).vertex_pair(b, b) } -> std::same_as<Mat3<double>>;
};

}  // namespace taut
