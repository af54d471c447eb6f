// Conjugate gradients and the direct solver on systems with known solutions, and on those that have
// none.
#include "../core/sparse/samples.hpp"
#include "toy_objectives.hpp"

#include <taut/integrators/direct.hpp>
#include <taut/integrators/linear_solver.hpp>

#include <catch2/catch_test_macros.hpp>

namespace {

using namespace taut;
using namespace taut::test;

using Field = VectorField<double, DefaultSpace>;
using Chain = toy::Chain<toy::Barrier, Fp64>;
using Id = Identity<Fp64, DefaultSpace>;
static_assert(LinearSolver<AssembledPcg<Fp64>, Chain, Id>);
static_assert(LinearSolver<MatrixFreePcg<Fp64>, Chain, Id>);
static_assert(LinearSolver<Direct<Fp64>, Chain, Id>);

template <class S>
struct ProductWith {
  BlockCsr<S> a;
  double sign = 1;
  void operator()(VectorField<double, S> const& d, VectorField<double, S> const& ad) const {
    product(a, d, ad);
    for (int i = 0; i < a.rows(); ++i)
      for (int c = 0; c < 3; ++c) ad(i, c) *= sign;
  }
};

struct Solution {
  LinearReport report;
  std::vector<double> x;
};

template <class S, class M = Identity<Fp64, S>>
Solution solve(ProductWith<S> const& by_a, VectorField<double, S> const& b, double tolerance,
               int max_iterations = 1000, M const& preconditioner = M(), bool flexible = false) {
  ConjugateGradients<Fp64, S> cg;
  int const n = by_a.a.rows();
  cg.resize(n);
  VectorField<double, S> const x("x", n);
  assign(x, 42.0);  // its old value is of no account
  LinearReport const report =
      cg.solve(by_a, preconditioner, b, tolerance, max_iterations, x, flexible);
  return {report, numbers(x)};
}

double scalar_product(std::vector<double> const& a, std::vector<double> const& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

std::vector<double> residual(BlockCsr<DefaultSpace> const& a, Field const& b,
                             std::vector<double> const& x) {
  Field const field("x", a.rows()), ax("ax", a.rows());
  for (int i = 0; i < a.rows(); ++i)
    for (int c = 0; c < 3; ++c) field(i, c) = x[3 * i + c];
  product(a, field, ax);
  std::vector<double> r = numbers(b);
  for (std::size_t i = 0; i < r.size(); ++i) r[i] -= numbers(ax)[i];
  return r;
}

}  // namespace

TEST_CASE("conjugate gradients and the direct solver agree") {
  auto const a = lattice_matrix<DefaultSpace>(5, 0.01);
  auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
  std::vector<double> exact = numbers(b);
  DirectSolver direct;
  REQUIRE(direct.factorize(a) == Definiteness::positive);
  direct.solve(exact, exact);

  Solution const cg = solve<DefaultSpace>({a}, b, 1e-13);
  CHECK(cg.report.stop == LinearStop::converged);
  CHECK(relative_difference(cg.x, exact) < 1e-9);
}

TEST_CASE("conjugate gradients report the residual of the solution that they return") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.1);
  auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
  std::vector<double> const bs = numbers(b);
  for (double const tolerance : {0.5, 1e-3, 1e-8}) {
    Solution const cg = solve<DefaultSpace>({a}, b, tolerance);
    std::vector<double> const r = residual(a, b, cg.x);
    double const relative = std::sqrt(scalar_product(r, r) / scalar_product(bs, bs));
    CHECK(cg.report.residual <= tolerance);
    CHECK(std::abs(relative / cg.report.residual - 1) < 1e-4);
  }
}

TEST_CASE("conjugate gradients end after as many steps as there are eigenvalues") {
  BlockPattern pattern{{0}, {}};
  for (int i = 0; i < 50; ++i) {
    pattern.column.push_back(i);
    pattern.row_begin.push_back(i + 1);
  }
  BlockCsr<SerialSpace> const a(pattern);
  double const eigenvalues[] = {1, 10, 1000};
  for (int i = 0; i < 50; ++i)
    for (int c = 0; c < 3; ++c) a.block(i)(c, c) = eigenvalues[(i + c) % 3];
  Solution const cg = solve<SerialSpace>({a}, random_field<double, SerialSpace>(50, 3), 1e-10);
  CHECK(cg.report.stop == LinearStop::converged);
  CHECK(cg.report.iterations == 3);
}

TEST_CASE("flexible conjugate gradients bear a preconditioner that changes") {
  /// Another diagonal each time.
  struct Fickle {
    mutable int calls = 0;
    void apply(Field const& r, Field const& z) const {
      ++calls;
      for (int i = 0; i < r.extent_int(0); ++i)
        for (int c = 0; c < 3; ++c) {
          z(i, c) = (1 + (7 * i + 3 * c + 5 * calls) % 4) * r(i, c);
        }
    }
  };
  auto const a = lattice_matrix<DefaultSpace>(4, 0.1);
  auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
  // A fixed one makes no difference.
  Solution const fixed = solve<DefaultSpace>({a}, b, 1e-10);
  Solution const flexible = solve<DefaultSpace>({a}, b, 1e-10, 1000, Id(), true);
  CHECK(std::abs(flexible.report.iterations - fixed.report.iterations) <= 1);
  CHECK(relative_difference(flexible.x, fixed.x) < 1e-8);

  Solution const plain = solve<DefaultSpace>({a}, b, 1e-10, 1000, Fickle());
  Solution const bears = solve<DefaultSpace>({a}, b, 1e-10, 1000, Fickle(), true);
  CHECK(bears.report.stop == LinearStop::converged);
  CHECK(relative_difference(bears.x, fixed.x) < 1e-7);
  CHECK(bears.report.iterations < plain.report.iterations);
}

