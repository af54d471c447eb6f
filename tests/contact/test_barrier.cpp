// Barriers against their textbook formulas, finite differences and quadrature in long double.
#include <taut/contact/barrier.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

using namespace taut;

namespace {

using Wide = long double;

// b(d), as the papers print it.
template <class B>
Wide textbook(Wide d, Wide activation) {
  Wide const x = d / activation, z = x * x, D2 = activation * activation;
  if (x >= 1) return 0;
  if constexpr (std::is_same_v<B, LogBarrier>) {
    return -(d - activation) * (d - activation) * std::log(x);
  } else if constexpr (std::is_same_v<B, IpcBarrier>) {
    return -(d * d - D2) * (d * d - D2) * std::log(d * d / D2) / D2;
  } else if constexpr (std::is_same_v<B, LogSquaredBarrier>) {
    return D2 * (1 - z) * (1 - z) * std::log(z) * std::log(z);
  } else {
    return -2 * (d - activation) * (d - activation) * (d - activation) / (3 * activation);
  }
}

// Fourth-order central difference.
template <class Function>
Wide derivative(Function const& f, Wide at, Wide h) {
  return (8 * (f(at + h) - f(at - h)) - (f(at + 2 * h) - f(at - 2 * h))) / (12 * h);
}

// Distances from contact to activation, dense at both ends.
std::vector<double> relative_distances() {
  std::vector<double> x;
  for (double e = 1e-6; e < 0.5; e *= 1.3) {
    x.push_back(e);
    x.push_back(1 - e);
  }
  return x;
}

template <class B>
Wide slope(Wide d, Wide activation) {
  return evaluate_barrier<B>(d, activation).slope;
}

// Integral of the slope over [before, before + step]: ten panels with five Gauss points each.
template <class B>
Wide integrated_change(Wide before, Wide step, Wide activation) {
  constexpr Wide a = 0.538469310105683091036314420700L, b = 0.906179845938663992797626878299L;
  constexpr Wide wa = 0.478628670499366468041291514836L, wb = 0.236926885056189087514264040720L;
  constexpr Wide w0 = 128.0L / 225;
  Wide sum = 0;
  for (int k = 0; k < 10; ++k) {
    Wide const middle = before + step * (k + 0.5L) / 10, half = step / 20;
    auto const at = [&](Wide s) { return slope<B>(middle + s * half, activation); };
    sum += half * (w0 * at(0) + wa * (at(a) + at(-a)) + wb * (at(b) + at(-b)));
  }
  return sum;
}

}  // namespace

TEMPLATE_TEST_CASE("barriers are what the papers print, with their derivatives", "[contact]",
                   LogBarrier, IpcBarrier, LogSquaredBarrier, CubicBarrier) {
  using B = TestType;
  for (Wide const activation : {1.0L, 3e-3L, 40.0L}) {
    for (double const x : relative_distances()) {
      INFO("x = " << x);
      Wide const d = x * activation;
      auto const found = evaluate_barrier<B>(d, activation);
      Wide const room = 1 - Wide(x), value = textbook<B>(d, activation);
      // The textbook forms cancel next to D.
      CHECK(std::abs(found.value - value) <= 1e-15L / room * value);
      Wide const h = 1e-3L * std::min<Wide>(x, room) * activation;
      auto const b = [&](Wide at) { return evaluate_barrier<B>(at, activation).value; };
      auto const b1 = [&](Wide at) { return slope<B>(at, activation); };
      CHECK(std::abs(derivative(b, d, h) / found.slope - 1) < 1e-9L);
      CHECK(std::abs(derivative(b1, d, h) / found.curvature - 1) < 1e-9L);
      CHECK(found.value > 0);
      CHECK(found.slope < 0);
      CHECK(found.curvature > 0);
    }
  }
}

TEMPLATE_TEST_CASE("barriers lose no digits from 1e-6 of the activation distance on", "[contact]",
                   LogBarrier, IpcBarrier, LogSquaredBarrier, CubicBarrier) {
  using B = TestType;
  auto const check = []<class T>(T activation) {
    constexpr Wide tolerance = 16 * std::numeric_limits<T>::epsilon();
    std::vector<T> distances;
    for (double const x : relative_distances()) {
      distances.push_back(static_cast<T>(x * double(activation)));
    }
    distances.push_back(std::nextafter(activation, T(0)));
    for (T const d : distances) {
      INFO("d = " << d << ", D = " << activation);
      auto const found = evaluate_barrier<B>(d, activation);
      auto const exact = evaluate_barrier<B>(Wide(d), Wide(activation));
      // A NaN fails these.
      CHECK(std::abs(found.value / exact.value - 1) < tolerance);
      CHECK(std::abs(found.slope / exact.slope - 1) < tolerance);
      CHECK(std::abs(found.curvature / exact.curvature - 1) < tolerance);
    }
  };
  for (double const activation : {1.0, 0.7e-6, 2.5e-3, 0.3, 1.1e4}) {
    check(static_cast<float>(activation));
    check(activation);
  }
}

