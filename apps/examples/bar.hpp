// What the examples share: a bar of 2 x 0.4 x 0.4 m, clamped at its left end.
#pragma once

#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <algorithm>
#include <cstdio>

struct Bar : taut::Body<> {
  Bar() : Body(taut::make_shape(taut::BoxShape{{2, 0.4, 0.4}}, 15), 1000) {
    fix([](taut::Point const& x) { return x[0] < -1 + 1e-9; });
  }
  taut::State<> state() const { return taut::State<>(positions()); }

  /// Height of the lowest vertex, m.
  double lowest(taut::State<> const& state) const {
    double y = 1e300;
    for (taut::Point const& p : in_input_order(state.x)) y = std::min(y, p[1]);
    return y;
  }
};
