// The rotation-variant singular value decomposition against Eigen's, for every kind of F, in
// scalars and in packs.
#include "samples.hpp"

#include <taut/core/math/svd.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::test;

TEMPLATE_TEST_CASE("svd decomposes every matrix as Eigen does", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  for (Family const& family : deformations(extreme_size<T>)) {
    Worst orthogonal, proper, product, values, order, sign;
    draw_packs<T>(family, family.name == "random" ? many : some, [&](Mat3<T> const& packs) {
      Svd<T> const f = svd(packs);
      for (int i = 0; i < ScalarTraits<T>::lanes; ++i) {
        Wide const F = wide(packs, i), U = wide(f.U, i), V = wide(f.V, i);
        long double const scale = 1 / size(F);
        Wide const unit = scale * F;
        Vec3<long double> const s = scale * wide(f.s, i);
        orthogonal.see(std::max(orthogonality(U), orthogonality(V)));
        proper.see(std::max(std::abs(determinant(U) - 1), std::abs(determinant(V) - 1)));
        product.see(frobenius(compose(U, s, V) - unit));
        order.see(std::max({0.0L, s[1] - s[0], std::abs(s[2]) - s[1]}));
        sign.see(std::max(0.0L, -s[2] * determinant(unit)));
        Mat3<double> rounded;
        for (int k = 0; k < 9; ++k) rounded.a[k] = static_cast<double>(unit.a[k]);
        Vec3<double> const expected = eigen_svd(rounded).s;
        // Where the sum of the two smaller ones is zero, either may carry the sign.
        for (int k = 0; k < 3; ++k) values.see(std::abs(s[k]) - std::abs(expected[k]));
      }
    });
    INFO(family.name);
    CHECK(orthogonal.value() < 32 * epsilon<T>);
    CHECK(proper.value() < 32 * epsilon<T>);
    CHECK(product.value() < 32 * epsilon<T>);
    CHECK(values.value() < 16 * epsilon<T>);
    CHECK(order.value() < 8 * epsilon<T>);
    CHECK(sign.value() < 8 * epsilon<T>);
  }
}

TEST_CASE("svd puts the sign of the determinant on the smallest singular value", "[math]") {
  Random random(1);
  for (int repeat = 0; repeat < some; ++repeat) {
    Svd<double> const f = svd(with_stretches(random, 3, 2, repeat % 2 == 0 ? 1 : -1));
    double const error = std::max({std::abs(f.s[0] - 3), std::abs(f.s[1] - 2),
                                   std::abs(f.s[2] - (repeat % 2 == 0 ? 1 : -1))});
    if (!(error < 1e-14)) FAIL(repeat << ": " << error);
  }
}
