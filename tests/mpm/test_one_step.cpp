// One step of a block of 4^3 cells against numbers that were computed independently: energy,
// residual and Hessian where it begins, and the minimum where it ends.
#include <taut/integrators/direct.hpp>
#include <taut/integrators/newton.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "golden_block.hpp"

namespace taut {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using S = DefaultSpace;
using P = Fp64;
using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>, QuadraticSpline, P>;
using Exact = Newton<Direct, Identity, SufficientDecrease, DecrementWindow, P>;

TEST_CASE("one step of a block agrees with the reference", "[mpm][stepper]") {
  auto const all = test::hot_vectors("one_step_goldens");
  for (std::string const which : {"stretch", "drop", "hetero"}) {
    INFO(which);
    auto const golden = all.at(which);
    double const dx = golden.at("dx"), h = golden.at("dt");
    Vec3<double> const gravity{golden.at("gravity")[0], golden.at("gravity")[1],
                               golden.at("gravity")[2]};
    Particles<P, S> const particles(test::golden_block(which));
    ParticleGrid<QuadraticSpline, P> grid(dx);
    Potential scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                    BodyForce<P>(grid.unknowns(), gravity),
                    Solid({lame_parameters(1e5, 0.3), lame_parameters(1e9, 0.3)}));
    std::vector<BoundarySpec> floor;
    if (which != "stretch") {
      floor.push_back(
          {.name = "floor", .motion = at_rest({identity3<double>(), {0, 0.8 + 1e-9, 0}})});
    }
    BoundaryList<S> boundaries(floor);
    ParticleStepper<ImplicitEuler<Exact>> stepper(
        ImplicitEuler<Exact>({.stop = {.tolerance = 1e-9}}), {.crossing = 100});
    auto const report = stepper.step(scene, grid, particles, h, boundaries);
    CHECK(report.time_step == h);

    // The reference numbers nodes by place.
    int const n = grid.size();
    REQUIRE(n == int(golden.at("n")));
    auto const& ijk = grid.nodes().ijk;
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
      for (int c = 0; c < 3; ++c)
        if (ijk(a, c) != ijk(b, c)) return ijk(a, c) < ijk(b, c);
      return false;
    });
    auto const& unknowns = grid.unknowns();
    double mass = 0, least = 1e9;
    int fixed = 0;
    for (int i = 0; i < n; ++i) {
      mass += unknowns.mass(i);
      least = std::min(least, unknowns.mass(i));
      fixed += unknowns.fixed(i);
    }
    CHECK_THAT(mass, WithinRel(double(golden.at("sum_mass")), 1e-13));
    CHECK_THAT(least, WithinRel(double(golden.at("mass_min")), 1e-9));
    CHECK(fixed == int(golden.at("n_bc")));

    // What is minimised, in the reference's unknowns dv = (x - X) / h - v.
    auto& elastic = scene.term<Solid>();
    typename Solid::Positions const x("x", n);
    auto const dv_of = [&](auto const& at, int i) {
      Vec3<double> dv;
      for (int c = 0; c < 3; ++c)
        dv[c] = (at(i, c) - grid.rest()(i, c)) / h - grid.velocity()(i, c);
      return dv;
    };
    auto const energy = [&](auto const& at) {
      double sum = elastic.value(at, 1);
      for (int i = 0; i < n; ++i) {
        Vec3<double> const dv = dv_of(at, i);
        sum += unknowns.mass(i) * (0.5 * dot(dv, dv) - h * dot(gravity, dv));
      }
      return sum;
    };
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        double const dv = unknowns.fixed(i) ? -grid.velocity()(i, c) : h * gravity[c];
        x(i, c) = grid.rest()(i, c) + h * (grid.velocity()(i, c) + dv);
      }
    CHECK_THAT(energy(x), WithinRel(double(golden.at("E0")), 1e-10));
    typename Solid::Vectors const g("g", n), q("q", n), hq("hq", n);
    scene.gradient(x, g);
    double residual = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) residual += g(i, c) * g(i, c) / (h * h);
    CHECK_THAT(std::sqrt(residual), WithinRel(double(golden.at("r0_l2")), 1e-9));

    auto const matrix = scene.pattern(x);
    scene.assemble(x, matrix);
    double frobenius = 0;
    for (int i = 0; i < n; ++i)
      for (int k = matrix.row_begin(i); k < matrix.row_begin(i + 1); ++k) {
        // The reference has ones, not masses, for what is fixed.
        frobenius += unknowns.fixed(i) ? (matrix.column(k) == i ? 3 : 0)
                                       : contract(matrix.block(k), matrix.block(k));
      }
    CHECK_THAT(std::sqrt(frobenius), WithinRel(double(golden.at("H_frob")), 1e-9));
    for (int k = 0; k < n; ++k)
      for (int c = 0; c < 3; ++c) {
        q(order[k], c) = unknowns.fixed(order[k]) ? 0 : std::sin(0.7 * (3 * k + c) + 0.3);
      }
    scene.product(x, q, hq);
    double norm2 = 0, form = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        norm2 += hq(i, c) * hq(i, c);
        form += hq(i, c) * q(i, c);
      }
    CHECK_THAT(std::sqrt(norm2), WithinRel(double(golden.at("Hq_l2")), 1e-9));
    CHECK_THAT(form, WithinRel(double(golden.at("qHq")), 1e-9));

    // The minimum.
    auto const& reference = golden.at("reference");
    CHECK_THAT(energy(stepper.nodes().x), WithinRel(double(reference.at("E")), 1e-6));
    Vec3<double> momentum{};
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) {
        if (!unknowns.fixed(i)) momentum[c] += unknowns.mass(i) * stepper.nodes().v(i, c);
      }
    }
    for (int k = 171; k < 174; ++k) {
      Vec3<double> const dv = dv_of(stepper.nodes().x, order[k]);
      for (int c = 0; c < 3; ++c) {
        CHECK_THAT(dv[c], WithinAbs(reference.at("dv_171_173")[k - 171][c], 2e-5));
      }
    }
  }
}

}  // namespace
}  // namespace taut
