// Static problems with known answers (docs: F4, F6, F7, F8, F11 of the benchmark list).
#include "problem.hpp"

#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <numbers>

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

TEST_CASE("F4: a hanging bar sinks by rho g L^2 / 2E", "[truth]") {
  // In one dimension linear elements are exact at their nodes; here but for a dimple of the mesh.
  for (int cells : {10, 20}) {
    auto overrides = of_solver(tight_newton());
    overrides.push_back(fmt::format("object.bar.shape.resolution={}", cells));
    Trial const trial("hanging_bar", overrides);
    CHECK(trial.simulation->step().converged());
    CHECK_THAT(-lowest_tip(trial), WithinRel(0.04905, 5e-4));
  }
}

TEST_CASE("F6: a cantilever under a small load", "[truth]") {
  // Timoshenko: 0.0403 m. Linear tets lock in bending; the ratio must rise towards one.
  double ratio[2];
  for (int k = 0; k < 2; ++k) {
    auto overrides = of_solver(tight_newton());
    overrides.push_back(fmt::format("object.beam.shape.resolution={}", 20 * (k + 1)));
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

TEST_CASE("F4, F6: the default solver reaches the equilibrium within its error estimate",
          "[truth]") {
  // Without inertia the estimate leans on the smallest curvature that the solver has met.
  for (char const* name : {"hanging_bar", "cantilever"}) {
    INFO(name);
    Trial const exact(name, of_solver(tight_newton())), trial(name, {});
    CHECK(exact.simulation->step().converged());
    auto const report = trial.simulation->step();
    CHECK(report.converged());
    double const error = rms_difference(trial.geometry, trial.simulation->positions(),
                                        exact.simulation->positions());
    INFO("error " << error << " m, estimated as " << report.error_estimate_m << " m, after "
                  << report.iterations << " iterations");
    CHECK(error < 3 * report.error_estimate_m);
    CHECK_THAT(lowest_tip(trial), WithinRel(lowest_tip(exact), 0.02));
  }
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
    for (auto const& o : of_solver(tight_newton(1e-8))) overrides.push_back(o);
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
  // Of second order in the cell size; measured: 1.95 and 1.77.
  CHECK_THAT(std::log2((0.3017 - sink[0]) / (0.3017 - sink[1])), WithinAbs(2, 0.2));
  CHECK_THAT(std::log2((0.0564 - draw[0]) / (0.0564 - draw[1])), WithinAbs(2, 0.4));
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
    auto problem = ElasticProblem<>::make<FixedCorotated>(
        mesh, lame_parameters(1, 1. / 3), [](Point const& X) { return X[0] < 1e-9; });
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
  // The clamped corner of more than a right angle is singular, which takes from the second order.
  CHECK_THAT(std::log2((23.96 - tip[0]) / (23.96 - tip[1])), WithinAbs(1.3, 0.25));
}

TEST_CASE("F11: torsion of a cylinder", "[truth]") {
  // Incompressible neo-Hookean: torque mu pi tau R^4 / 2 and a normal force -mu pi tau^2 R^4 / 4 on
  // the ends, which keep their distance (Poynting). Where the body is compressible the tension of
  // the hoops, mu (tau r)^2, pulls it inwards: to second order in tau, Navier's equation in plane
  // strain has the solution u_r = B r (r^2 - R^2 (2 lambda + 3 mu) / (lambda + mu)) with
  // B = mu tau^2 / 8 (lambda + 2 mu). That takes the factor lambda / (lambda + mu) = 2 nu from the
  // normal force and nothing from the torque. The ends follow it, so that no end effects disturb.
  struct Body {
    double poisson;
    int cells;  // across the coarser mesh
  };
  double const R = 0.5, L = 0.25, tau = 0.2;
  auto iterative = tight_newton(1e-10);
  iterative[2] = "hessian=assembled";
  for (auto const& [nu, cells] : {Body{0.3, 8}, Body{0.48, 12}}) {
    auto const [mu, lambda] = lame_parameters(1e5, nu);
    double const B = mu * tau * tau / (8 * (lambda + 2 * mu));
    double torque[2], normal[2];
    for (int k = 0; k < 2; ++k) {
      auto problem = ElasticProblem<>::make<NeoHookean>(
          make_shape(CylinderShape{R, L, 1}, cells * (k + 1)), {mu, lambda},
          [&](Point const& X) { return std::abs(X[1]) > L / 2 - 1e-9; });
      std::size_t const n = problem.rest.points.size();
      for (std::size_t i = 0; i < n; ++i) {
        Point const& X = problem.rest.points[i];
        double const square = X[0] * X[0] + X[2] * X[2];
        double const radial = 1 + B * (square - R * R * (2 * lambda + 3 * mu) / (lambda + mu));
        double const angle = tau * X[1], c = radial * std::cos(angle), s = radial * std::sin(angle);
        Point const to = {c * X[0] + s * X[2], X[1], -s * X[0] + c * X[2]};
        for (int d = 0; d < 3; ++d) problem.x(i, d) = problem.unknowns.prescribed(i, d) = to[d];
      }
      CHECK(problem.solve({}, iterative).converged());
      auto const f = problem.elastic_forces();
      torque[k] = normal[k] = 0;
      for (std::size_t i = 0; i < n; ++i) {
        if (problem.rest.points[i][1] < L / 2 - 1e-9) continue;
        torque[k] += problem.x(i, 2) * f(i, 0) - problem.x(i, 0) * f(i, 2);
        normal[k] += f(i, 1);
      }
      torque[k] /= mu * std::numbers::pi * tau * std::pow(R, 4) / 2;
      normal[k] /= -mu * std::numbers::pi * tau * tau * std::pow(R, 4) / 4;
      UNSCOPED_INFO("nu = " << nu << ", " << cells * (k + 1) << " cells across: torque "
                            << torque[k] << ", normal force " << normal[k] << " of the formulas");
    }
    // Of second order in the cell size.
    CHECK_THAT(torque[1], WithinAbs(1, 0.01));
    CHECK_THAT(std::log2((torque[0] - 1) / (torque[1] - 1)), WithinAbs(2, 0.4));
    CHECK_THAT(std::log2((normal[0] - 2 * nu) / (normal[1] - 2 * nu)), WithinAbs(1.8, 0.3));
    double const limit = (4 * normal[1] - normal[0]) / 3;
    CHECK_THAT(limit, WithinRel(2 * nu, 0.04));
    if (nu > 0.45) CHECK_THAT(limit, WithinAbs(1, 0.1));
  }
}
