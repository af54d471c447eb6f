// Packs of elements against single elements.
#include "samples.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("packs of elements give what single elements give", "[materials]") {
  using Pack = HostPack<float>;
  constexpr int lanes = ScalarTraits<Pack>::lanes;
  auto const compare = [&]<class Model>() {
    INFO(Model::name);
    auto const all = deformations<Model>();
    for (std::size_t first = 0; first < all.size(); first += lanes) {
      Mat3<Pack> F, dF;
      std::mt19937 rng(29);
      Mat3<double> const direction = random_matrix(rng, 0.01);
      for (int k = 0; k < 9; ++k) {
        F.a[k] = Pack([&](std::size_t lane) {
          return float(all[std::min(first + lane, all.size() - 1)].a[k]);
        });
        dF.a[k] = Pack(float(direction.a[k]));
      }
      Lame<Pack> const p = Elastic<Model>::template cast<Pack>(lame);
      auto const state = evaluate<Model>(p, F);
      Mat3<Pack> const P = stress(state);
      Pack const q = quadratic_form(state, dF), change = energy_change<Model>(p, state, dF);
      for (int lane = 0; lane < lanes; ++lane) {
        Mat3<double> const F1 = all[std::min(first + lane, all.size() - 1)];
        auto const exact = evaluate<Model>(lame, F1);
        double const size = lame.lambda * (1 + contract(F1, F1) * frobenius(F1));
        for (int k = 0; k < 9; ++k) {
          CHECK_THAT(taut::lane(P.a[k], lane), WithinAbs(stress(exact).a[k], 2e-5 * size));
        }
        double const step = contract(direction, direction);
        if (determinant(F1) > 1e-2 || Model::allows_inversion) {
          CHECK_THAT(taut::lane(q, lane),
                     WithinAbs(quadratic_form(exact, direction), 1e-4 * size * step));
          CHECK_THAT(taut::lane(change, lane),
                     WithinAbs(energy_change<Model>(lame, exact, direction),
                               1e-5 * size * std::sqrt(step)));
        }
      }
    }
  };
  compare.operator()<Arap>();
  compare.operator()<FixedCorotated>();
  compare.operator()<NeoHookean>();
  compare.operator()<StableNeoHookean>();
  compare.operator()<StableNeoHookean2018>();
}
