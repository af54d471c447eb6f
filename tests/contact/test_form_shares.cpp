#include "form_shares.hpp"

#include <catch2/catch_test_macros.hpp>

using namespace taut;

TEST_CASE("the shares of an island are p'Hp of p restricted to it", "[islands]") {
  scenes::check_shares<Fp64>();
}

TEST_CASE("bodies are what elements connect, and the rest together", "[islands]") {
  std::vector<int> const triples{7, 2, 5, 5, 9, 2}, pairs{0, 4, 4, 8};
  std::vector<Connectivity> const kinds{{triples, 3}, {pairs, 2}};
  auto const bodies = make_bodies<SerialSpace>(11, kinds);
  REQUIRE(bodies.count == 3);
  int const expected[] = {0, 2, 1, 2, 0, 1, 2, 1, 0, 1, 2};
  for (int i = 0; i < 11; ++i) CHECK(bodies.of(i) == expected[i]);

  // Sums over bodies longer than a chunk, against sums in order.
  std::mt19937 random(3);
  std::vector<int> chain;
  int const n = 5000;
  for (int i = 0; i + 3 < n; ++i) chain.insert(chain.end(), {i, i + 3});
  std::vector<Connectivity> const long_kinds{{chain, 2}};
  auto const strands = make_bodies<DefaultSpace>(n, long_kinds);
  REQUIRE(strands.count == 3);
  Array<double, DefaultSpace> const shares("shares", n);
  std::vector<double> sum(3);
  for (int i = 0; i < n; ++i)
    sum[i % 3] += shares(i) = std::uniform_int_distribution(-9, 9)(random);
  BodySums<DefaultSpace, double> const by_strand(strands, 1);
  auto const sums = by_strand.sum<1>("test", kernels::SumShares<DefaultSpace>{shares});
  for (int b = 0; b < 3; ++b) CHECK(sums[b] == sum[b]);
}
