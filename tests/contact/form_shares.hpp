// Where p'Hp comes from: the shares of an island add up to p'Hp of p restricted to it, whatever the
// terms; and bodies are joined that candidates connect, and no others.
#pragma once

#include "obstacle_scenes.hpp"

#include <taut/contact/friction.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/integrators/islands.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

namespace taut::scenes {

/// k/2 |x1 - x0|^2, k = 1 + e
struct Band {
  static constexpr int vertices = 2;
  KOKKOS_FUNCTION double value(int e, Vec3<double> const (&x)[2]) const {
    return 0.5 * (1 + e) * dot(x[1] - x[0], x[1] - x[0]);
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int e, Vec3<double> const (&x)[2], int a) const {
    return (a == 0 ? -1.0 - e : 1.0 + e) * (x[1] - x[0]);
  }
  KOKKOS_FUNCTION Mat3<double> curvature(int e, Vec3<double> const (&)[2], int a, int b) const {
    return (a == b ? 1.0 + e : -1.0 - e) * identity3<double>();
  }
};

/// Two stacks of two cubes far apart, a cube by itself, and a fixed slab under the first stack.
struct Stacks {
  static constexpr double dhat = 0.1;
  Boxes boxes{{{BoxShape{}, 2},
               {BoxShape{}, 2},
               {BoxShape{}, 2},
               {BoxShape{}, 2},
               {BoxShape{}, 2},
               {BoxShape{{3, 0.5, 3}}, 2}},
              [](int b, Point const& x) {
                Point const t = b == 5 ? x : turned(x, 0.2 * b);
                Point const at[] = {{0, 0, 0},       {0.1, 1.05, 0}, {10, 0, 0},
                                    {10, 1.06, 0.1}, {20, 0, 0},     {0, -0.8, 0}};
                return Point{t[0] + at[b][0], t[1] + at[b][1], t[2] + at[b][2]};
              }};
};

template <class P>
struct StackTerms {
  using Elasticity = ElasticTets<Elastic<StableNeoHookean>, P>;
  using Touch = Contact<PairEnergy<>, Bvh<DefaultSpace>, AdditiveCcd, ElasticInclusiveStiffness, P>;
  using Ground = Obstacle<HalfSpace, Normalised<LogBarrier>, ElasticInclusiveStiffness, P>;
  using All = Potential<Inertia<P>, BodyForce<P>, Elasticity, StencilTerm<Band, P>, Touch, Ground,
                        Friction<P>>;
  Stacks stacks;
  Body<P> body{stacks.boxes.mesh, 1000};
  std::vector<int> object;
  All potential{make()};
  typename All::Positions x{body.positions()};

  All make() {
    for (int v : body.order.vertices) object.push_back(stacks.boxes.object[v]);
    body.fix([](Point const& at) { return at[1] < -0.7; });
    Surface const surface = make_surface(boundary_faces(body.rest.tets), object);
    // A band from the lone cube to the first of the second stack: one body from now on.
    std::vector<std::array<int, 2>> bands;
    for (int k = 0; k < 3; ++k) bands.push_back({first_of(4) + k, first_of(2) + 2 * k});
    Touch const touch(body.unknowns, surface, body.rest.points,
                      {.dhat = Stacks::dhat, .start_share = 0});
    Ground const ground(body.unknowns, surface, body.rest.points,
                        HalfSpace{{20.78, 0, 0}, {-1, 0, 0}},
                        {.dhat = Stacks::dhat, .start_share = 0});
    Friction<P> friction(body.unknowns, body.rest.points, {.stick_speed = 0.01});
    friction.add(touch, 0.4);
    friction.add(ground, 0.3);
    return All(body.unknowns, Inertia<P>(body.unknowns), BodyForce<P>(body.unknowns, {0, -9.81, 0}),
               Elasticity(body.rest, lame_parameters(1e5, 0.3)),
               StencilTerm<Band, P>({}, bands, body.unknowns.size()), touch, ground, friction);
  }
  int first_of(int k) const {
    return static_cast<int>(std::find(object.begin(), object.end(), k) - object.begin());
  }
  /// Random, and 0 where fixed.
  typename All::Vectors direction() const {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-1, 1);
    typename All::Vectors const p("p", object.size());
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        double const value = any(random);
        p(i, c) = body.unknowns.fixed(i) ? 0 : typename P::real(value);
      }
    return p;
  }
};