TEST_CASE("every iterate lowers the energy of the model") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.001);
  auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
  std::vector<double> const bs = numbers(b);
  double last = 0;
  for (int budget = 1; budget < 20; ++budget) {
    Solution const cg = solve<DefaultSpace>({a}, b, 1e-12, budget);
    CHECK(cg.report.stop == LinearStop::budget);
    CHECK(cg.report.iterations == budget);
    std::vector<double> const r = residual(a, b, cg.x);
    double const energy = -0.5 * scalar_product(cg.x, bs) - 0.5 * scalar_product(cg.x, r);
    CHECK(energy < last);
    last = energy;
  }
}

TEST_CASE("a preconditioner that holds the Hessian of the iterate lends it") {
  struct Lender : Id {
    bool lends = true;
    mutable int products = 0;
    bool holds_hessian() const { return lends; }
    void hessian_product(Field const& d, Field const& hd) const {
      ++products;
      for (int i = 0; i < d.extent_int(0); ++i)
        for (int c = 0; c < 3; ++c) hd(i, c) = 2 * d(i, c);
    }
  };
  Chain chain;
  auto const x = chain.start();
  Field const g("g", chain.size()), p("p", chain.size());
  chain.gradient(x, g);
  AssembledPcg<Fp64> pcg;
  pcg.start(chain);
  Lender lender;
  CHECK(pcg.solve(chain, x, g, lender, 1e-12, p).stop == LinearStop::converged);
  CHECK(lender.products == 1);  // twice the identity
  for (int i = 0; i < chain.size(); ++i) CHECK(std::abs(p(i, 0) - g(i, 0) / 2) < 1e-12);
  lender.lends = false;
  pcg.solve(chain, x, g, lender, 1e-12, p);
  CHECK(lender.products == 1);
}

TEST_CASE("conjugate gradients truncate where no curvature is left") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.0);
  SECTION("at once, with the preconditioned right-hand side, on negative curvature") {
    auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
    Solution const cg = solve<DefaultSpace>({a, -1}, b, 1e-6);
    CHECK(cg.report.stop == LinearStop::truncated);
    CHECK(cg.report.iterations == 0);
    CHECK(cg.x == numbers(b));
  }
  SECTION("at once where there is no curvature at all") {
    auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
    Solution const cg = solve<DefaultSpace>({a, 0}, b, 1e-6);
    CHECK(cg.report.stop == LinearStop::truncated);
    CHECK(cg.x == numbers(b));
  }
  SECTION("in the midst, with the best iterate") {
    // b pushes the body as a whole, which nothing resists: the energy has no minimum.
    auto const b = random_field<double, DefaultSpace>(a.rows(), 3);
    Solution const cg = solve<DefaultSpace>({a}, b, 1e-12, 5000);
    CHECK(cg.report.stop == LinearStop::truncated);
    Solution const before = solve<DefaultSpace>({a}, b, 1e-12, cg.report.iterations / 2);
    auto const energy = [&](std::vector<double> const& x) {
      return -0.5 * scalar_product(x, numbers(b)) - 0.5 * scalar_product(x, residual(a, b, x));
    };
    CHECK(energy(cg.x) < energy(before.x));
    CHECK(energy(before.x) < 0);
  }
}

TEST_CASE("nothing to solve takes no iteration") {
  Solution const cg =
      solve<DefaultSpace>({lattice_matrix<DefaultSpace>(3, 1.0)}, Field("b", 27), 1e-6);
  CHECK(cg.report.stop == LinearStop::converged);
  CHECK(cg.report.iterations == 0);
  CHECK(cg.x == std::vector<double>(81, 0.0));
}

TEST_CASE("conjugate gradients are bitwise repeatable for any number of threads") {
  Solution const threads = solve<DefaultSpace>({lattice_matrix<DefaultSpace>(9, 0.01)},
                                               random_field<double, DefaultSpace>(729, 3), 1e-8);
  Solution const serial = solve<SerialSpace>({lattice_matrix<SerialSpace>(9, 0.01)},
                                             random_field<double, SerialSpace>(729, 3), 1e-8);
  CHECK(threads.report.iterations == serial.report.iterations);
  CHECK(threads.x == serial.x);
}

TEST_CASE("the linear solvers of a minimiser solve with its Hessian") {
  Chain chain({.size = 100, .pinned = 3});
  auto const x = chain.start();
  Field const b("b", chain.size()), p("p", chain.size()), hp("hp", chain.size());
  chain.gradient(x, b);

  BlockJacobi<Fp64, DefaultSpace> preconditioner;
  preconditioner.resize(chain.size());
  chain.gradient(x, b, preconditioner.curvature().blocks);
  preconditioner.update(chain, x);

  auto const check = [&](auto solver) {
    solver.start(chain);
    LinearReport const report = solver.solve(chain, x, b, preconditioner, 1e-13, p);
    CHECK(report.stop == LinearStop::converged);
    chain.product(x, p, hp);
    CHECK(relative_difference(numbers(hp), numbers(b)) < 1e-11);
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 3; ++c) CHECK(p(i, c) == 0);
  };
  check(AssembledPcg<Fp64>());
  check(MatrixFreePcg<Fp64>());
  check(Direct<Fp64>());
}

TEST_CASE("the direct solver fails on a Hessian that is singular") {
  Chain chain({.size = 10, .has_inertia = false});
  auto const x = chain.start();
  Field const b("b", 10), p("p", 10);
  Direct<Fp64> solver;
  solver.start(chain);
  CHECK(solver.solve(chain, x, b, Id(), 1e-6, p).stop == LinearStop::failed);
}
