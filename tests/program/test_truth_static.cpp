// Static problems with known answers (docs: F1, F4, F6, F7, F8, F11 of the benchmark list).
#include "problem.hpp"

#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <numbers>
#include <random>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

double lowest_tip(Trial const& trial) {
  double tip = 0;
  auto const x = trial.simulation->positions();
  for (std::size_t i = 0; i < x.size(); ++i) {
    tip = std::min(tip, x[i][1] - trial.geometry.mesh.points[i][1]);
  }
  return tip;
}

}  // namespace

TEST_CASE("F1: the patch test is exact", "[truth]") {
  // An affine map on the boundary; inside, anything but.
  Mat3<double> const A = {{1.1, 0.05, -0.1, 0.2, 0.9, 0.0, 0.0, -0.15, 1.05}};
  auto const patch = [&]<class Model>() {
    INFO(Model::name);
    auto const boundary = [](Point const& X) {
      return std::abs(X[0]) > 0.4999 || std::abs(X[1]) > 0.4999 || std::abs(X[2]) > 0.4999;
    };
    auto problem =
        ElasticProblem::make<Model>(make_shape(BoxShape{}, 4), lame_parameters(1e5, 0.3), boundary);
    std::mt19937 rng(3);
    std::normal_distribution<double> noise(0, 0.01);
    std::size_t const n = problem.rest.points.size();
    std::vector<Vec3<double>> exact(n);
    for (std::size_t i = 0; i < n; ++i) {
      Point const& X = problem.rest.points[i];
      exact[i] = A * Vec3<double>{X[0], X[1], X[2]};
      for (int c = 0; c < 3; ++c) {
        problem.unknowns.prescribed(i, c) = exact[i][c];
        problem.x(i, c) = exact[i][c] + (problem.unknowns.fixed(i) ? 0 : noise(rng));
      }
    }
    CHECK(problem.solve().converged());
    double worst = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(problem.x(i, c) - exact[i][c]));
    CHECK(worst < 1e-11);
  };
  ElasticModels::for_each(patch);
}

TEST_CASE("F4: a hanging bar sinks by rho g L^2 / 2E", "[truth]") {
  // In one dimension linear elements are exact at their nodes; here but for a dimple of the mesh.
  // In one dimension linear elements are exact at their nodes; here but for a dimple of the mesh.
  for (int cells : {10, 20}) {
    std::vector<std::string> overrides{fmt::format("object.bar.shape.resolution={}", cells)};
    for (auto const& o : tight_newton()) overrides.push_back("solver." + o);
    Trial const trial("hanging_bar", overrides);
    CHECK(trial.simulation->step().converged());
    CHECK_THAT(-lowest_tip(trial), WithinRel(0.04905, 5e-4));
  }
}

TEST_CASE("F4: the default solver reaches the equilibrium within its own error estimate",
          "[truth]") {
  Trial const exact("hanging_bar", {"solver.precision=fp64", "solver.method=newton",
                                    "solver.hessian=direct", "solver.tolerance=1e-10"});
  Trial const trial("hanging_bar", {});
  exact.simulation->step();
  auto const report = trial.simulation->step();
  CHECK(report.converged());
  auto const x = trial.simulation->positions(), y = exact.simulation->positions();
  double square = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (int c = 0; c < 3; ++c) square += (x[i][c] - y[i][c]) * (x[i][c] - y[i][c]);
  double const rms = std::sqrt(square / double(x.size()));
  // The estimate predicts within a small factor where the spectrum has no inertia to lean on.
  CHECK(rms < 10 * report.error_estimate_m);
  CHECK(rms < 0.02 * 0.04905);
}

TEST_CASE("F6: a cantilever under a small load", "[truth]") {
  // Timoshenko: 0.0403 m. Linear tets lock in bending; the ratio must rise towards one.
  double ratio[2];
  for (int k = 0; k < 2; ++k) {
    auto overrides =
        std::vector<std::string>{fmt::format("object.beam.shape.resolution={}", 20 * (k + 1))};
    for (auto const& o : tight_newton()) overrides.push_back("solver." + o);
    Trial const trial("cantilever", overrides);
    CHECK(trial.simulation->step().converged());
    ratio[k] = -lowest_tip(trial) / 0.0403;
    UNSCOPED_INFO("cells along the beam: " << 20 * (k + 1) << ", locking ratio " << ratio[k]);
  }
  CHECK(ratio[0] > 0.6);
  CHECK(ratio[1] > ratio[0]);
  CHECK(ratio[1] > 0.85);
  CHECK(ratio[1] < 1.01);
  // The loss is of second order in the cell size.
  CHECK_THAT((1 - ratio[0]) / (1 - ratio[1]), WithinAbs(4, 1.2));
}

