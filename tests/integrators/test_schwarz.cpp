// The additive Schwarz preconditioner against its formula in dense matrices, and what it is worth.
#include "../core/sparse/samples.hpp"
#include "toy_objectives.hpp"

#include <taut/core/report/error.hpp>
#include <taut/integrators/linear_solver.hpp>
#include <taut/integrators/schwarz.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <numeric>

namespace {

using namespace taut;
using namespace taut::test;

template <class S>
using Precise = Schwarz<Fp64, S, double>;
template <class S>
using Compact = Schwarz<Fp64, S, float>;

static_assert(Preconditioner<Schwarz<Mixed, DefaultSpace>, toy::Chain<toy::Barrier, Mixed>>);

template <class Method, class S>
Method make(BlockCsr<S> const& a, typename Method::Params const& params,
            VectorField<double, S> const& x = {}) {
  Method schwarz(params);
  schwarz.resize(a.rows());
  schwarz.update(a, true, x);
  return schwarz;
}

template <class Method>
std::vector<double> applied(Method const& schwarz, typename Method::Vectors const& g) {
  typename Method::Vectors const z("z", g.extent(0));
  schwarz.apply(g, z);
  return numbers(z);
}

double scalar_product(std::vector<double> const& a, std::vector<double> const& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Where the unknowns of lattice_matrix lie.
template <class S>
VectorField<double, S> lattice_points(int n) {
  VectorField<double, S> const x("lattice_points", n * n * n);
  auto const host = Kokkos::create_mirror_view(x);
  for (int i = 0; i < n * n * n; ++i) {
    host(i, 0) = i % n;
    host(i, 1) = i / n % n;
    host(i, 2) = i / (n * n);
  }
  assign(x, host);
  return x;
}

/// Coarse functions: each has a value per unknown.
using Functions = std::vector<std::vector<double>>;

/// One on each run of so many of n unknowns.
Functions constants(int n, int run) {
  Functions functions;
  for (int first = 0; first < n; first += run) {
    functions.emplace_back(n, 0.0);
    for (int i = first; i < std::min(n, first + run); ++i) functions.back()[i] = 1;
  }
  return functions;
}

/// Those of runs that move in an affine way.
Functions affine(RunBegins const& begin, VectorField<double, SerialSpace> const& x) {
  Functions functions;
  for (std::size_t r = 0; r + 1 < begin.size(); ++r)
    for (int m = 0; m < 4; ++m) {
      functions.emplace_back(begin.back(), 0.0);
      for (int i = begin[r]; i < begin[r + 1]; ++i) functions.back()[i] = m == 0 ? 1 : x(i, m - 1);
    }
  return functions;
}

/// sum_k R_k' (R_k A R_k')^-1 R_k g, with aggregates of `run` unknowns and the coarse functions.
std::vector<double> formula(BlockCsr<SerialSpace> const& a, std::vector<double> const& g, int run,
                            Functions const& functions) {
  Dense const full = dense(a);
  int const rows = 3 * a.rows();
  std::vector<double> z(g.size(), 0.0);
  for (int first = 0; first < rows; first += 3 * run) {
    int const size = std::min(3 * run, rows - first);
    Dense block(size, std::vector<double>(size));
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j) block[i][j] = full[first + i][first + j];
    auto const part = dense_solve(block, {g.begin() + first, g.begin() + first + size});
    for (int i = 0; i < size; ++i) z[first + i] += part[i];
  }
  if (functions.empty()) return z;

  auto const coupled = [&](int i) {
    for (int j = 0; j < rows; ++j)
      if (j / 3 != i / 3 && full[i][j] != 0) return true;
    return false;
  };
  int const coarse = 3 * static_cast<int>(functions.size());
  Dense r(coarse, std::vector<double>(rows, 0.0));
  for (int k = 0; k < coarse; ++k)
    for (int i = 0; i < rows; ++i)
      if (i % 3 == k % 3 && coupled(i)) r[k][i] = functions[k / 3][i / 3];
  Dense galerkin(coarse, std::vector<double>(coarse, 0.0));
  std::vector<double> restricted(coarse, 0.0);
  for (int k = 0; k < coarse; ++k) {
    restricted[k] = scalar_product(r[k], g);
    std::vector<double> ar(rows, 0.0);
    for (int i = 0; i < rows; ++i) ar[i] = scalar_product(full[i], r[k]);
    for (int l = 0; l < coarse; ++l) galerkin[k][l] = scalar_product(r[l], ar);
    if (galerkin[k][k] == 0) galerkin[k][k] = 1;  // a run that is fixed altogether
  }
  std::vector<double> const correction = dense_solve(galerkin, restricted);
  for (int k = 0; k < coarse; ++k)
    for (int i = 0; i < rows; ++i) z[i] += r[k][i] * correction[k];
  return z;
}

/// As an objective does with fixed unknowns: the rows and columns of those become the identity.
void fix(BlockCsr<SerialSpace> const& a, std::vector<int> const& unknowns) {
  auto const fixed = [&](int i) {
    return std::find(unknowns.begin(), unknowns.end(), i) != unknowns.end();
  };
  for (int i = 0; i < a.rows(); ++i)
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k)
      if (fixed(i) || fixed(a.column(k)))
        a.block(k) = (i == a.column(k) ? 1.0 : 0.0) * identity3<double>();
}

