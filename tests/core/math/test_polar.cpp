// The polar decomposition and its derivative: orthogonality, symmetry and nearness for every kind
// of F, in scalars and in packs.
#include "samples.hpp"

#include <taut/core/math/svd.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

using namespace taut;
using namespace taut::test;

namespace {

// R is the nearest rotation if and only if S = R^T F is symmetric and G = tr(S) I - S is positive
// semi-definite: the pivots of its LDL^T factorisation say so.
bool is_nearest(Wide const& S, long double tolerance) {
  Wide const G = trace(S) * identity3<long double>() - 0.5L * (S + transpose(S));
  long double const d0 = G(0, 0) + tolerance, l1 = G(1, 0) / d0, l2 = G(2, 0) / d0;
  long double const d1 = G(1, 1) + tolerance - l1 * G(1, 0), e = G(2, 1) - l2 * G(1, 0);
  return d0 > 0 && d1 > 0 && G(2, 2) + tolerance - l2 * G(2, 0) - e * e / d1 > 0;
}

Mat3<double> cross_matrix(Vec3<double> const& w) {
  return {{0, w[2], -w[1], -w[2], 0, w[0], w[1], -w[0], 0}};
}

// dR for dF through the gradient's inverse.
Mat3<double> rotation_change(Mat3<double> const& F, Mat3<double> const& dF) {
  Mat3<double> const R = polar_rotation(F);
  Sym3<double> const G_inverse = rotation_gradient(transpose_times(R, F));
  return R * cross_matrix(G_inverse * axial(transpose_times(R, dF)));
}

}  // namespace

TEMPLATE_TEST_CASE("polar_rotation gives the nearest rotation of every matrix", "[math]", float,
                   double, HostPack<float>, HostPack<double>) {
  using T = TestType;
  for (Family const& family : deformations(extreme_size<T>)) {
    Worst orthogonal, proper, asymmetry, far;
    draw_packs<T>(family, family.name == "random" ? many : some, [&](Mat3<T> const& packs) {
      Mat3<T> const rotations = polar_rotation(packs);
      for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
        Wide const F = wide(packs, i), R = wide(rotations, i), S = transpose_times(R, F);
        orthogonal.see(orthogonality(R));
        proper.see(determinant(R) - 1);
        asymmetry.see(frobenius(S - transpose(S)) / size(F));
        far.see(is_nearest(S, 8 * epsilon<T> * size(F)) ? 0 : 1);
      }
    });
    INFO(family.name);
    CHECK(orthogonal.value() < 16 * epsilon<T>);
    CHECK(proper.value() < 16 * epsilon<T>);
    CHECK(asymmetry.value() < 12 * epsilon<T>);
    CHECK(far.value() == 0);
  }
}

TEMPLATE_TEST_CASE("polar_rotation agrees with Eigen's singular value decomposition", "[math]",
                   float, double, HostPack<float>, HostPack<double>) {
  using T = TestType;
  for (Family const& family : deformations(extreme_size<T>)) {
    Worst stretch, rotation;
    draw_packs<T>(family, some, [&](Mat3<T> const& packs) {
      Mat3<T> const rotations = polar_rotation(packs);
      for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
        Wide const F = (1 / size(wide(packs, i))) * wide(packs, i), R = wide(rotations, i);
        Mat3<double> unit;
        for (int k = 0; k < 9; ++k) unit.a[k] = static_cast<double>(F.a[k]);
        Reference const e = eigen_svd(unit);
        stretch.see(contract(R, F) - (e.s[0] + e.s[1] + e.s[2]));
        rotation.see(frobenius(R - wide(e.R, 0)) * (e.s[1] + e.s[2]));
      }
    });
    INFO(family.name);
    CHECK(stretch.value() < 24 * epsilon<T>);
    CHECK(rotation.value() < 24 * epsilon<T>);  // |dR| (s1 + s2) / |F|
  }
}

TEMPLATE_TEST_CASE("a lane's rotation does not depend on its neighbours", "[math]", HostPack<float>,
                   HostPack<double>) {
  using T = TestType;
  Random random(3);
  auto const families = deformations(extreme_size<T>);
  for (int repeat = 0; repeat < some; ++repeat) {
    Mat3<T> mixed, alone;
    for (T& entry : mixed.a) entry = T(0);
    for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
      set_lane(mixed, i, families[random() % families.size()].draw(random));
    }
    int const chosen = static_cast<int>(random() % ScalarTraits<T>::lanes);
    for (int k = 0; k < 9; ++k) alone.a[k] = T(lane(mixed.a[k], chosen));
    Svd<T> const of_mixed = svd(mixed), of_alone = svd(alone);
    bool same = true;
    for (int k = 0; k < 9; ++k) {
      same = same && lane(of_mixed.U.a[k], chosen) == lane(of_alone.U.a[k], 0) &&
             lane(of_mixed.V.a[k], chosen) == lane(of_alone.V.a[k], 0);
    }
    if (!same) FAIL("lane " << chosen << " of pack " << repeat);
  }
}

TEMPLATE_TEST_CASE("NaN and infinity end in NaN, in their own lane", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  constexpr int lanes = ScalarTraits<T>::lanes;
  for (double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (int k = 0; k < 9; ++k) {
      Mat3<T> F = identity3<T>();
      set_lane(F.a[k], lanes - 1, bad);
      Svd<T> const f = svd(F);
      Mat3<T> const R = polar_rotation(F);
      CHECK(std::isnan(lane(R.a[0], lanes - 1)));
      CHECK(std::isnan(lane(f.U.a[0], lanes - 1)));
      if (lanes > 1) {
        CHECK(lane(R.a[0], 0) == 1);
        CHECK(lane(f.s[0], 0) == 1);
      }
    }
  }
}

