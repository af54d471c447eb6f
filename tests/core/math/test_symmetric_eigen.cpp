// Symmetric eigenvalue problems of size 3, 4, 9 and 12 against Eigen's solver, and the projection
// onto positive semi-definite matrices.
#include "samples.hpp"

#include <taut/core/math/psd_projection.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::test;

namespace {

enum class Spectrum { random, rank_one, plus_minus, equal, clustered, graded, zero };
constexpr Spectrum spectra[] = {Spectrum::random, Spectrum::rank_one,  Spectrum::plus_minus,
                                Spectrum::equal,  Spectrum::clustered, Spectrum::graded,
                                Spectrum::zero};

double eigenvalue(Random& random, Spectrum spectrum, int k) {
  double const u = uniform(random, -1, 1);
  switch (spectrum) {
    case Spectrum::random:
      return u;
    case Spectrum::rank_one:
      return k == 0 ? u : 0;
    case Spectrum::plus_minus:
      return k % 2 == 0 ? 1 : -1;
    case Spectrum::equal:
      return 1;
    case Spectrum::clustered:
      return 1 + 1e-6 * u;
    case Spectrum::graded:
      return std::copysign(log_uniform(random, 1e-12, 1), u);
    case Spectrum::zero:
      break;
  }
  return 0;
}

// Of size 1, extreme and 1/extreme in turn.
double scale_of(int repeat, double extreme) {
  return repeat % 3 == 0 ? 1 : repeat % 3 == 1 ? extreme : 1 / extreme;
}

using WideMatrix = std::vector<long double>;  // n x n, column after column

long double norm(WideMatrix const& m) {
  long double sum = 0;
  for (long double entry : m) sum += entry * entry;
  return std::sqrt(sum);
}

// |V diag(values) V^T - A|
long double residual(int n, WideMatrix const& V, WideMatrix const& values, WideMatrix A) {
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) A[i + n * j] -= V[i + n * k] * values[k] * V[j + n * k];
  return norm(A);
}

// |V^T V - I|
long double orthogonality(int n, WideMatrix const& V) {
  WideMatrix m(V.size());
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      m[i + n * j] = i == j ? -1 : 0;
      for (int k = 0; k < n; ++k) m[i + n * j] += V[k + n * i] * V[k + n * j];
    }
  return norm(m);
}

// With random eigenvectors: those of a random symmetric matrix.
WideMatrix symmetric_sample(Random& random, Spectrum spectrum, int n) {
  WideMatrix m(n * n), sample(n * n, 0);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i <= j; ++i) m[i + n * j] = m[j + n * i] = uniform(random, -1, 1);
  WideMatrix const V = eigen_symmetric(m, n).vectors;
  for (int k = 0; k < n; ++k) {
    long double const value = eigenvalue(random, spectrum, k);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) sample[i + n * j] += V[i + n * k] * value * V[j + n * k];
  }
  return sample;
}

template <class Real, int N>
WideMatrix wide(SquareMatrix<Real, N> const& m, long double scale = 1) {
  WideMatrix r(N * N);
  for (int k = 0; k < N * N; ++k) r[k] = scale * m.a[k];
  return r;
}

template <class Real, int N>
void check_square() {
  Random random(N);
  Worst orthogonal, product, values, projection, floored;
  for (int repeat = 0; repeat < some / 4; ++repeat) {
    double const scale = scale_of(repeat, extreme_size<Real>);
    WideMatrix const sample = symmetric_sample(random, spectra[repeat % std::size(spectra)], N);
    SquareMatrix<Real, N> a;
    for (int k = 0; k < N * N; ++k) a.a[k] = static_cast<Real>(scale * sample[k]);
    long double const inverse = norm(sample) > 0 ? 1 / (scale * norm(sample)) : 1;
    WideMatrix const A = wide(a, inverse);

    SquareEigen<Real, N> const e = symmetric_eigen(a);
    WideMatrix const V = wide(e.vectors);
    WideMatrix d(N);
    for (int k = 0; k < N; ++k) d[k] = inverse * e.values[k];
    orthogonal.see(orthogonality(N, V));
    product.see(residual(N, V, d, A));
    std::sort(d.begin(), d.end());
    SymmetricReference const eigen = eigen_symmetric(A, N);
    for (int k = 0; k < N; ++k) values.see(d[k] - eigen.values[k]);

    WideMatrix clamped = eigen.values;
    for (long double& value : clamped) value = std::max(value, 0.0L);
    projection.see(residual(N, eigen.vectors, clamped, wide(project_psd(a), inverse)));
    Real const floor = static_cast<Real>(0.125L / inverse);
    for (long double& value : clamped) value = std::max(value, inverse * floor);
    // Sorted like the reference: the floor raises values without reordering them.
    SymmetricReference const raised = eigen_symmetric(wide(project_psd(a, floor), inverse), N);
    for (int k = 0; k < N; ++k) {
      floored.see(raised.values[k] - std::max(eigen.values[k], inverse * floor));
    }
  }
  INFO("N = " << N);
  CHECK(orthogonal.value() < 16 * N * epsilon<Real>);
  CHECK(product.value() < 8 * N * epsilon<Real>);
  CHECK(values.value() < 4 * N * epsilon<Real>);
  CHECK(projection.value() < 8 * N * epsilon<Real>);
  CHECK(floored.value() < 8 * N * epsilon<Real>);
}

}  // namespace