/// 3x3 block Jacobi from a matrix.
template <class S>
struct DiagonalInverse {
  LocalMatrices<Fp64, S> local;
  explicit DiagonalInverse(BlockCsr<S> const& a) {
    local.blocks = BlockField<double, S>("blocks", a.rows());
    diagonal_blocks(a, local.blocks);
    for_each<S>("invert", a.rows(), kernels::InvertBlocks<Fp64, S>{local.blocks, 1e-12, 0});
  }
  void apply(VectorField<double, S> const& g, VectorField<double, S> const& z) const {
    for_each<S>("apply", int(g.extent(0)), kernels::ApplyLocal<Fp64, S>{local, g, z});
  }
};

template <class S, class M>
int iterations(BlockCsr<S> const& a, M const& preconditioner) {
  ConjugateGradients<Fp64, S> cg;
  cg.resize(a.rows());
  auto const b = random_field<double, S>(a.rows(), 11);
  VectorField<double, S> const x("x", a.rows());
  auto const by_a = [&](auto const& d, auto const& ad) { product(a, d, ad); };
  LinearReport const report = cg.solve(by_a, preconditioner, b, 1e-8, 5000, x);
  REQUIRE(report.stop == LinearStop::converged);
  return report.iterations;
}

}  // namespace

TEST_CASE("one aggregate that covers everything is the inverse") {
  auto const a = lattice_matrix<DefaultSpace>(3, 0.01);
  auto const g = random_field<double, DefaultSpace>(a.rows(), 2);
  std::vector<double> exact = numbers(g);
  DirectSolver solver;
  REQUIRE(solver.factorize(a) == Definiteness::positive);
  solver.solve(exact, exact);

  auto const precise = make<Precise<DefaultSpace>>(a, {.aggregate = 32});
  CHECK_FALSE(precise.has_coarse_level());
  CHECK(relative_difference(applied(precise, g), exact) < 1e-10);
  auto const compact = make<Compact<DefaultSpace>>(a, {.aggregate = 32});
  CHECK(relative_difference(applied(compact, g), exact) < 1e-3);
}

TEST_CASE("additive Schwarz equals its formula") {
  int const run = GENERATE(8, 16, 24, 32);
  auto const a = lattice_matrix<SerialSpace>(5, 0.01);  // 125 unknowns: the last aggregate is short
  SECTION("of free unknowns") {}
  SECTION("with fixed unknowns") { fix(a, {0, 7, 8, 9, 64, 124}); }
  SECTION("with an aggregate that is fixed altogether") {
    std::vector<int> first(32);
    std::iota(first.begin(), first.end(), 0);
    fix(a, first);
  }
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  int const aggregates = (a.rows() + run - 1) / run;
  for (int const max_coarse : {0, 2, 1024}) {
    auto const schwarz =
        make<Precise<SerialSpace>>(a, {.aggregate = run, .max_coarse = max_coarse});
    int const coarse_run = max_coarse > 0 ? run * ((aggregates + max_coarse - 1) / max_coarse) : 0;
    CHECK(schwarz.has_coarse_level() == (max_coarse > 0));
    CHECK(schwarz.floored_pivots() == 0);
    Functions const functions = coarse_run > 0 ? constants(a.rows(), coarse_run) : Functions();
    CHECK(relative_difference(applied(schwarz, g), formula(a, numbers(g), run, functions)) < 1e-8);
  }
}

