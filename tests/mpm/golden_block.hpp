// The block of 4^3 cells of the keys `one_step_goldens` of hot_vectors.json.
#pragma once

#include <taut/core/potential/potential.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <support/data.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace taut::test {

inline std::vector<Particle> golden_block(std::string const& which) {
  double const dx = 0.1;
  std::vector<Particle> list;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 8; ++k) {
        Particle p;
        p.x = {0.8 + dx * (0.25 + 0.5 * i), 0.8 + dx * (0.25 + 0.5 * j),
               0.8 + dx * (0.25 + 0.5 * k)};
        p.volume = dx * dx * dx / 8;
        p.mass = 1000 * p.volume;
        list.push_back(p);
      }
  if (which == "stretch") {
    double const c[3] = {0.6180339887498949, 0.4142135623730951, 0.7320508075688772};
    for (std::size_t p = 0; p < list.size(); ++p)
      for (int a = 0; a < 3; ++a) {
        list[p].F(a, a) = 0.7 + 0.6 * std::fmod(static_cast<double>(p + 1) * c[a], 1.0);
      }
    return list;
  }
  for (Particle& p : list) {
    double const two_pi = 2 * std::numbers::pi, x = p.x[0] - 1, y = p.x[1] - 1, z = p.x[2] - 1;
    p.v = {two_pi * y * z, 0, -two_pi * y * x};
    p.C(0, 1) = two_pi * z;
    p.C(0, 2) = two_pi * y;
    p.C(2, 0) = -two_pi * y;
    p.C(2, 1) = -two_pi * x;
    if (which == "hetero" && p.x[0] >= 1) p.material = 1;
  }
  return list;
}

/// That block at the start of its step: what a time step would minimise, and where from.
template <class Solid>
struct GoldenStep {
  using P = typename Solid::Precision;
  using S = typename Solid::Space;
  using Positions = typename Solid::Positions;
  using Scene = Potential<Inertia<P, S>, BodyForce<P, S>, Solid>;

  nlohmann::json golden;
  double dx, h;
  Vec3<double> gravity;
  Particles<P, S> particles;
  ParticleGrid<QuadraticSpline, P, S> grid;
  Scene scene;

  /// `coarser`: on a grid whose spacing is that many times as large.
  explicit GoldenStep(std::string const& which, int coarser = 1)
      : golden(hot_vectors("one_step_goldens").at(which)),
        dx(coarser * double(golden.at("dx"))),
        h(golden.at("dt")),
        gravity{golden.at("gravity")[0], golden.at("gravity")[1], golden.at("gravity")[2]},
        particles(golden_block(which)),
        grid(dx),
        scene(grid.unknowns(), Inertia<P, S>(grid.unknowns()),
              BodyForce<P, S>(grid.unknowns(), gravity),
              Solid({lame_parameters(1e5, 0.3), lame_parameters(1e9, 0.3)})) {
    grid.rebuild(particles, 2);
    scene.resize(grid.unknowns());
    solid().update(particles, grid.blocks(), grid.nodes(), grid.rest());
    std::vector<BoundarySpec> floor;
    if (which != "stretch") {
      floor.push_back(
          {.name = "floor", .motion = at_rest({identity3<double>(), {0, 0.8 + 1e-9, 0}})});
    }
    BoundaryList<S> boundaries(floor);
    boundaries.set_time(h);
    grid.fix(boundaries, h);
    auto const& target = scene.template term<Inertia<P, S>>().target();
    for (int i = 0; i < grid.size(); ++i)
      for (int c = 0; c < 3; ++c) target(i, c) = grid.rest()(i, c) + h * grid.velocity()(i, c);
    scene.begin_step(grid.rest(), h * h, h, true);
  }
  Solid& solid() { return scene.template term<Solid>(); }

  /// Free nodes fly, fixed ones are where they are going.
  Positions start() {
    Positions const x("x", grid.size());
    auto const& unknowns = grid.unknowns();
    for (int i = 0; i < grid.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        x(i, c) = unknowns.fixed(i)
                      ? unknowns.prescribed(i, c)
                      : grid.rest()(i, c) + h * (grid.velocity()(i, c) + h * gravity[c]);
      }
    return x;
  }
  /// What the reference minimises, at x.
  double energy(Positions const& x) {
    double sum = solid().value(x, 1);
    for (int i = 0; i < grid.size(); ++i) {
      Vec3<double> dv;
      for (int c = 0; c < 3; ++c) {
        dv[c] = (x(i, c) - grid.rest()(i, c)) / h - grid.velocity()(i, c);
      }
      sum += grid.unknowns().mass(i) * (0.5 * dot(dv, dv) - h * dot(gravity, dv));
    }
    return sum;
  }
};

}  // namespace taut::test