TEMPLATE_TEST_CASE("changes of barriers do not cancel", "[contact]", LogBarrier, IpcBarrier,
                   LogSquaredBarrier, CubicBarrier) {
  using B = TestType;
  auto const check = []<class T>(T activation) {
    constexpr Wide epsilon = std::numeric_limits<T>::epsilon();
    for (double const x : relative_distances())
      for (double const relative : {0.3, 1e-2, 1e-4, 1e-7, 1e-10, 1e-13})
        for (double const sign : {-1.0, 1.0}) {
          double const room = 1 - x;
          T const before = static_cast<T>(x * double(activation));
          T const step = static_cast<T>(sign * relative * std::min(x, room) * double(activation));
          T const after = before + step;
          if (!(after > 0 && after < activation)) continue;
          INFO("d = " << before << ", step " << step << ", D = " << activation);
          Wide const exact = integrated_change<B>(before, step, activation);
          // The rounded distances themselves: near D the barrier is a power of the room.
          Wide const tolerance = (24 + 8 / (1 - Wide(before) / activation)) * epsilon + 1e-11L;
          CHECK(std::abs(barrier_change<B>(before, after, step, activation) / exact - 1) <
                tolerance);
        }
  };
  check(1.0f);
  check(2.5e-3f);
  check(1.0);
  check(2.5e-3);
}

TEMPLATE_TEST_CASE("barriers end at the activation distance, and changes know it", "[contact]",
                   LogBarrier, IpcBarrier, LogSquaredBarrier, CubicBarrier) {
  using B = TestType;
  double const D = 0.2, inside = 0.13, outside = 0.25;
  for (double const d : {D, outside, std::numeric_limits<double>::infinity()}) {
    auto const b = evaluate_barrier<B>(d, D);
    CHECK((b.value == 0 && b.slope == 0 && b.curvature == 0));
  }
  double const value = evaluate_barrier<B>(inside, D).value;
  CHECK(std::abs(barrier_change<B>(inside, outside, outside - inside, D) + value) < 1e-15 * value);
  CHECK(std::abs(barrier_change<B>(outside, inside, inside - outside, D) - value) < 1e-15 * value);
  CHECK(barrier_change<B>(outside, D, D - outside, D) == 0);
  CHECK(barrier_change<B>(inside, inside, 0.0, D) == 0);
  auto const contact = evaluate_barrier<B>(0.0, D);
  if (std::is_same_v<B, CubicBarrier>) {
    CHECK(std::abs(contact.value - 2.0 / 3 * D * D) < 1e-16);
  } else {
    CHECK(contact.value == std::numeric_limits<double>::infinity());
    CHECK_FALSE(std::isfinite(contact.slope));
  }
}

TEMPLATE_TEST_CASE("normalised barriers have curvature 1 at half the activation distance",
                   "[contact]", LogBarrier, IpcBarrier, LogSquaredBarrier, CubicBarrier) {
  using B = TestType;
  for (double const D : {1.0, 1e-3, 17.0}) {
    CHECK(std::abs(evaluate_barrier<B>(D / 2, D).curvature - B::curvature_at_half) <
          1e-14 * B::curvature_at_half);
    auto const plain = evaluate_barrier<B>(D / 3, D);
    auto const scaled = evaluate_barrier<Normalised<B>>(D / 3, D);
    double const factor = scaled.curvature / plain.curvature;
    CHECK(std::abs(evaluate_barrier<Normalised<B>>(D / 2, D).curvature - 1) < 1e-14);
    CHECK(std::abs(scaled.value / plain.value - factor) < 1e-15 * factor);
    CHECK(std::abs(scaled.slope / plain.slope - factor) < 1e-15 * factor);
    double const change = barrier_change<B>(D / 3, D / 4, D / 4 - D / 3, D);
    CHECK(std::abs(barrier_change<Normalised<B>>(D / 3, D / 4, D / 4 - D / 3, D) / change -
                   factor) < 1e-14 * factor);
  }
  CHECK(std::string_view(Normalised<B>::name) == B::name);
}