/// The shares of each island are p'Hp of p restricted to it; and what is idle is left out.
template <class P>
void check_shares() {
  StackTerms<P> s;
  auto& e = s.potential;
  REQUIRE(e.divisible());
  // The slab is fixed below and free above.
  e.begin_step(s.x, 1e-4, 0.01, true);
  Bodies<DefaultSpace> const bodies = e.bodies();
  REQUIRE(bodies.count == 5);
  for (std::size_t i = 0; i < s.object.size(); ++i) {
    int const same = s.object[i] == 4 ? 2 : s.object[i];  // by the band
    REQUIRE(bodies.of(i) == bodies.of(s.first_of(same)));
  }

  auto const p = s.direction();
  Array<double, DefaultSpace> const shares("shares", s.object.size());
  e.gradient(s.x, typename StackTerms<P>::All::Vectors("g", s.object.size()));
  e.form_shares(s.x, p, shares);
  typename Bodies<DefaultSpace>::Indices const label("label", bodies.count);
  for (int b = 0; b < bodies.count; ++b) label(b) = b;
  e.pattern_version(s.x);
  e.link(label);
  auto const of = [&](int object) { return label(bodies.of(s.first_of(object))); };
  // The first stack with the slab under it, the second, which has the lone cube by the band.
  CHECK(of(0) == of(1));
  CHECK(of(2) == of(3));
  CHECK(of(2) == of(4));
  CHECK(of(0) == of(5));
  CHECK(of(0) != of(2));

  double const tolerance = std::same_as<P, Fp64> ? 1e-12 : 2e-4;
  int islands = 0;
  for (int l = 0; l < bodies.count; ++l) {
    typename StackTerms<P>::All::Vectors const part("part", s.object.size());
    double sum = 0, size = 0;
    for (std::size_t i = 0; i < s.object.size(); ++i) {
      if (label(bodies.of(i)) != l) continue;
      sum += shares(i);
      for (int c = 0; c < 3; ++c) {
        part(i, c) = p(i, c);
        size += double(p(i, c)) * double(p(i, c));
      }
    }
    if (size == 0) continue;
    ++islands;
    CHECK(sum > 0);
    CHECK_THAT(sum, Catch::Matchers::WithinRel(double(e.quadratic_form(s.x, part)), tolerance));
  }
  CHECK(islands == 2);

  {  // What is idle is left out, and the others do not notice.
    int const idle_label = of(2);
    IdleMask<DefaultSpace> const idle("idle", s.object.size());
    for (std::size_t i = 0; i < s.object.size(); ++i) {
      idle(i) = label(bodies.of(i)) == idle_label;
    }
    typename StackTerms<P>::All::Vectors const g("g", s.object.size()), h("h", s.object.size()),
        q("q", s.object.size());
    typename StackTerms<P>::All::Blocks const a("a", s.object.size()), b("b", s.object.size());
    for (std::size_t i = 0; i < s.object.size(); ++i)
      for (int c = 0; c < 3; ++c) q(i, c) = idle(i) ? 0 : p(i, c);
    e.gradient(s.x, g, a);
    double const change = e.difference(s.x, q, 1e-3), form = e.quadratic_form(s.x, q);
    e.set_idle(idle);
    e.gradient(s.x, h, b);
    CHECK_THAT(e.difference(s.x, q, 1e-3), Catch::Matchers::WithinRel(change, tolerance));
    CHECK_THAT(double(e.quadratic_form(s.x, q)),
               Catch::Matchers::WithinRel(double(form), tolerance));
    double left_out = 0;
    for (std::size_t i = 0; i < s.object.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        if (idle(i)) left_out = std::max(left_out, std::abs(double(g(i, c)) - double(h(i, c))));
        if (!idle(i)) REQUIRE(g(i, c) == h(i, c));
        if (!idle(i)) REQUIRE(a(i, c) == b(i, c));
      }
    CHECK(left_out > 0);
    e.set_idle({});
    e.gradient(s.x, h, b);
    for (std::size_t i = 0; i < s.object.size(); ++i)
      for (int c = 0; c < 3; ++c) REQUIRE(g(i, c) == h(i, c));
  }
}

}  // namespace taut::scenes
