// Motions that are given, and the body forces that they take (the method of manufactured solutions;
// Kamojjala et al. 2015, "Verification tests in solid mechanics"), of neo-Hookean material.
//
// F13: a unit square between walls that slip, u_i = G sin(pi X_i) sin(c pi t + phi_i) with
// c^2 = E / rho and F_i = 1 + d u_i / d X_i, takes
//
//   rho b_i = pi^2 u_i (lambda (1 - ln F_1 F_2) / F_i^2 + mu (1 + 1 / F_i^2) - E).
//
// F14: a ring, 3/4 < R < 5/4, is twisted within itself by the angle
//
//   alpha(R, t) = A sin(pi t) h(R),   h = 1 - 32 (R - 1)^2 + 256 (R - 1)^4,
//
// which leaves its edges at rest and free of stress. With s = R alpha' the gradient of deformation
// is F = Q(alpha) (I + s e_Theta (x) e_R), of determinant 1, so that P = mu (F - F^-T), and in the
// axes turned by alpha
//
//   rho b = rho (R alpha'' e_Theta - R (alpha')^2 e_R)                      (derivatives by time)
//         - mu ((3 alpha' + R alpha'') e_Theta - R alpha'^2 e_R)            (by R)
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>
#include <taut/mpm/slip.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <numbers>