TEST_CASE("with positions, runs of one body each move in an affine way") {
  auto const a = lattice_matrix<SerialSpace>(5, 0.01);
  fix(a, {0, 7, 8, 9, 64, 124});
  auto const x = random_field<double, SerialSpace>(a.rows(), 5);
  Kokkos::View<int*, Kokkos::HostSpace> const body("body", a.rows());
  for (int i = 0; i < a.rows(); ++i) body(i) = i < 50 ? 0 : 1;
  Precise<SerialSpace> schwarz({.aggregate = 16, .run = 30});
  schwarz.resize(a.rows());
  schwarz.update(a, true, x, body);
  REQUIRE(schwarz.has_coarse_level());
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  CHECK(relative_difference(applied(schwarz, g),
                            formula(a, numbers(g), 16, affine({0, 25, 50, 75, 100, 125}, x))) <
        1e-8);
  // Unknowns that are fixed later leave the level.
  std::vector<int> first(25);
  std::iota(first.begin(), first.end(), 0);
  fix(a, first);
  schwarz.update(a, true, x, body);
  CHECK(relative_difference(applied(schwarz, g),
                            formula(a, numbers(g), 16, affine({0, 25, 50, 75, 100, 125}, x))) <
        1e-8);
  // As many functions as asked for: 4 of each of two runs.
  auto const coarser =
      make<Precise<SerialSpace>>(a, {.aggregate = 16, .max_coarse = 8, .run = 30}, x);
  CHECK(relative_difference(applied(coarser, g),
                            formula(a, numbers(g), 16, affine({0, 63, 125}, x))) < 1e-8);
}

TEST_CASE("runs that are flat, lines or points have a coarse level all the same") {
  auto const a = lattice_matrix<DefaultSpace>(5, 0.01);
  int const dimensions = GENERATE(0, 1, 2);
  auto const x = random_field<double, DefaultSpace>(a.rows(), 5);
  for (int i = 0; i < a.rows(); ++i)
    for (int c = dimensions; c < 3; ++c) x(i, c) = dimensions > 0 ? 2 * x(i, 0) + 1 : 1;
  auto const schwarz = make<Compact<DefaultSpace>>(a, {.aggregate = 16, .run = 16}, x);
  CHECK(schwarz.has_coarse_level());
  for (unsigned seed = 0; seed < 20; ++seed) {
    auto const g = random_field<double, DefaultSpace>(a.rows(), seed);
    std::vector<double> const z = applied(schwarz, g);
    CHECK(scalar_product(numbers(g), z) > 0);
    for (double const v : z) CHECK(std::isfinite(v));
  }
}

TEST_CASE("runs keep to bodies, and those of a body are about as long") {
  CHECK(equal_runs(10, 4) == RunBegins{0, 4, 8, 10});
  std::vector<int> of(10, 3);
  of[9] = 1;
  CHECK(runs_of_bodies(of, 4) == RunBegins{0, 3, 6, 9, 10});
  CHECK(runs_of_bodies(of, 100) == RunBegins{0, 9, 10});
  CHECK(runs_of_bodies({}, 4) == RunBegins{0});
}

TEST_CASE("fixed unknowns with zero gradient do not move") {
  std::vector<int> const fixed{0, 7, 8, 9, 64, 124};
  auto const a = lattice_matrix<SerialSpace>(5, 0.01);
  fix(a, fixed);
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  for (int const i : fixed)
    for (int c = 0; c < 3; ++c) g(i, c) = 0;
  std::vector<double> const z = applied(make<Compact<SerialSpace>>(a, {.aggregate = 16}), g);
  for (int const i : fixed)
    for (int c = 0; c < 3; ++c) CHECK(z[3 * i + c] == 0);
}

TEMPLATE_TEST_CASE("additive Schwarz is symmetric and positive definite", "", Precise<DefaultSpace>,
                   Compact<DefaultSpace>) {
  double const tolerance = std::is_same_v<TestType, Precise<DefaultSpace>> ? 1e-12 : 1e-5;
  for (double const mass : {10.0, 1e-8}) {
    auto const a = lattice_matrix<DefaultSpace>(6, mass);
    auto const schwarz = make<TestType>(a, {.aggregate = 16});
    for (unsigned seed = 0; seed < 20; ++seed) {
      auto const x = random_field<double, DefaultSpace>(a.rows(), 2 * seed);
      auto const y = random_field<double, DefaultSpace>(a.rows(), 2 * seed + 1);
      std::vector<double> const px = applied(schwarz, x), py = applied(schwarz, y);
      double const xx = scalar_product(numbers(x), px), yy = scalar_product(numbers(y), py);
      CHECK(xx > 0);
      CHECK(yy > 0);
      double const difference = scalar_product(numbers(x), py) - scalar_product(numbers(y), px);
      CHECK(std::abs(difference) < tolerance * std::sqrt(xx * yy));
    }
  }
}

