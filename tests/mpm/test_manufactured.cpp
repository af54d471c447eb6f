// F14: a motion that is given, and the body force that it takes (the method of manufactured
// solutions; Kamojjala et al. 2015, "Verification tests in solid mechanics"). A ring,
// 3/4 < R < 5/4, is twisted within itself by the angle
//
//   alpha(R, t) = A sin(pi t) h(R),   h = 1 - 32 (R - 1)^2 + 256 (R - 1)^4,
//
// which leaves its edges at rest and free of stress. With s = R alpha' the gradient of deformation
// is F = Q(alpha) (I + s e_Theta (x) e_R), of determinant 1, so that the stress of neo-Hookean
// material is P = mu (F - F^-T), and in the axes turned by alpha
//
//   rho b = rho (R alpha'' e_Theta - R (alpha')^2 e_R)                      (derivatives by time)
//         - mu ((3 alpha' + R alpha'') e_Theta - R alpha'^2 e_R)            (by R)
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <numbers>

namespace taut {
namespace {

using std::numbers::pi;
using Solid = ElasticParticles<Elastic<NeoHookean, FullProjection>>;
using Stepper = ParticleStepper<ImplicitEuler<Ncg<DaiKou, BlockJacobi>>>;

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

/// Root of the mean square distance, m, from where the particles should be at t = 0.4.
double error_at_end(double dx) {
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
  ParticleGrid<> grid(dx, Solid::lanes);
  Potential scene(grid.unknowns(), Inertia<>(grid.unknowns()),
                  BodyForce<>(grid.unknowns(), {0, 0, 0}), Solid({lame}));
  Stepper stepper(ImplicitEuler<Ncg<DaiKou, BlockJacobi>>({.stop = {.tolerance = 1e-6}}));
  double const end = 0.4, h = dx / 5;
  int const steps = static_cast<int>(std::lround(end / h));
  for (int n = 0; n < steps; ++n) {
    // A body force that differs from particle to particle comes with their velocities.
    for (std::size_t p = 0; p < list.size(); ++p)
      list[p].v = list[p].v + h * places[p].force((n + 1) * h, lame.mu);
    Particles<Mixed> const particles(list);
    auto const report = stepper.step(scene, grid, particles, h);
    REQUIRE(report.minimiser.converged());
    REQUIRE(report.halvings == 0);
    list = particles.read();
  }
  double sum = 0, largest_turn = 0;
  for (std::size_t p = 0; p < list.size(); ++p) {
    Vec3<double> const d = list[p].x - places[p].at(end);
    sum += dot(d, d);
    largest_turn = std::max(largest_turn, norm(places[p].at(end) - places[p].at(0)));
  }
  CHECK(largest_turn > 0.25);
  return std::sqrt(sum / double(list.size()));
}

TEST_CASE(
    "F14: a ring twisted within itself is followed, to almost the second order of cell and step",
    "[mpm][F14]") {
  double const coarse = error_at_end(1.0 / 8), fine = error_at_end(1.0 / 16);
  CAPTURE(coarse, fine);
  CHECK(fine < 0.008);
  CHECK(std::log2(coarse / fine) > 1.6);
}

}  // namespace
}  // namespace taut
