// Logarithms of packs against long double, in units in the last place.
#include "samples.hpp"

#include <taut/core/math/logarithm.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

using namespace taut;
using namespace taut::test;

namespace {

// |computed - exact| in units of the spacing of Real at `exact`.
template <class Real>
long double ulps(Real computed, long double exact) {
  Real const rounded = std::abs(static_cast<Real>(exact));
  Real const next = std::nextafter(rounded, std::numeric_limits<Real>::infinity());
  return (computed - exact) / (static_cast<long double>(next) - rounded);
}

template <class T, class Draw, class Log, class Exact>
double worst_ulps(Draw const& draw, Log const& logarithm, Exact const& exact) {
  constexpr int lanes = ScalarTraits<T>::lanes;
  Random random(9);
  Worst worst;
  for (int drawn = 0; drawn < many; drawn += lanes) {
    T x(0);
    for (int i = 0; i < lanes; ++i) set_lane(x, i, draw(random));
    T const y = logarithm(x);
    for (int i = 0; i < lanes; ++i) worst.see(ulps(lane(y, i), exact(lane(x, i))));
  }
  return worst.value();
}

}  // namespace

TEMPLATE_TEST_CASE("log is accurate to 1.5 units in the last place", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  using Limits = std::numeric_limits<ValueType<T>>;
  auto const error = [](auto const& draw) {
    return worst_ulps<T>(
        draw, [](T const& x) { return log(x); }, [](long double x) { return std::log(x); });
  };
  CHECK(error([](Random& r) { return uniform(r, 0.5, 2); }) < 1.5);
  CHECK(error([](Random& r) { return 1 + uniform(r, -1, 1) * log_uniform(r, 1e-12, 0.1); }) < 1.5);
  CHECK(error([](Random& r) { return log_uniform(r, Limits::min(), Limits::max()); }) < 1.5);
  CHECK(error([](Random& r) { return uniform(r, 0, 1) * Limits::min(); }) < 1.5);  // subnormal
}

TEMPLATE_TEST_CASE("log1p is accurate to 2 units in the last place", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  using Limits = std::numeric_limits<ValueType<T>>;
  auto const error = [](auto const& draw) {
    return worst_ulps<T>(
        draw, [](T const& x) { return log1p(x); }, [](long double x) { return std::log1p(x); });
  };
  CHECK(error([](Random& r) { return uniform(r, -1, 1); }) < 2);
  CHECK(error([](Random& r) { return uniform(r, -1, 1) * log_uniform(r, 1e-30, 1); }) < 2);
  CHECK(error([](Random& r) { return log_uniform(r, 1e-30, Limits::max()); }) < 2);
}

TEMPLATE_TEST_CASE("logarithms of special numbers", "[math]", float, double, HostPack<float>,
                   HostPack<double>) {
  using T = TestType;
  using Real = ValueType<T>;
  using Limits = std::numeric_limits<Real>;
  constexpr Real infinity = Limits::infinity();
  auto const log_of = [](Real x) { return lane(log(T(x)), ScalarTraits<T>::lanes - 1); };
  auto const log1p_of = [](Real x) { return lane(log1p(T(x)), ScalarTraits<T>::lanes - 1); };
  CHECK(log_of(1) == 0);
  CHECK(log_of(0) == -infinity);
  CHECK(log_of(-Real(0)) == -infinity);
  CHECK(log_of(infinity) == infinity);
  CHECK(std::isnan(log_of(-1)));
  CHECK(std::isnan(log_of(-infinity)));
  CHECK(std::isnan(log_of(Limits::quiet_NaN())));
  CHECK(log1p_of(0) == 0);
  CHECK(log1p_of(-1) == -infinity);
  CHECK(log1p_of(infinity) == infinity);
  CHECK(std::isnan(log1p_of(-2)));
  CHECK(std::isnan(log1p_of(Limits::quiet_NaN())));
  CHECK(log1p_of(Limits::denorm_min()) == Limits::denorm_min());
}
