// The alternating direction method of multipliers over particles: the local minimisation of a
// particle, against its condition for all models and what is hard for it; what a splitting leaves
// as it is; and that its steps end where the reference does.
#include <taut/integrators/admm.hpp>
#include <taut/mpm/particle_splitting.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <support/threads.hpp>

#include <limits>
#include <random>

#include "golden_block.hpp"

namespace taut {
namespace {

using S = DefaultSpace;
using P = Fp64;
using Body = ElasticParticles<Elastic<FixedCorotated, FullProjection>, QuadraticSpline, P>;
using Block = test::GoldenStep<Body>;

/// F = A diag(s) B with random rotations.
Mat3<double> with_stretches(Vec3<double> const& s, std::mt19937& random) {
  auto const rotation = [&] {
    Mat3<double> a;
    for (double& entry : a.a) entry = double(random()) / 4294967296.0 - 0.5;
    return polar_rotation(a);
  };
  Mat3<double> D{};
  for (int c = 0; c < 3; ++c) D(c, c) = s[c];
  return rotation() * D * transpose(rotation());
}

}  // namespace

TEMPLATE_TEST_CASE("the local minimisation of a particle meets its condition", "[mpm][admm]",
                   FixedCorotated, NeoHookean, StableNeoHookean) {
  using Material = Elastic<TestType, FullProjection>;
  auto const lame = lame_parameters(1e5, 0.4);
  std::mt19937 random(5);
  // Near rest, stretched far, flat, a point, inside out.
  Vec3<double> const stretches[] = {{1, 1, 1},    {1.01, 0.98, 1.02}, {3, 0.5, 0.8},
                                    {1, 1, 1e-9}, {0, 0, 0},          {1, 0.7, -0.4},
                                    {-2, 1, 0.1}, {40, 1, 0.02},      {1.3, 1.3, 0.2}};
  for (double const k : {1e3, 1e5, 1e8})
    for (auto const& s : stretches) {
      Mat3<double> const target = with_stretches(s, random);
      CAPTURE(k, s[0], s[1], s[2]);
      auto const objective = [&](Mat3<double> const& Z) {
        Mat3<double> const away = Z - target;
        return Material::energy(lame, Z) + 0.5 * k * contract(away, away);
      };
      Mat3<double> const Z = kernels::proximal<Material>(lame, k, target);
      auto const state = Material::evaluate(lame, Z);
      Mat3<double> const left = Material::stress(state) + k * (Z - target);
      double const scale = (1e5 + k) * (1 + contract(target, target));
      CHECK(std::sqrt(contract(left, left)) < 1e-8 * scale);
      // A minimum: near it nothing is lower.
      for (int n = 0; n < 20; ++n) {
        Mat3<double> near = Z;
        for (double& entry : near.a) entry += 1e-3 * (double(random()) / 4294967296.0 - 0.5);
        CHECK(objective(near) > objective(Z) - 1e-12 * scale);
      }
      if (!Material::allows_inversion) CHECK(determinant(Z) > 0);
    }
}

TEST_CASE("a pack of particles is minimised as each of them alone", "[mpm][admm]") {
  using Material = Elastic<FixedCorotated, FullProjection>;
  using Pack = HostPack<double>;
  constexpr int lanes = host_lanes<double>;
  std::mt19937 random(9);
  std::vector<Mat3<double>> targets, alone;
  Mat3<Pack> packed;
  auto const lame = lame_parameters(1e5, 0.3);
  for (int l = 0; l < lanes; ++l) {
    targets.push_back(with_stretches({1 + 0.4 * l, 0.5, l == 1 ? -0.5 : 1.0}, random));
    alone.push_back(kernels::proximal<Material>(lame, 2e5, targets.back()));
  }
  for (int c = 0; c < 9; ++c) {
    double entry[lanes];
    for (int l = 0; l < lanes; ++l) entry[l] = targets[l].a[c];
    packed.a[c] = load<Pack>(entry);
  }
  auto const together = kernels::proximal<Material>(Material::cast<Pack>(lame), Pack(2e5), packed);
  for (int l = 0; l < lanes; ++l)
    for (int c = 0; c < 9; ++c) CHECK(std::abs(lane(together.a[c], l) - alone[l].a[c]) < 1e-9);
}

TEST_CASE("copies that balance the forces change no gradient, and stay", "[mpm][admm]") {
  Block step("stretch");
  auto const x = step.start();
  Body::Vectors const g("g", step.grid.size()), exact("exact", step.grid.size());
  step.scene.gradient(x, exact);
  ParticleSplitting<P> splitting({.stiffness = 2, .relaxation = 1.5});
  splitting.start(step.scene, x);
  double most = 0;
  for (int i = 0; i < step.grid.size(); ++i)
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(exact(i, c)));
  for (int round = 0; round < 3; ++round) {
    CAPTURE(round);
    assign(g, exact);
    splitting.update(step.scene, x, g);
    double wrong = 0;
    for (int i = 0; i < step.grid.size(); ++i)
      for (int c = 0; c < 3; ++c) wrong = std::max(wrong, std::abs(g(i, c) - exact(i, c)));
    CHECK(wrong < 1e-9 * most);
  }
  // The operator, against the stretches that it is a sum of: d = a x is one of all particles alike.
  Body::Vectors const d("d", step.grid.size()), hd("hd", step.grid.size());
  auto const& unknowns = step.grid.unknowns();
  double expected = 0;
  for (int i = 0; i < step.grid.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      d(i, c) = 0.01 * step.grid.rest()(i, c);
      expected += unknowns.mass(i) * d(i, c) * d(i, c);
    }
  double const k =
      2 * norm_at_rest<Elastic<FixedCorotated, FullProjection>>(lame_parameters(1e5, 0.3)) / 3;
  for (Particle const& p : test::golden_block("stretch")) {
    expected += step.h * step.h * p.volume * k * 1e-4 * contract(p.F, p.F);
  }
  splitting.product(d, hd);
  double form = 0;
  for (int i = 0; i < step.grid.size(); ++i)
    for (int c = 0; c < 3; ++c) form += d(i, c) * hd(i, c);
  CHECK(std::abs(form - expected) < 1e-11 * expected);
}

