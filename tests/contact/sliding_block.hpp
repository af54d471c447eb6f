// A block on a table: what a mass does on a rough plane is known.
#pragma once

#include "contact_scenes.hpp"

#include <taut/contact/friction.hpp>
#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/materials/stable_neo_hookean.hpp>

namespace taut::scenes {

/// A plate (object 1) over a fixed table (object 0) whose top is at y = 0. The plate is so flat
/// that the moment of its friction leaves all of its foot on the table, and over one triangle all
/// the time: on a mesh the resting gap depends on what is below, so that a table of many is a
/// little bumpy.
struct SlidingBlock {
  static constexpr double g = 9.81, density = 1000, dhat = 0.03;
  static constexpr double side = 0.4, height = 0.1, weight = density * side * side * height;
  using Elasticity = ElasticTets<Elastic<StableNeoHookean>, Fp64>;
  using Touch = Contact<PairEnergy<>, Bvh<DefaultSpace>, AdditiveCcd, GivenStiffness, Fp64>;
  using Terms = Potential<Inertia<Fp64>, BodyForce<Fp64>, Elasticity, Touch, Friction<Fp64>>;
  using Stepper =
      ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>>;

  struct Params {
    double mu = 0.5;
    double gap = 0.6 * dhat;    ///< at the start, m
    double stick_speed = 0.01;  ///< m/s
    double young = 1e7;         ///< Pa
    double turn = 0.3;          ///< of the block about the normal, rad
  };

  Boxes boxes;
  Body<Fp64> body;
  std::vector<int> object;
  Surface surface;
  Elasticity elastic;
  Touch contact;
  Friction<Fp64> friction;
  Terms potential;
  State<Fp64> state;

  explicit SlidingBlock(Params const& p)
      : boxes({{BoxShape{{5, 1, 5}}, 1}, {BoxShape{{side, height, side}}, 4}},
              [&](int b, Point const& x) {
                if (b == 0) return Point{x[0], x[1] - 0.5, x[2]};
                Point const t = turned(x, p.turn);
                return Point{t[0] + 1, t[1] + height / 2 + p.gap, t[2]};
              }),
        body(boxes.mesh, density),
        object(objects(boxes, body)),
        surface(make_surface(boundary_faces(body.rest.tets), object)),
        elastic(body.rest, lame_parameters(p.young, 0.3)),
        contact(fixed_table(), surface, body.rest.points,
                {.dhat = dhat, .stiffness = {.pressure = 1e5}}),
        friction(rough(p)),
        potential(body.unknowns, Inertia<Fp64>(body.unknowns),
                  BodyForce<Fp64>(body.unknowns, {0, -g, 0}), elastic, contact, friction),
        state(body.positions()) {}

  /// Gravity as on a slope of this angle towards x.
  void tilt(double angle) {
    potential.term<BodyForce<Fp64>>().set_acceleration(
        {g * std::sin(angle), -g * std::cos(angle), 0});
  }
  /// Sets the velocity of the block, m/s.
  void throw_with(Point const& velocity) const {
    auto const v = Kokkos::create_mirror_view(state.v);
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; c < 3; ++c) v(i, c) = object[i] == 1 ? velocity[c] : 0;
    assign(state.v, v);
  }
  /// Mean over the mass of the block of a field.
  Point mean(State<Fp64>::Positions const& field) const {
    auto const mass = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body.unknowns.mass);
    auto const value = to_points(field);
    Point sum{};
    double total = 0;
    for (std::size_t i = 0; i < object.size(); ++i) {
      if (object[i] != 1) continue;
      total += double(mass(i));
      for (int c = 0; c < 3; ++c) sum[c] += double(mass(i)) * value[i][c];
    }
    for (double& c : sum) c /= total;
    return sum;
  }
  /// Kinetic, elastic, of contact and of gravity straight down, J.
  double energy() const {
    auto const mass = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body.unknowns.mass);
    auto const x = to_points(state.x), v = to_points(state.v);
    double sum = elastic.value(state.x, 1) + contact.value(state.x, 1);
    for (std::size_t i = 0; i < object.size(); ++i) {
      if (object[i] != 1) continue;
      for (double c : v[i]) sum += 0.5 * double(mass(i)) * c * c;
      sum += double(mass(i)) * g * x[i][1];
    }
    return sum;
  }

private:
  static std::vector<int> objects(Boxes const& boxes, Body<Fp64> const& body) {
    std::vector<int> object;
    for (int v : body.order.vertices) object.push_back(boxes.object[v]);
    return object;
  }
  Unknowns<Fp64> const& fixed_table() {
    body.unknowns.length = side / 4;  // of the plate's edges
    auto const fixed = Kokkos::create_mirror_view(body.unknowns.fixed);
    for (std::size_t v = 0; v < object.size(); ++v) fixed(v) = object[v] == 0;
    assign(body.unknowns.fixed, fixed);
    return body.unknowns;
  }
  Friction<Fp64> rough(Params const& p) const {
    Friction<Fp64> f(body.unknowns, body.rest.points, {.stick_speed = p.stick_speed});
    f.add(contact, p.mu);
    return f;
  }
};

}  // namespace taut::scenes
