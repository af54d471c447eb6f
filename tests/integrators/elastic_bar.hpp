// A clamped bar of real elements for tests of minimisers and time steppers.
#pragma once

#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/presets/elastic.hpp>

#include <cmath>
#include <vector>

namespace taut::test {

template <class P>
using BarTets = ElasticTets<Elastic<StableNeoHookean>, P>;
template <class P>
using BarPotential = Potential<Inertia<P>, BodyForce<P>, BarTets<P>>;

/// A box of 1000 kg/m^3, held at its low x end.
template <class P>
struct Bar : Body<P> {
  double young;

  Bar(Point const& size, int resolution, double young_)
      : Body<P>(make_shape(BoxShape{size}, resolution), 1000), young(young_) {
    this->fix([&](Point const& x) { return x[0] < -size[0] / 2 + 1e-9; });
  }
  int size() const { return this->unknowns.size(); }
  /// Under gravity (m/s^2) and a load (N) along y that is shared out over the high x end.
  BarPotential<P> potential(Vec3<double> const& gravity, double load = 0) const {
    BodyForce<P> force(this->unknowns, gravity);
    double end = -1;
    for (Point const& x : this->rest.points) end = std::max(end, x[0] - 1e-9);
    typename BodyForce<P>::Forces const forces("forces", size());
    double mass = 0;
    for (int i = 0; i < size(); ++i) {
      if (this->rest.points[i][0] > end) mass += this->unknowns.mass(i);
    }
    for (int i = 0; i < size(); ++i) {
      bool const loaded = this->rest.points[i][0] > end;
      if (loaded) {
        forces(i, 1) = typename P::real(load * double(this->unknowns.mass(i)) / mass);
      }
    }
    force.set_forces(forces);
    return BarPotential<P>(this->unknowns, Inertia<P>(this->unknowns), force,
                           BarTets<P>(this->rest, lame_parameters(young, 0.3)));
  }
};

/// Mass-weighted rms distance of two fields over the free unknowns of a body, m.
template <class P, class X, class Y>
double rms_distance(Body<P> const& body, X const& x, Y const& y) {
  double sum = 0, mass = 0;
  for (int i = 0; i < body.unknowns.size(); ++i) {
    if (body.unknowns.fixed(i)) continue;
    mass += double(body.unknowns.mass(i));
    for (int c = 0; c < 3; ++c) {
      sum += double(body.unknowns.mass(i)) * square(double(x(i, c)) - double(y(i, c)));
    }
  }
  return std::sqrt(sum / mass);
}

}  // namespace taut::test
