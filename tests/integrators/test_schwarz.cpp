// The Schwarz preconditioner against its formula in dense matrices, and what it is worth.
#include "../core/sparse/samples.hpp"
#include "toy_objectives.hpp"

#include <taut/core/report/error.hpp>
#include <taut/integrators/linear_solver.hpp>
#include <taut/integrators/schwarz.hpp>

#include <Eigen/Dense>
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

/// |z - M g| / |M g|.
double difference(std::vector<double> const& z, Eigen::MatrixXd const& m,
                  VectorField<double, SerialSpace> const& g) {
  std::vector<double> const numbers_of_g = numbers(g);
  Eigen::VectorXd const expected =
      m * Eigen::Map<Eigen::VectorXd const>(numbers_of_g.data(), Eigen::Index(numbers_of_g.size()));
  Eigen::Map<Eigen::VectorXd const> const found(z.data(), Eigen::Index(z.size()));
  return (found - expected).norm() / expected.norm();
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

/// The cycle in dense matrices, level by level, with the dampings that the library found.
struct DenseLevels {
  using Matrix = Eigen::MatrixXd;
  int aggregate;
  std::vector<double> damping;
  std::vector<RunBegins> runs;  ///< of unknowns, from each level to the next

  static Matrix eigen(Dense const& a) {
    Matrix m(a.size(), a.size());
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t j = 0; j < a.size(); ++j) m(i, j) = a[i][j];
    return m;
  }
  /// Inverses of the diagonal blocks of so many rows.
  static Matrix block_inverse(Matrix const& a, int rows) {
    Matrix inverse = Matrix::Zero(a.rows(), a.cols());
    for (int first = 0; first < a.rows(); first += rows) {
      int const size = std::min<int>(rows, a.rows() - first);
      inverse.block(first, first, size, size) = a.block(first, first, size, size).inverse();
    }
    return inverse;
  }
  /// Translations and, where there are positions, rotations of unknowns that something couples to.
  static Matrix motions(Matrix const& a, VectorField<double, SerialSpace> const& x) {
    int const n = static_cast<int>(a.rows()) / 3;
    Matrix m = Matrix::Zero(3 * n, x.extent(0) > 0 ? 6 : 3);
    for (int i = 0; i < n; ++i) {
      Matrix row = a.middleRows(3 * i, 3);
      row.middleCols(3 * i, 3).setZero();
      if (row.norm() == 0) continue;
      m.block<3, 3>(3 * i, 0).setIdentity();
      if (x.extent(0) == 0) continue;
      m.block<3, 3>(3 * i, 3) << 0, x(i, 2), -x(i, 1), -x(i, 2), 0, x(i, 0), x(i, 1), -x(i, 0), 0;
    }
    return m;
  }
  /// The motions of each run, in columns of their own.
  static Matrix spread(Matrix const& motions, RunBegins const& begin) {
    int const count = static_cast<int>(motions.cols());
    Matrix q = Matrix::Zero(motions.rows(), count * (begin.size() - 1));
    for (std::size_t r = 0; r + 1 < begin.size(); ++r) {
      int const first = 3 * begin[r], rows = 3 * (begin[r + 1] - begin[r]);
      q.block(first, count * r, rows, count) = motions.middleRows(first, rows);
    }
    return q;
  }
  /// In orthonormal columns, six for each run; `motions` becomes what they are on this level.
  static Matrix orthonormal(Matrix const& q, Matrix& motions) {
    int const count = static_cast<int>(motions.cols());
    Matrix result = Matrix::Zero(q.rows(), 6 * (q.cols() / count));
    for (int k = 0; k < q.cols(); ++k) {
      // What is left of a column beside those before it.
      Matrix const before = result.middleCols(6 * (k / count), k % count);
      Eigen::VectorXd const rest = q.col(k) - before * (before.transpose() * q.col(k));
      if (rest.norm() > 1e-8 * q.col(k).norm()) {
        result.col(6 * (k / count) + k % count) = rest.normalized();
      }
    }
    motions = result.transpose() * motions;
    return result;
  }

  Matrix inverse(Matrix const& a, Matrix motions, bool multiplicative = true,
                 std::size_t level = 0) const {
    Matrix const one = Matrix::Identity(a.rows(), a.cols());
    Matrix const local = block_inverse(a, 3 * aggregate);
    Matrix const q = orthonormal(spread(motions, runs[level]), motions);
    Matrix const p = (one - 0.5 * block_inverse(a, 3) * a) * q;
    Matrix coarse = p.transpose() * a * p;
    for (int k = 0; k < coarse.rows(); ++k)
      if (p.col(k).norm() == 0) coarse(k, k) = 1;
    Matrix const solved =
        level + 1 < runs.size() ? inverse(coarse, motions, true, level + 1) : coarse.inverse();
    Matrix const correction = p * solved * p.transpose();
    if (!multiplicative) return local + correction;
    double const w = damping[level];
    return w * (local + local.transpose()) - w * w * local * a * local +
           (one - w * local * a) * correction * (one - w * a * local);
  }
};

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

  auto const precise = make<Precise<DefaultSpace>>(a, {.levels = {.aggregate = 32}});
  CHECK_FALSE(precise.levels().has_coarse_level());
  CHECK(relative_difference(applied(precise, g), exact) < 1e-10);
  auto const compact = make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 32}});
  CHECK(relative_difference(applied(compact, g), exact) < 1e-3);
}