TEST_CASE("F7: the elastica under P L^2 / EI = 1", "[truth]") {
  // Bisshopp and Drucker 1945: the tip sinks by 0.3017 L and moves in by 0.0564 L.
  double const E = 1e6, side = 0.1, I = side * side * side * side / 12;
  double sink[2], draw[2];
  for (int k = 0; k < 2; ++k) {
    std::vector<std::string> overrides{fmt::format("object.beam.shape.resolution={}", 20 * (k + 1)),
                                       fmt::format("force.load.total=[0, {}, 0]", -E * I),
                                       "object.beam.material.poisson=0",
                                       "object.beam.material.model=fixed_corotated"};
    for (auto const& o : tight_newton(1e-8)) overrides.push_back("solver." + o);
    Trial const trial("cantilever", overrides);
    CHECK(trial.simulation->step().converged());
    auto const x = trial.simulation->positions();
    double y = 0, z = 0;
    int count = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      Point const& X = trial.geometry.mesh.points[i];
      if (X[0] < 1 - 1e-9) continue;
      y += x[i][1] - X[1];
      z += x[i][0] - X[0];
      ++count;
    }
    sink[k] = -y / count;
    draw[k] = -z / count;
    UNSCOPED_INFO("sink " << sink[k] << ", draw " << draw[k]);
  }
  CHECK(sink[1] > sink[0]);
  // Extrapolated to zero cell size (second order).
  CHECK_THAT((4 * sink[1] - sink[0]) / 3, WithinRel(0.3017, 0.03));
  CHECK_THAT((4 * draw[1] - draw[0]) / 3, WithinRel(0.0564, 0.08));
}

TEST_CASE("F8: Cook's membrane", "[truth]") {
  // Linear, plane stress by a thin sheet with free faces, nu = 1/3: the tip rises by 23.96 for E =
  // 1 and a shear force of 1 per unit of thickness. Loaded by a millionth of that.
  double const factor = 1e-6, thickness = 4;
  double tip[2];
  for (int k = 0; k < 2; ++k) {
    TetMesh mesh = make_shape(BoxShape{{48, 48, thickness}}, 12 * (k + 1));
    for (Point& p : mesh.points) {
      double const s = (p[0] + 24) / 48, t = (p[1] + 24) / 48;
      p[0] = 48 * s;
      p[1] = 44 * s + t * (44 - 28 * s);
    }
    auto problem = ElasticProblem::make<FixedCorotated>(mesh, lame_parameters(1, 1. / 3),
                                                        [](Point const& X) { return X[0] < 1e-9; });
    std::size_t const n = problem.rest.points.size();
    VectorField<double, DefaultSpace> const f("f", n);
    std::vector<double> share(n, 0);
    double total = 0;
    for (auto const& face : boundary_faces(problem.rest.tets)) {
      bool loaded = true;
      for (int v : face) loaded = loaded && problem.rest.points[v][0] > 48 - 1e-9;
      if (!loaded) continue;
      auto const &a = problem.rest.points[face[0]], &b = problem.rest.points[face[1]],
                 &c = problem.rest.points[face[2]];
      double const area =
          0.5 * std::abs((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]));
      for (int v : face) share[v] += area / 3;
      total += area;
    }
    CHECK_THAT(total, WithinRel(16 * thickness, 1e-12));
    for (std::size_t i = 0; i < n; ++i) f(i, 1) = factor * thickness * share[i] / total;
    CHECK(problem.solve(f).converged());
    tip[k] = 0;
    for (std::size_t i = 0; i < n; ++i) {
      Point const& X = problem.rest.points[i];
      // The middle of the loaded edge.
      if (X[0] > 48 - 1e-9 && std::abs(X[1] - 52) < 1e-6 && std::abs(X[2]) < thickness) {
        tip[k] = std::max(tip[k], (problem.x(i, 1) - X[1]) / factor);
      }
    }
    UNSCOPED_INFO("cells " << 12 * (k + 1) << ": tip " << tip[k]);
  }
  CHECK(tip[1] > tip[0]);
  CHECK(tip[0] > 0.8 * 23.96);
  CHECK(tip[1] < 1.01 * 23.96);
  CHECK_THAT((4 * tip[1] - tip[0]) / 3, WithinRel(23.96, 0.03));
}

TEST_CASE("F11: torsion of a cylinder", "[truth]") {
  // Neo-Hookean: torque mu pi tau R^4 / 2, and the ends pull inwards: N < 0 (Poynting).
  double const R = 0.5, L = 1, tau = 0.2, mu = lame_parameters(1e5, 0.45).mu;
  double error[2];
  for (int k = 0; k < 2; ++k) {
    auto problem = ElasticProblem::make<NeoHookean>(
        make_shape(CylinderShape{R, L, 1}, 4 * (k + 1)), lame_parameters(1e5, 0.45),
        [&](Point const& X) { return std::abs(X[1]) > L / 2 - 1e-9; });
    std::size_t const n = problem.rest.points.size();
    for (std::size_t i = 0; i < n; ++i) {
      Point const& X = problem.rest.points[i];
      double const angle = tau * X[1], c = std::cos(angle), s = std::sin(angle);
      Point const to = {c * X[0] + s * X[2], X[1], -s * X[0] + c * X[2]};
      for (int d = 0; d < 3; ++d) problem.x(i, d) = problem.unknowns.prescribed(i, d) = to[d];
    }
    CHECK(problem.solve().converged());
    auto const f = problem.elastic_forces();
    double torque = 0, normal = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (problem.rest.points[i][1] < L / 2 - 1e-9) continue;
      torque += problem.x(i, 2) * f(i, 0) - problem.x(i, 0) * f(i, 2);
      normal += f(i, 1);
    }
    double const exact = mu * std::numbers::pi * tau * std::pow(R, 4) / 2;
    error[k] = torque / exact - 1;
    UNSCOPED_INFO("cells across " << 4 * (k + 1) << ": torque " << torque / exact << ", normal "
                                  << normal /
                                         (mu * std::numbers::pi * tau * tau * std::pow(R, 4) / 4));
    CHECK(normal < 0);
  }
  // A polygon of tets is too stiff inside and too small outside; both errors are of second order.
  CHECK(std::abs(error[1]) < 0.05);
  CHECK(std::abs(error[1]) < 0.5 * std::abs(error[0]));
}