TEST_CASE("the rotation's derivative agrees with finite differences", "[math]") {
  Random random(5);
  for (int repeat = 0; repeat < some; ++repeat) {
    // s1 + s2 >= 0.3, also for inverted F
    double const s1 = uniform(random, 0.5, 1.5);
    Mat3<double> const F =
        with_stretches(random, uniform(random, s1, 3), s1, uniform(random, 0.3 - s1, s1));
    Mat3<double> const dF = uniform_matrix(random), dR = rotation_change(F, dF);
    auto const error = [&](double h) {
      Mat3<double> const difference = polar_rotation(F + h * dF) - polar_rotation(F - h * dF);
      return frobenius((1 / (2 * h)) * difference - dR);
    };
    double const coarse = error(2e-3), fine = error(1e-3);
    if (!(error(1e-5) < 1e-7)) FAIL(repeat << ": " << error(1e-5));
    // second order
    if (coarse > 1e-6 && !(std::abs(coarse / fine - 4) < 0.1))
      FAIL(repeat << ": " << coarse / fine);
  }
}

TEST_CASE("dF : dR is the sum over the twist modes", "[math]") {
  Random random(6);
  for (int repeat = 0; repeat < some; ++repeat) {
    Mat3<double> const F = uniform_matrix(random), dF = uniform_matrix(random);
    Svd<double> const f = svd(F);
    if (f.s[1] + f.s[2] < 0.05) continue;
    Mat3<double> const M = transpose_times(f.U, dF) * f.V;
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      sum += square(M(j, i) - M(i, j)) / (f.s[i] + f.s[j]);
    }
    Mat3<double> const R = polar_rotation(F);
    Sym3<double> const G_inverse = rotation_gradient(transpose_times(R, F));
    double const form = quadratic(G_inverse, axial(transpose_times(R, dF)));
    if (!(std::abs(form - sum) < 1e-12 * sum)) FAIL(repeat << ": " << form << ", not " << sum);
    double const product = contract(dF, rotation_change(F, dF));
    if (!(std::abs(product - sum) < 1e-12 * sum))
      FAIL(repeat << ": " << product << ", not " << sum);
  }
}

TEMPLATE_TEST_CASE("the rotation's derivative is bounded and positive definite for every matrix",
                   "[math]", float, double, HostPack<float>, HostPack<double>) {
  using T = TestType;
  for (Family const& family : deformations(1)) {
    Worst indefinite, bound, inverse;
    draw_packs<T>(family, some, [&](Mat3<T> const& packs) {
      Mat3<T> const S = transpose_times(polar_rotation(packs), packs);
      Mat3<T> const inverses = to_matrix(rotation_gradient(S));
      for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
        Wide const W = wide(inverses, i), s = wide(S, i);
        std::vector<long double> const eigenvalues = eigen_symmetric(W.a, 3).values;
        indefinite.see(std::min(0.0L, eigenvalues[0] / eigenvalues[2]));
        long double const size = 1 + trace(s);
        bound.see(eigenvalues[2] * epsilon<T> * size);
        // G W = I up to the shift of G by 32 epsilon (1 + tr S) and to rounding.
        Wide const G = trace(s) * identity3<long double>() - 0.5L * (s + transpose(s));
        inverse.see(frobenius(G * W - identity3<long double>()) / (size * frobenius(W)));
      }
    });
    INFO(family.name);
    CHECK(indefinite.value() < 4 * epsilon<T>);
    CHECK(bound.value() < 1.0 / 16);
    CHECK(inverse.value() < 64 * epsilon<T>);
  }
}

TEMPLATE_TEST_CASE("sums of stretches are at least their floor, and themselves above it", "[math]",
                   float, double) {
  using T = TestType;
  T const eps = static_cast<T>(epsilon<T>);
  CHECK(floored_sum(T(0.5), T(0.25), Vec3<T>{{1, T(0.5), T(0.25)}}) == T(0.75));
  CHECK(floored_sum(T(0), T(0), Vec3<T>{{0, 0, 0}}) == 32 * eps);
  CHECK(floored_sum(T(1), T(-1), Vec3<T>{{3, 1, -1}}) == 128 * eps);
  // A point of an element: its inverse is that of the floor.
  Sym3<T> const inverse = rotation_gradient(Mat3<T>{});
  for (int k = 0; k < 6; ++k) CHECK(inverse.s[k] == (k < 3 ? 1 / (32 * eps) : T(0)));
}

TEMPLATE_TEST_CASE("stretch_sum is the trace of S", "[math]", float, double, HostPack<float>,
                   HostPack<double>) {
  using T = TestType;
  for (Family const& family : deformations(std::is_same_v<ValueType<T>, float> ? 1e4 : 1e30)) {
    Worst regular, any;
    draw_packs<T>(family, some, [&](Mat3<T> const& packs) {
      Mat3<T> const C = cofactor(packs);
      T const sums = stretch_sum(contract(packs, packs), determinant(packs), contract(C, C));
      Svd<T> const f = svd(packs);
      for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
        long double const norm = size(wide(packs, i));
        long double s[3];
        for (int k = 0; k < 3; ++k) s[k] = lane(f.s[k], i) / norm;
        long double const error = lane(sums, i) / norm - (s[0] + s[1] + s[2]);
        long double const condition = (s[0] + s[1]) * (s[1] + s[2]) * (s[2] + s[0]);
        any.see(error);
        if (condition > 1e-3) regular.see(error * condition);
      }
    });
    INFO(family.name);
    CHECK(regular.value() < 16 * epsilon<T>);
    CHECK(any.value() < 4 * std::cbrt(epsilon<T>));  // the largest root may be threefold
  }
}
