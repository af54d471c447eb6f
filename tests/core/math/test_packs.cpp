// What kernels do with packs, against the same on their lanes: arithmetic, comparisons, masks.
#include <taut/core/math/scalar.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <string>

using namespace taut;

namespace {

/// Numbers of every kind, often equal to each other.
template <class Real>
Real any_number(std::mt19937& random) {
  constexpr Real infinity = std::numeric_limits<Real>::infinity();
  Real const special[] = {
      0, Real(-0.0), 1, -1, infinity, -infinity, std::numeric_limits<Real>::quiet_NaN()};
  if (random() % 2) return special[random() % std::size(special)];
  return static_cast<Real>(std::uniform_real_distribution<double>(-2, 2)(random));
}

template <class Real>
bool same(Real a, Real b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

}  // namespace

TEMPLATE_TEST_CASE("a pack does what its lanes do", "[math]", float, double) {
  using Real = TestType;
  using T = HostPack<Real>;
  constexpr int lanes = ScalarTraits<T>::lanes;
  std::mt19937 random(3);
  for (int repeat = 0; repeat < 2000; ++repeat) {
    Real a[lanes], b[lanes], c[lanes];
    for (int i = 0; i < lanes; ++i) {
      a[i] = any_number<Real>(random);
      b[i] = any_number<Real>(random);
      c[i] = any_number<Real>(random);
    }
    T const x = load<T>(a), y = load<T>(b), z = load<T>(c);
    std::string wrong;
    auto const number = [&](char const* what, T const& pack, auto const& of_lane) {
      for (int i = 0; i < lanes; ++i)
        if (!same(lane(pack, i), static_cast<Real>(of_lane(i)))) wrong = what;
    };
    auto const mask = [&](char const* what, auto const& pack, auto const& of_lane) {
      bool any = false;
      for (int i = 0; i < lanes; ++i) {
        any = any || of_lane(i);
        if (lane(select(pack, T(1), T(0)), i) != Real(of_lane(i))) wrong = what;
      }
      if (any_lane(pack) != any) wrong = std::string("any_lane of ") + what;
    };
    number("+", x + y, [&](int i) { return a[i] + b[i]; });
    number("-", x - y, [&](int i) { return a[i] - b[i]; });
    number("*", x * y, [&](int i) { return a[i] * b[i]; });
    number("/", x / y, [&](int i) { return a[i] / b[i]; });
    number("minus", -x, [&](int i) { return -a[i]; });
    number("abs", abs(x), [&](int i) { return std::abs(a[i]); });
    number("sqrt", sqrt(x), [&](int i) { return std::sqrt(a[i]); });
    number("min", min(x, y), [&](int i) { return b[i] < a[i] ? b[i] : a[i]; });
    number("max", max(x, y), [&](int i) { return a[i] < b[i] ? b[i] : a[i]; });
    number("select", select(x < y, x, z), [&](int i) { return a[i] < b[i] ? a[i] : c[i]; });

    mask("<", x < y, [&](int i) { return a[i] < b[i]; });
    mask("<=", x <= y, [&](int i) { return a[i] <= b[i]; });
    mask(">", x > y, [&](int i) { return a[i] > b[i]; });
    mask(">=", x >= y, [&](int i) { return a[i] >= b[i]; });
    mask("==", x == y, [&](int i) { return a[i] == b[i]; });
    mask("!", !(x < y), [&](int i) { return !(a[i] < b[i]); });
    mask("&&", x < y && y > z, [&](int i) { return a[i] < b[i] && b[i] > c[i]; });
    mask("||", x < y || y > z, [&](int i) { return a[i] < b[i] || b[i] > c[i]; });
    if (!wrong.empty()) FAIL(wrong << " in repeat " << repeat);
  }
}