TEST_CASE("a local block that is not positive definite has its pivots replaced") {
  auto const a = lattice_matrix<SerialSpace>(4, 0.1);
  a.block(a.find(5, 5)) = -3.0 * identity3<double>();
  a.block(a.find(40, 40)) = 0.0 * identity3<double>();
  auto const schwarz = make<Compact<SerialSpace>>(a, {.aggregate = 16});
  CHECK(schwarz.floored_pivots() >= 6);
  for (unsigned seed = 0; seed < 20; ++seed) {
    auto const x = random_field<double, SerialSpace>(a.rows(), seed);
    CHECK(scalar_product(numbers(x), applied(schwarz, x)) > 0);
  }
}

TEST_CASE("a body that floats without inertia keeps its coarse level") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.0);
  Compact<DefaultSpace> schwarz({.aggregate = 16});
  schwarz.resize(a.rows());
  for (bool const has_inertia : {true, false}) {
    schwarz.update(a, has_inertia);
    CHECK(schwarz.floored_pivots() == 0);
    CHECK(schwarz.has_coarse_level());
  }
  // Without inertia a force of round-off size on the body as a whole must not make it fly.
  auto const g = random_field<double, DefaultSpace>(a.rows(), 2);
  double sum[3] = {};
  for (int i = 0; i < a.rows(); ++i)
    for (int c = 0; c < 3; ++c) sum[c] += g(i, c);
  for (int i = 0; i < a.rows(); ++i)
    for (int c = 0; c < 3; ++c) g(i, c) -= sum[c] / a.rows() * (1 - 1e-7);
  for (double const z : applied(schwarz, g)) CHECK(std::abs(z) < 10);
}

TEST_CASE("additive Schwarz is bitwise the same for every space, layout and team") {
  using Left = Space<Kokkos::Serial, Kokkos::LayoutLeft>;
  using Threads = DefaultSpace;
  auto const serial = lattice_matrix<SerialSpace>(6, 0.01);
  Compact<SerialSpace>::Params const params{.aggregate = 16, .run = 64};
  std::vector<double> const expected =
      applied(make<Compact<SerialSpace>>(serial, params,
                                         random_field<double, SerialSpace>(serial.rows(), 9)),
              random_field<double, SerialSpace>(serial.rows(), 4));

  auto const left = make<Compact<Left>>(lattice_matrix<Left>(6, 0.01), {.aggregate = 16, .run = 64},
                                        random_field<double, Left>(serial.rows(), 9));
  CHECK(applied(left, random_field<double, Left>(serial.rows(), 4)) == expected);

  int const largest = Threads::team_policy(1, 1).team_size_max(
      kernels::ApplyAggregate<Threads, float, double>{}, Kokkos::ParallelForTag());
  for (int team = 0; team <= largest; ++team) {
    auto const threads = make<Compact<Threads>>(lattice_matrix<Threads>(6, 0.01),
                                                {.aggregate = 16, .run = 64, .team = team},
                                                random_field<double, Threads>(serial.rows(), 9));
    CHECK(applied(threads, random_field<double, Threads>(serial.rows(), 4)) == expected);
  }
}

TEST_CASE("additive Schwarz cuts the iterations of conjugate gradients") {
  auto const a = lattice_matrix<DefaultSpace>(16, 1e-3);
  int const jacobi = iterations(a, DiagonalInverse<DefaultSpace>(a));
  int const one_level =
      iterations(a, make<Compact<DefaultSpace>>(a, {.aggregate = 32, .max_coarse = 0}));
  int const both = iterations(a, make<Compact<DefaultSpace>>(a, {.aggregate = 32}));
  int const long_runs = iterations(
      a, make<Compact<DefaultSpace>>(a, {.aggregate = 32}, lattice_points<DefaultSpace>(16)));
  CAPTURE(jacobi, one_level, both, long_runs);
  CHECK(1.6 * one_level < jacobi);
  CHECK(4 * both < jacobi);
  CHECK(long_runs < 1.2 * both);  // as many functions
}

TEST_CASE("additive Schwarz refuses aggregates that its kernels cannot hold") {
  Schwarz<Fp64, SerialSpace> schwarz({.aggregate = 12});
  CHECK_THROWS_WITH(schwarz.resize(100),
                    Catch::Matchers::ContainsSubstring("aggregates of 12 unknowns"));
}
