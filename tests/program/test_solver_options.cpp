// Every option of [solver] does what it says: what it changes can be seen in a step.
#include "problem.hpp"

#include <catch2/catch_test_macros.hpp>

using namespace taut;
using namespace taut::test;

namespace {

struct Outcome {
  NewtonReport report;
  std::vector<Point> x;
};

Outcome first_step(std::string const& scene, std::vector<std::string> const& keys) {
  Trial const trial(scene, of_solver(keys), true);
  Outcome outcome{trial.simulation->step(), {}};
  outcome.x = trial.simulation->positions();
  return outcome;
}

}  // namespace

TEST_CASE("preconditioners are rebuilt when refresh says", "[options]") {
  for (std::string const metric : {"block_jacobi", "schwarz_16"}) {
    INFO(metric);
    auto const run = [&](std::string const& refresh) {
      return first_step("drag", {"preconditioner=" + metric, "refresh=" + refresh,
                                 "refresh_every=5", "stopping=budget", "max_iterations=20"})
          .report;
    };
    CHECK(run("always").refreshes == 20);
    CHECK(run("lagged").refreshes == 4);
    CHECK(run("rare").refreshes >= 4);
    bool const rare = metric == "schwarz_16";
    CHECK(run("auto").refreshes == run(rare ? "rare" : "always").refreshes);
  }
}

TEST_CASE("Newton takes line search and window from the options", "[options]") {
  auto const run = [](std::string const& key) {
    return first_step("scrambled_flat", {"method=newton", "hessian=direct", key});
  };
  Outcome const plain = run("window=0");
  CHECK(run("line_search=exact").x != plain.x);
  CHECK(run("window=1").x == plain.x);
  // Without inertia, where the gradient proves nothing.
  auto const at_rest = [](std::string const& key) {
    return first_step("hanging_bar", {"method=newton", "hessian=direct", key}).report.iterations;
  };
  CHECK(at_rest("window=6") > at_rest("window=1"));
}

TEST_CASE("the gradient norm is relative to the first", "[options]") {
  // In units that make all forces a thousand times larger, the same iterates.
  auto const run = [](double unit) {
    Trial const trial("drag",
                      {"solver.stopping=gradient_norm", "solver.tolerance=1e-3",
                       fmt::format("object.body.material.young={}", 1e5 * unit),
                       fmt::format("object.body.material.density={}", 1000 * unit)},
                      true);
    return trial.simulation->step();
  };
  NewtonReport const one = run(1), other = run(1024);
  CHECK(one.stop == Stop::converged_by_gradient);
  CHECK(one.iterations == other.iterations);
  NewtonReport const looser =
      first_step("drag", {"stopping=gradient_norm", "tolerance=0.1"}).report;
  CHECK(looser.iterations < one.iterations);
  CHECK(looser.gradient_norm > one.gradient_norm);
}

TEST_CASE("L-BFGS keeps as many pairs as history says", "[options]") {
  auto const run = [](int pairs) {
    return first_step("scrambled_flat", {"method=lbfgs", fmt::format("history={}", pairs),
                                         "stopping=budget", "max_iterations=30"})
        .x;
  };
  CHECK(run(1) != run(8));
  CHECK(run(8) != run(20));
  CHECK_THROWS_AS(solver({"history=21"}), Error);
}

TEST_CASE("L-BFGS forgets its pairs where forget says so", "[options]") {
  auto const run = [](std::string const& forget) {
    return first_step("scrambled_flat", {"method=lbfgs", "refresh=lagged", "refresh_every=5",
                                         "stopping=budget", "max_iterations=12", forget})
        .x;
  };
  CHECK(run("forget=true") != run("forget=false"));
}

TEST_CASE("Newton's conjugate gradients are flexible where flexible says so", "[options]") {
  for (std::string const hessian : {"assembled", "matrix_free"}) {
    INFO(hessian);
    auto const run = [&](std::string const& flexible) {
      return first_step("drag", {"method=newton", "hessian=" + hessian, flexible});
    };
    Outcome const plain = run("flexible=false"), flexible = run("flexible=true");
    CHECK(flexible.report.converged());
    CHECK(flexible.x != plain.x);  // another formula, of the same numbers but for round-off
  }
}

TEST_CASE("Chebyshev's rho is measured where it is 0", "[options]") {
  auto const run = [](std::string const& rho) {
    return first_step("drag", {"method=chebyshev", "chebyshev_rho=" + rho}).report;
  };
  CHECK(run("0").converged());
  CHECK(run("0").iterations != run("0.99").iterations);
  CHECK_THROWS_AS(solver({"chebyshev_rho=1"}), Error);
}