TEMPLATE_TEST_CASE("symmetric 3x3 matrices: eigenvalues, eigenvectors and projection", "[math]",
                   float, double, HostPack<float>, HostPack<double>) {
  using T = TestType;
  constexpr int lanes = ScalarTraits<T>::lanes;
  Random random(2);
  for (Spectrum const spectrum : spectra) {
    Worst orthogonal, proper, product, values, unsorted, projection;
    for (int drawn = 0; drawn < 4 * some; drawn += lanes) {
      double const scale = scale_of(drawn / lanes, extreme_size<T>);
      Mat3<T> sample;
      for (T& entry : sample.a) entry = T(0);
      for (int i = 0; i < lanes; ++i) {
        WideMatrix const m = symmetric_sample(random, spectrum, 3);
        for (int k = 0; k < 9; ++k) {
          set_lane(sample.a[k], i, scale * static_cast<double>(m[k]));
        }
      }
      Sym3<T> const a = symmetric_part(sample);
      SymmetricEigen<T> const e = symmetric_eigen(a);
      Mat3<T> const matrix = to_matrix(a), projected = to_matrix(project_psd(a));
      for (int i = 0; i < lanes; ++i) {
        Wide const A = (1 / size(test::wide(matrix, i))) * test::wide(matrix, i);
        Wide const V = test::wide(e.vectors, i);
        Vec3<long double> const d = (1 / size(test::wide(matrix, i))) * test::wide(e.values, i);
        orthogonal.see(test::orthogonality(V));
        proper.see(determinant(V) - 1);
        product.see(frobenius(compose(V, d, V) - A));
        unsorted.see(d[0] >= d[1] && d[1] >= d[2] ? 0 : 1);
        SymmetricReference const eigen = eigen_symmetric(A.a, 3);
        Vec3<long double> clamped;
        Wide W;
        for (int k = 0; k < 3; ++k) {
          values.see(d[k] - eigen.values[2 - k]);
          clamped[k] = std::max(eigen.values[k], 0.0L);
        }
        std::copy(eigen.vectors.begin(), eigen.vectors.end(), W.a);
        Wide const P = (1 / size(test::wide(matrix, i))) * test::wide(projected, i);
        projection.see(frobenius(P - compose(W, clamped, W)));
      }
    }
    INFO("spectrum " << static_cast<int>(spectrum));
    CHECK(orthogonal.value() < 24 * epsilon<T>);
    CHECK(proper.value() < 24 * epsilon<T>);
    CHECK(product.value() < 24 * epsilon<T>);
    CHECK(values.value() < 16 * epsilon<T>);
    CHECK(unsorted.value() == 0);
    CHECK(projection.value() < 24 * epsilon<T>);
  }
}

TEMPLATE_TEST_CASE("symmetric matrices of other sizes", "[math]", float, double) {
  check_square<TestType, 4>();
  check_square<TestType, 9>();
  check_square<TestType, 12>();
}

namespace {

/// How far a decomposition and a projection are from what they should be, without a reference.
struct Errors {
  Worst orthogonal, product, projection;
  template <class Real, int N>
  void see(SquareMatrix<Real, N> const& a) {
    SquareEigen<Real, N> const e = symmetric_eigen(a);
    SquareMatrix<Real, N> const p = project_psd(a);
    // Real is float, or the entries are fp64 and so are the errors of this check.
    auto const unit = [](int i, int j) { return i == j ? 1.0 : 0.0; };
    for (int j = 0; j < N; ++j)
      for (int i = 0; i <= j; ++i) {
        double dots = -unit(i, j), sum = -double(a(i, j)), raised = -double(p(i, j));
        for (int k = 0; k < N; ++k) {
          double const v = double(e.vectors(i, k)) * double(e.vectors(j, k));
          dots += double(e.vectors(k, i)) * double(e.vectors(k, j));
          sum += double(e.values[k]) * v;
          raised += std::max(double(e.values[k]), 0.0) * v;
        }
        orthogonal.see(dots);
        product.see(sum);
        projection.see(raised);
      }
  }
};

template <class Real, int N>
void check_many(int count) {
  Random random(40 + N);
  Errors errors;
  std::uniform_real_distribution<Real> uniform(-1, 1);
  for (int repeat = 0; repeat < count; ++repeat) {
    SquareMatrix<Real, N> a;
    for (int j = 0; j < N; ++j)
      for (int i = 0; i <= j; ++i) a(i, j) = a(j, i) = uniform(random);
    errors.see(a);
  }
  INFO("N = " << N);
  CHECK(errors.orthogonal.value() < 4 * N * epsilon<Real>);
  CHECK(errors.product.value() < 4 * N * epsilon<Real>);
  CHECK(errors.projection.value() < 6 * N * epsilon<Real>);
}

template <class Real, int N>
SquareMatrix<Real, N> diagonal_matrix(double const (&entries)[N]) {
  SquareMatrix<Real, N> a{};
  for (int k = 0; k < N; ++k) a(k, k) = static_cast<Real>(entries[k]);
  return a;
}

/// The reflection I - 2 u u' with u = (1, 2, ..., N) / |.|, a dense orthogonal matrix, applied from
/// both sides.
template <class Real, int N>
SquareMatrix<Real, N> turned(SquareMatrix<Real, N> const& a) {
  double norm2 = 0;
  for (int k = 1; k <= N; ++k) norm2 += k * k;
  auto const q = [&](int i, int j) { return (i == j) - 2.0 * (i + 1) * (j + 1) / norm2; };
  SquareMatrix<Real, N> r;
  for (int j = 0; j < N; ++j)
    for (int i = 0; i < N; ++i) {
      double sum = 0;
      for (int k = 0; k < N; ++k) sum += q(i, k) * double(a(k, k)) * q(j, k);
      r(i, j) = static_cast<Real>(sum);
    }
  return r;
}

}  // namespace