TEST_CASE("Schwarz equals its formula") {
  int const aggregate = GENERATE(8, 16, 24, 32);
  bool const multiplicative = GENERATE(false, true), turns = GENERATE(false, true);
  auto const a = lattice_matrix<SerialSpace>(5, 0.01);  // 125 unknowns: the last aggregate is short
  SECTION("of free unknowns") {}
  SECTION("with fixed unknowns") { fix(a, {0, 7, 8, 9, 64, 124}); }
  SECTION("with a run that is fixed altogether") {
    std::vector<int> first(32);
    std::iota(first.begin(), first.end(), 0);
    fix(a, first);
  }
  auto const x =
      turns ? random_field<double, SerialSpace>(a.rows(), 5) : VectorField<double, SerialSpace>();
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  auto const schwarz = make<Precise<SerialSpace>>(
      a, {.levels = {.aggregate = aggregate, .multiplicative = multiplicative}}, x);
  CHECK(schwarz.levels().levels() == 2);
  CHECK(schwarz.levels().floored_pivots() == 0);
  DenseLevels const levels{aggregate, {schwarz.levels().damping(0)}, {equal_runs(125, 16)}};
  auto const full = DenseLevels::eigen(dense(a));
  CHECK(difference(applied(schwarz, g),
                   levels.inverse(full, DenseLevels::motions(full, x), multiplicative), g) < 1e-8);
  // Of one level it is the aggregates alone.
  auto const alone = make<Precise<SerialSpace>>(
      a, {.levels = {.aggregate = aggregate, .multiplicative = multiplicative, .max_levels = 1}},
      x);
  CHECK_FALSE(alone.levels().has_coarse_level());
  CHECK(difference(applied(alone, g), DenseLevels::block_inverse(full, 3 * aggregate), g) < 1e-8);
}

TEST_CASE("Schwarz equals its formula on three levels, with runs of one body each") {
  auto const a = lattice_matrix<SerialSpace>(6, 0.01);
  auto const x = random_field<double, SerialSpace>(a.rows(), 5);
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  Kokkos::View<int*, Kokkos::HostSpace> const body("body", a.rows());
  for (int i = 0; i < a.rows(); ++i) body(i) = i < 56 ? 0 : 1;
  Precise<SerialSpace> schwarz({.levels = {.aggregate = 16, .run = 8, .max_direct = 20}});
  for (bool const fixed : {false, true}) {
    if (fixed) fix(a, {0, 1, 2, 3, 4, 5, 6, 7, 9, 20});
    schwarz.update(a, true, x, body);
    // 56 and 160 unknowns in 7 and 20 runs of 8; these in 2 and 5 runs of up to 4.
    REQUIRE(schwarz.levels().levels() == 3);
    CHECK(schwarz.levels().unknowns(1) == 54);
    CHECK(schwarz.levels().unknowns(2) == 14);
    RunBegins runs, coarse{0, 6, 14, 22, 30, 38, 46, 54};
    for (int first = 0; first <= 216; first += 8) runs.push_back(first);
    DenseLevels const levels{
        16, {schwarz.levels().damping(0), schwarz.levels().damping(1)}, {runs, coarse}};
    auto const full = DenseLevels::eigen(dense(a));
    CHECK(difference(applied(schwarz, g), levels.inverse(full, DenseLevels::motions(full, x)), g) <
          1e-8);
  }
}