namespace taut {
namespace {

using std::numbers::pi;
using P = Fp64;
using Solid = ElasticParticles<Elastic<NeoHookean, FullProjection>, QuadraticSpline, P>;
using Minimiser = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>;
using Stepper = ParticleStepper<ImplicitEuler<Minimiser>>;

constexpr double young = 1000, poisson = 0.3, density = 1000, amplitude = 0.3;

/// alpha and its derivatives at a radius and a time.
struct Twist {
  double angle, by_R, by_RR, by_t, by_tt;
  Twist(double R, double t) {
    double const d = R - 1, wave = amplitude * std::sin(pi * t);
    double const h = 1 - 32 * d * d + 256 * d * d * d * d;
    angle = wave * h;
    by_R = wave * (-64 * d + 1024 * d * d * d);
    by_RR = wave * (-64 + 3072 * d * d);
    by_t = amplitude * pi * std::cos(pi * t) * h;
    by_tt = -pi * pi * angle;
  }
};

/// A particle of the ring at rest.
struct Place {
  double R, angle, z;
  Vec3<double> along(double twist) const {
    return {-std::sin(angle + twist), std::cos(angle + twist), 0};
  }
  Vec3<double> outward(double twist) const {
    return {std::cos(angle + twist), std::sin(angle + twist), 0};
  }
  Vec3<double> at(double t) const { return R * outward(Twist(R, t).angle) + Vec3<double>{0, 0, z}; }
  Vec3<double> velocity(double t) const {
    Twist const a(R, t);
    return R * a.by_t * along(a.angle);
  }
  /// m/s^2
  Vec3<double> force(double t, double mu) const {
    Twist const a(R, t);
    double const shear = mu / density;
    double const turning = R * a.by_tt - shear * (3 * a.by_R + R * a.by_RR);
    double const falling = -R * a.by_t * a.by_t + shear * R * a.by_R * a.by_R;
    return turning * along(a.angle) + falling * outward(a.angle);
  }
};

/// Two particles along each axis of a cell.
std::vector<Place> ring(double dx) {
  std::vector<Place> places;
  int const across = static_cast<int>(std::lround(1 / dx));
  int const around = static_cast<int>(std::lround(4 * pi / dx));
  for (int r = 0; r < across; ++r)
    for (int k = 0; k < around; ++k)
      for (int layer = 0; layer < 2; ++layer)
        places.push_back(
            {0.75 + (r + 0.5) * 0.5 / across, 2 * pi * k / around, (layer + 0.5) * dx / 2});
  return places;
}

/// Moves particles to t = `end` in steps of h, under accelerations force(p, t) that differ from
/// particle to particle: they come with their velocities.
template <class Force>
void move(std::vector<Particle>& list, double dx, double h, double end,
          std::vector<BoundarySpec> const& walls, Force const& force) {
  ParticleGrid<QuadraticSpline, P> grid(dx);
  Potential scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                  BodyForce<P>(grid.unknowns(), {0, 0, 0}),
                  Solid({lame_parameters(young, poisson)}), Slip<P>());
  Stepper stepper(ImplicitEuler<Minimiser>({.stop = {.tolerance = 1e-6}}));
  BoundaryList<DefaultSpace> boundaries(walls);
  int const steps = static_cast<int>(std::lround(end / h));
  for (int n = 0; n < steps; ++n) {
    for (std::size_t p = 0; p < list.size(); ++p) list[p].v = list[p].v + h * force(p, (n + 1) * h);
    Particles<P> const particles(list);
    auto const report = stepper.step(scene, grid, particles, h, boundaries, n * h);
    REQUIRE(report.minimiser.converged());
    REQUIRE(report.halvings == 0);
    list = particles.read();
  }
}

/// Root of the mean square distance, m, from where the particles should be at t = 0.4.
double error_of_ring(double dx) {
  std::vector<Place> const places = ring(dx);
  Lame<double> const lame = lame_parameters(young, poisson);
  double const around = std::lround(4 * pi / dx);
  std::vector<Particle> list;
  for (Place const& place : places) {
    Particle& p = list.emplace_back();
    p.x = place.at(0);
    p.v = place.velocity(0);
    Twist const start(place.R, 0);
    // grad v = by_R-rate of the twist, at a time when nothing is twisted yet: v = R w(R) e_Theta.
    double const w = start.by_t,
                 slope = amplitude * pi * (-64 * (place.R - 1) + 1024 * std::pow(place.R - 1, 3));
    Vec3<double> const e = place.outward(0), f = place.along(0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        p.C(i, j) = w * (f[i] * e[j] - e[i] * f[j]) + place.R * slope * f[i] * e[j];
    p.volume = 0.5 * dx * (0.5 * dx) * (place.R * 2 * pi / around);
    p.mass = density * p.volume;
  }
  double const end = 0.4;
  move(list, dx, dx / 5, end, {},
       [&](std::size_t p, double t) { return places[p].force(t, lame.mu); });
  double sum = 0, largest_turn = 0;
  for (std::size_t p = 0; p < list.size(); ++p) {
    Vec3<double> const d = list[p].x - places[p].at(end);
    sum += dot(d, d);
    largest_turn = std::max(largest_turn, norm(places[p].at(end) - places[p].at(0)));
  }
  CHECK(largest_turn > 0.25);
  return std::sqrt(sum / double(list.size()));
}

/// Of the square, at t = 0.5.
double error_of_square(double dx) {
  constexpr double G = 0.05, phase[2] = {0, 1};
  double const c = std::sqrt(young / density);
  Lame<double> const lame = lame_parameters(young, poisson);
  auto const wave = [&](int i, double t) { return std::sin(c * pi * t + phase[i]); };
  auto const rate = [&](int i, double t) { return c * pi * std::cos(c * pi * t + phase[i]); };
  int const across = static_cast<int>(std::lround(2 / dx));
  std::vector<Vec3<double>> places;
  for (int k = 0; k < across * across * 2; ++k) {
    places.push_back(
        {(k / 2 / across + 0.5) / across, (k / 2 % across + 0.5) / across, (k % 2 + 0.5) * dx / 2});
  }
  auto const at = [&](Vec3<double> X, double t) {
    for (int i = 0; i < 2; ++i) X[i] += G * std::sin(pi * X[i]) * wave(i, t);
    return X;
  };
  std::vector<Particle> list;
  for (Vec3<double> const& X : places) {
    Particle& p = list.emplace_back();
    p.x = at(X, 0);
    for (int i = 0; i < 2; ++i) {
      p.v[i] = G * std::sin(pi * X[i]) * rate(i, 0);
      p.F(i, i) = 1 + pi * G * std::cos(pi * X[i]) * wave(i, 0);
      p.C(i, i) = pi * G * std::cos(pi * X[i]) * rate(i, 0) / p.F(i, i);
    }
    p.volume = dx * dx * dx / 8;
    p.mass = density * p.volume;
  }
  auto const wall = [](Vec3<double> const& axis, double angle, Vec3<double> const& origin) {
    return BoundarySpec{.name = "wall",
                        .contact = BoundaryContact::slip,
                        .motion = at_rest({turn_matrix({axis, angle}), origin})};
  };
  // The y axis of each is turned to point out of it.
  std::vector<BoundarySpec> const walls{
      wall({0, 0, 1}, -pi / 2, {0, 0, 0}), wall({0, 0, 1}, pi / 2, {1, 0, 0}),
      wall({0, 0, 1}, 0, {0, 0, 0}),       wall({0, 0, 1}, pi, {0, 1, 0}),
      wall({1, 0, 0}, pi / 2, {0, 0, 0}),  wall({1, 0, 0}, -pi / 2, {0, 0, dx})};
  double const end = 0.5;
  move(list, dx, dx / 5, end, walls, [&](std::size_t p, double t) {
    Vec3<double> F{1, 1, 1}, b{};
    for (int i = 0; i < 2; ++i) F[i] += pi * G * std::cos(pi * places[p][i]) * wave(i, t);
    for (int i = 0; i < 2; ++i) {
      double const u = G * std::sin(pi * places[p][i]) * wave(i, t), square = F[i] * F[i];
      b[i] =
          pi * pi * u / density *
          (lame.lambda * (1 - std::log(F[0] * F[1])) / square + lame.mu * (1 + 1 / square) - young);
    }
    return b;
  });
  double sum = 0;
  for (std::size_t p = 0; p < list.size(); ++p) {
    Vec3<double> const d = list[p].x - at(places[p], end);
    sum += dot(d, d);
  }
  return std::sqrt(sum / double(list.size()));
}

TEST_CASE("F13: a square shaken along its axes between walls is followed", "[mpm][F13]") {
  double const coarse = error_of_square(1.0 / 8), fine = error_of_square(1.0 / 16);
  CAPTURE(coarse, fine);
  CHECK(fine < 0.005);
  CHECK(std::log2(coarse / fine) > 0.8);
}

TEST_CASE(
    "F14: a ring twisted within itself is followed, to almost the second order of cell and step",
    "[mpm][F14]") {
  double const coarse = error_of_ring(1.0 / 8), fine = error_of_ring(1.0 / 16);
  CAPTURE(coarse, fine);
  CHECK(fine < 0.008);
  CHECK(std::log2(coarse / fine) > 1.6);
}

}  // namespace
}  // namespace taut