TEMPLATE_TEST_CASE("a million random symmetric matrices", "[math]", float, double) {
  check_many<TestType, 3>(2 * many);
  check_many<TestType, 9>(many / 25);
  check_many<TestType, 12>(many / 50);
}

TEMPLATE_TEST_CASE("a projection is positive where a negative eigenvalue dwarfs the others",
                   "[math]", float, double) {
  using Real = TestType;
  for (double dwarf : {1e3, 1e8, 1e20, 1e30}) {
    // Also at the matrix's scale nothing of the dwarf is left but the rounding of the eigenvectors.
    double const entries[3] = {1, 2, -dwarf};
    SquareMatrix<Real, 3> const a = turned(diagonal_matrix<Real, 3>(entries));
    Sym3<Real> const p =
        project_psd(Sym3<Real>{{a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(1, 2), a(0, 2)}});
    SymmetricEigen<Real> const e = symmetric_eigen(p);
    CHECK(e.values[2] >= -32 * epsilon<Real> * e.values[0]);
    CHECK(e.values[0] <= 3 + 32 * epsilon<Real> * dwarf);

    double const nine[9] = {1, 2, -dwarf, 3, -1, 0, 5, -dwarf, 2};
    SquareEigen<Real, 9> const f =
        symmetric_eigen(project_psd(turned(diagonal_matrix<Real, 9>(nine))));
    Real smallest = f.values[0], largest = f.values[0];
    for (Real value : f.values) {
      smallest = std::min(smallest, value);
      largest = std::max(largest, value);
    }
    CHECK(smallest >= -32 * epsilon<Real> * largest);
    CHECK(largest <= 6 + 64 * epsilon<Real> * dwarf);
  }
  // All negative: nothing is left.
  Sym3<Real> const none = project_psd(Sym3<Real>{{-1, -2, -3, Real(0.5), 0, 0}});
  for (Real entry : none.s) CHECK(std::abs(entry) <= 8 * epsilon<Real>);
}

TEST_CASE("a positive semi-definite matrix is projected onto itself, to the bit", "[math]") {
  Random random(4);
  for (int repeat = 0; repeat < some / 4; ++repeat) {
    SquareMatrix<double, 9> g, a;
    for (double& entry : g.a) entry = uniform(random, -1, 1);
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i) {
        a(i, j) = i == j ? 0.1 : 0;
        for (int k = 0; k < 9; ++k) a(i, j) += g(i, k) * g(j, k);
      }
    SquareMatrix<double, 9> const p = project_psd(a);
    if (!std::equal(a.a, a.a + 81, p.a)) FAIL(repeat);
    Sym3<double> const b = {{a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(1, 2), a(0, 2)}};
    Sym3<double> const q = project_psd(b);
    if (!std::equal(b.s, b.s + 6, q.s)) FAIL(repeat);
  }
}

TEST_CASE("compose gives functions of a matrix", "[math]") {
  Random random(8);
  for (int repeat = 0; repeat < some; ++repeat) {
    Mat3<double> const g = uniform_matrix(random), spd = g * transpose(g);
    SymmetricEigen<double> e = symmetric_eigen(symmetric_part(spd));
    for (int k = 0; k < 3; ++k) e.values[k] = std::sqrt(std::max(e.values[k], 0.0));
    Mat3<double> const root = to_matrix(e.compose());
    double const error = frobenius(root * root - spd);
    if (!(error < 1e-14 * frobenius(spd))) FAIL(repeat << ": " << error);
  }
}

TEMPLATE_TEST_CASE("eigenvalue sweeps end on NaN", "[math]", float, double, HostPack<float>) {
  using T = TestType;
  Sym3<T> a = {{T(1), T(2), T(3), T(0.5), T(0.25), T(0.125)}};
  set_lane(a.s[3], 0, std::nan(""));
  SymmetricEigen<T> const e = symmetric_eigen(a);
  CHECK(std::isnan(lane(e.vectors(0, 0), 0)));
  if (ScalarTraits<T>::lanes > 1) CHECK(!std::isnan(lane(e.vectors(0, 0), 1)));
}