TEST_CASE("bodies of one run each are not joined: what does not touch stays apart") {
  // Two halves of a lattice, with what is between them fixed, as bodies of four unknowns.
  auto const a = lattice_matrix<SerialSpace>(8, 0.01);
  std::vector<int> between;
  for (int i = 0; i < 64; ++i) between.push_back(morton(i % 8, i / 8, 3));
  fix(a, between);
  auto const g = random_field<double, SerialSpace>(a.rows(), 2);
  Kokkos::View<int*, Kokkos::HostSpace> const body("body", a.rows());
  std::vector<bool> above(a.rows(), true);
  for (int k = 0; k <= 3; ++k)
    for (int i = 0; i < 64; ++i) above[morton(i % 8, i / 8, k)] = false;
  for (int i = 0; i < a.rows(); ++i) {
    body(i) = i / 4;
    for (int c = 0; c < 3 && above[i]; ++c) g(i, c) = 0;
  }
  int const max_direct = GENERATE(40, 70, 300);
  CAPTURE(max_direct);
  Compact<SerialSpace> schwarz({.levels = {.max_direct = max_direct}});
  schwarz.update(a, true, random_field<double, SerialSpace>(a.rows(), 5), body);
  REQUIRE(schwarz.levels().has_coarse_level());
  CHECK(schwarz.levels().levels() == 2);
  CHECK(schwarz.levels().unknowns(1) == 256);
  CHECK(schwarz.levels().smooths_last() == (max_direct == 40));
  std::vector<double> const z = applied(schwarz, g);
  CHECK(scalar_product(numbers(g), z) > 0);
  for (int i = 0; i < a.rows(); ++i)
    for (int c = 0; c < 3; ++c) CHECK((!above[i] || z[3 * i + c] == 0));
}

TEST_CASE("runs that are flat, lines or points have a coarse level all the same") {
  auto const a = lattice_matrix<DefaultSpace>(5, 0.01);
  int const dimensions = GENERATE(0, 1, 2);
  auto const x = random_field<double, DefaultSpace>(a.rows(), 5);
  for (int i = 0; i < a.rows(); ++i)
    for (int c = dimensions; c < 3; ++c) x(i, c) = dimensions > 0 ? 2 * x(i, 0) + 1 : 1;
  auto const schwarz =
      make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 16, .run = 8, .max_direct = 10}}, x);
  CHECK(schwarz.levels().has_coarse_level());
  CHECK(schwarz.levels().levels() > 2);
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
  std::vector<double> const z =
      applied(make<Compact<SerialSpace>>(a, {.levels = {.aggregate = 16}}), g);
  for (int const i : fixed)
    for (int c = 0; c < 3; ++c) CHECK(z[3 * i + c] == 0);
}