TEST_CASE("steps of ADMM end where the reference does, on any number of threads", "[mpm][admm]") {
  using Minimiser = Admm<ParticleSplitting<P>, DecrementWindow, P>;
  auto const run = [&](char const* which, double relaxation, int most) {
    Block step(which);
    auto const x = step.start();
    Minimiser minimiser({.copies = {.relaxation = relaxation, .cycle = {.direct_nodes = 20}},
                         .stop = {.tolerance = 1e-5}});
    auto const report = minimiser.minimise(step.scene, x);
    CAPTURE(which, relaxation, report.iterations, report.linear_iterations);
    CHECK(report.converged());
    CHECK(report.iterations <= most);
    double const reference = step.golden.at("reference").at("E"), first = step.golden.at("E0");
    CHECK(std::abs(step.energy(x) - reference) < 1e-7 * (first - reference));
    return std::vector<double>(x.data(), x.data() + x.span());
  };
  run("stretch", 1, 600);
  run("drop", 1.6, 200);
  auto const threads = test::on_one_thread_and_all([&] { return run("drop", 1, 250); });
  CHECK(threads[0] == threads[1]);
}

TEST_CASE("ADMM from what is not a number says so", "[mpm][admm]") {
  Block step("drop");
  auto const x = step.start();
  x(0, 0) = std::numeric_limits<double>::quiet_NaN();
  auto const report = Admm<ParticleSplitting<P>, DecrementWindow, P>().minimise(step.scene, x);
  CHECK(report.stop == Stop::non_finite);
  CHECK(report.iterations == 0);
}

}  // namespace taut
