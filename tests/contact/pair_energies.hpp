// Pairs to evaluate energies on, and loops over all policies.
#pragma once

#include "pair_samples.hpp"

#include <taut/contact/pair.hpp>

namespace taut::test::pairs {

using Wide = long double;

/// A barrier of one's own: g = (1 - x)^4.
struct QuarticBarrier {
  static constexpr char const* name = "quartic";
  static constexpr double curvature_at_half = 3;
  template <class T>
  KOKKOS_FUNCTION static T value(RelativeDistance<T> const& s) {
    return square(square(s.room));
  }
  template <class T>
  KOKKOS_FUNCTION static T slope(RelativeDistance<T> const& s) {
    return T(-4) * s.room * square(s.room);
  }
  template <class T>
  KOKKOS_FUNCTION static T curvature(RelativeDistance<T> const& s) {
    return T(12) * square(s.room);
  }
  template <class T>
  KOKKOS_FUNCTION static T change(RelativeDistance<T> const& before,
                                  RelativeDistance<T> const& after, RelativeStep<T> const& step) {
    return -step.x * (before.room + after.room) * (square(before.room) + square(after.room));
  }
};

/// Calls use.operator()<B, M>() for every barrier and mollifier.
template <class Use>
void for_every_energy(Use const& use) {
  auto const with = [&]<class B>() {
    use.template operator()<B, EdgeMollifier>();
    use.template operator()<B, NoMollifier>();
  };
  with.template operator()<LogBarrier>();
  with.template operator()<IpcBarrier>();
  with.template operator()<LogSquaredBarrier>();
  with.template operator()<CubicBarrier>();
  with.template operator()<QuarticBarrier>();
  with.template operator()<Normalised<LogBarrier>>();
}

/// A pair well inside a feature and below the activation distance, with a mollifier that is active
/// where the energy has one.
struct Sample {
  Feature feature;
  PairKind kind;
  PairParameters<double> parameters;
  Vec3<double> y[4];
  double size, gap;

  Sample(Random& random, Feature f, double size_ = 1, double least_gap = 0.1)
      : feature(f), kind(kind_of(f)), size(size_) {
    double const activation = 0.1 * size;
    gap = activation * log_uniform(random, least_gap, 0.9);
    Corners const corners = corners_of(random, f, gap, size);
    for (std::size_t a = 0; a < 4; ++a) y[a] = corners[a];
    double const area = norm(cross(y[1] - y[0], y[3] - y[2]));
    parameters = {3.0, activation, std::sqrt(uniform(random, 0.02, 0.9)) / area};
  }

  template <class T>
  PairParameters<T> parameters_in() const {
    return {static_cast<T>(parameters.stiffness), static_cast<T>(parameters.activation),
            static_cast<T>(parameters.mollifier_scale)};
  }
};

/// Calls use(sample) `count` times for every feature.
template <class Use>
void for_every_feature(unsigned seed, int count, Use const& use) {
  Random random(seed);
  for (int k = 0; k < count * features; ++k) {
    use(Sample(random, static_cast<Feature>(k % features)), random);
  }
}

/// y + t p, wide.
struct Path {
  Vec3<Wide> y[4], p[4];

  Path(Vec3<double> const (&at)[4], Random& random) {
    for (int a = 0; a < 4; ++a) {
      y[a] = cast<Wide>(at[a]);
      p[a] = cast<Wide>(uniform_vector(random));
    }
  }
  template <class Energy>
  PairState<Wide> state(Sample const& sample, Wide t) const {
    Vec3<Wide> z[4];
    for (int a = 0; a < 4; ++a) z[a] = y[a] + t * p[a];
    return Energy::evaluate(sample.kind, sample.parameters_in<Wide>(), z);
  }
};

/// Fourth-order central difference at 0.
template <class Function>
auto central(Function const& f, Wide h) {
  return (1 / (12 * h)) * (Wide(8) * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h)));
}

}  // namespace taut::test::pairs