TEMPLATE_TEST_CASE("Schwarz is symmetric and positive definite", "", Precise<DefaultSpace>,
                   Compact<DefaultSpace>) {
  double const tolerance = std::is_same_v<TestType, Precise<DefaultSpace>> ? 1e-12 : 1e-5;
  for (double const mass : {10.0, 1e-8}) {
    auto const a = lattice_matrix<DefaultSpace>(6, mass);
    auto const schwarz = make<TestType>(a, {.levels = {.aggregate = 16}});
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
  auto const schwarz = make<Compact<SerialSpace>>(a, {.levels = {.aggregate = 16}});
  CHECK(schwarz.levels().floored_pivots() >= 6);
  for (unsigned seed = 0; seed < 20; ++seed) {
    auto const x = random_field<double, SerialSpace>(a.rows(), seed);
    CHECK(scalar_product(numbers(x), applied(schwarz, x)) > 0);
  }
}

TEST_CASE("of a matrix that is not positive only the aggregates are left") {
  auto const a = lattice_matrix<SerialSpace>(5, 0.1);
  for (int i = 0; i < a.rows(); ++i) a.block(a.find(i, i)) = -1.0 * a.block(a.find(i, i));
  for (bool const multiplicative : {false, true}) {
    auto const schwarz = make<Compact<SerialSpace>>(
        a, {.levels = {.aggregate = 16, .multiplicative = multiplicative}});
    CHECK_FALSE(schwarz.levels().has_coarse_level());
    CHECK(schwarz.levels().levels() == 1);
    for (unsigned seed = 0; seed < 20; ++seed) {
      auto const x = random_field<double, SerialSpace>(a.rows(), seed);
      CHECK(scalar_product(numbers(x), applied(schwarz, x)) > 0);
    }
  }
}

TEST_CASE("a body that floats without inertia keeps its coarse level") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.0);
  Compact<DefaultSpace> schwarz({.levels = {.aggregate = 16}});
  schwarz.resize(a.rows());
  for (bool const has_inertia : {true, false}) {
    schwarz.update(a, has_inertia);
    CHECK(schwarz.levels().floored_pivots() == 0);
    CHECK(schwarz.levels().has_coarse_level());
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

TEST_CASE("Schwarz is bitwise the same for every space, layout and team") {
  using Left = Space<Kokkos::Serial, Kokkos::LayoutLeft>;
  using Threads = DefaultSpace;
  auto const serial = lattice_matrix<SerialSpace>(6, 0.01);
  Compact<SerialSpace>::Params const params{.levels = {.aggregate = 16, .max_direct = 10}};
  std::vector<double> const expected =
      applied(make<Compact<SerialSpace>>(serial, params,
                                         random_field<double, SerialSpace>(serial.rows(), 9)),
              random_field<double, SerialSpace>(serial.rows(), 4));

  auto const left = make<Compact<Left>>(lattice_matrix<Left>(6, 0.01),
                                        {.levels = {.aggregate = 16, .max_direct = 10}},
                                        random_field<double, Left>(serial.rows(), 9));
  CHECK(applied(left, random_field<double, Left>(serial.rows(), 4)) == expected);

  int const largest = Threads::team_policy(1, 1).team_size_max(
      kernels::ApplyAggregate<Threads, float, double>{}, Kokkos::ParallelForTag());
  for (int team = 0; team <= largest; ++team) {
    auto const threads =
        make<Compact<Threads>>(lattice_matrix<Threads>(6, 0.01),
                               {.levels = {.aggregate = 16, .team = team, .max_direct = 10}},
                               random_field<double, Threads>(serial.rows(), 9));
    CHECK(applied(threads, random_field<double, Threads>(serial.rows(), 4)) == expected);
  }
}

TEST_CASE("Schwarz cuts the iterations of conjugate gradients") {
  auto const a = lattice_matrix<DefaultSpace>(16, 1e-3);
  int const jacobi = iterations(a, DiagonalInverse<DefaultSpace>(a));
  int const one_level =
      iterations(a, make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 32, .max_levels = 1}}));
  int const both = iterations(a, make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 32}}));
  int const additive = iterations(
      a, make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 32, .multiplicative = false}}));
  int const rigid = iterations(a, make<Compact<DefaultSpace>>(a, {.levels = {.aggregate = 32}},
                                                              lattice_points<DefaultSpace>(16)));
  CAPTURE(jacobi, one_level, additive, both, rigid);
  CHECK(1.6 * one_level < jacobi);
  CHECK(4 * additive < jacobi);
  CHECK(1.5 * both < additive);
  CHECK(rigid < 1.2 * both);  // rotations are no help in a matrix that is indifferent to them
}

TEST_CASE("Schwarz refuses aggregates that its kernels cannot hold") {
  using Method = Schwarz<Fp64, SerialSpace>;
  CHECK_THROWS_WITH(Method({.levels = {.aggregate = 12}}),
                    Catch::Matchers::ContainsSubstring("aggregates of 12 unknowns"));
}
