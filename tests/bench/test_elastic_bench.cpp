// The bench's rows and what they are measured against. Times themselves are not judged.
#include <taut/apps/bench/counts.hpp>
#include <taut/apps/bench/elastic.hpp>
#include <taut/apps/bench/table.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <support/data.hpp>

#include <cmath>
#include <set>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("bytes and flops are counted as published", "[bench]") {
  ElasticCounts const nh = count_elastic("neo_hookean", "fp32", 1 / 5.5);
  // 5.5 tets per vertex in fp32: 71, 64 and 155 bytes.
  CHECK_THAT(nh.gradient.bytes, WithinAbs(71, 0.5));
  CHECK_THAT(nh.quadratic_form.bytes, WithinAbs(64, 0.5));
  CHECK_THAT(nh.iteration.bytes, WithinAbs(155, 1));
  // p'Hp of neo-Hookean from dF on takes about 168 flops (54 + 17+1 + 27 + 17+1 + 45 + 6), once F
  // (54), J (5) and the derivatives (10) are known.
  CHECK(nh.quadratic_form.flops - 54 - 5 - 10 == 168);

  // fp64 numbers are twice as long, indices are not.
  ElasticCounts const wide = count_elastic("neo_hookean", "fp64", 1 / 5.5);
  CHECK_THAT(wide.gradient.bytes, WithinRel(2 * nh.gradient.bytes - 20, 1e-12));
  CHECK(wide.gradient.flops == nh.gradient.flops);
  ElasticCounts const mixed = count_elastic("neo_hookean", "mixed", 1 / 5.5);
  CHECK_THAT(mixed.gradient.bytes, WithinRel(nh.gradient.bytes + 12 / 5.5, 1e-12));

  // A polar decomposition costs more than all of neo-Hookean.
  ElasticCounts const arap = count_elastic("arap", "fp32", 1 / 5.5);
  ElasticCounts const fcr = count_elastic("fixed_corotated", "fp32", 1 / 5.5);
  CHECK(arap.quadratic_form.flops > 2 * nh.quadratic_form.flops);
  CHECK(fcr.gradient.flops > arap.gradient.flops);
  CHECK_THROWS_AS(count_elastic("jelly", "fp32", 0.2), Error);
}

TEST_CASE("the limit is the slower of memory and arithmetic", "[bench]") {
  MachineRates const machine{2, 10, 50, 20};
  CHECK(limit_ns(machine, "fp32", {100, 400}) == 10);
  CHECK(limit_ns(machine, "fp32", {100, 600}) == 12);
  CHECK(limit_ns(machine, "fp64", {100, 400}) == 20);
}

TEST_CASE("a row per material, precision and kernel", "[bench]") {
  BenchOptions options;
  options.tets = {3000};
  options.precisions = {"fp32", "mixed", "fp64"};
  options.seconds = 0;
  MachineRates const machine{2, 10, 50, 20};
  std::vector<BenchRow> const rows = measure_elastic(options, machine);

  auto const list = test::parse_json(to_json(rows));
  REQUIRE(list.is_array());
  REQUIRE(list.size() == rows.size());
  std::set<std::string> seen;
  int elastic = 0;
  for (auto const& row : list) {
    CAPTURE(row.dump());
    std::string const kernel = row.at("kernel");
    CHECK(row.at("threads") == 2);
    CHECK(std::abs(row.at("tets").get<int>() - 3000) < 900);
    double const ns = row.at("ns_per_tet"), fraction = row.at("fraction");
    CHECK(ns > 0);
    CHECK(std::isfinite(ns));
    SweepCounts const counts{row.at("bytes"), row.at("flops")};
    CHECK_THAT(fraction * ns,
               WithinRel(limit_ns(machine, row.at("precision").get<std::string>(), counts), 1e-9));
    if (kernel == "iteration") {
      CHECK(row.at("allocations") == 0);
      CHECK(row.at("held_bytes") > 50);
      CHECK(row.at("held_bytes") < (row.at("precision") == "fp32" ? 250 : 400));
    }
    if (kernel == "gradient" || kernel == "quadratic_form" || kernel == "iteration") {
      ++elastic;
      seen.insert(row.at("material").get<std::string>() + row.at("precision").get<std::string>() +
                  kernel);
    }
  }
  CHECK(elastic == 5 * 3 * 3);
  CHECK(seen.size() == 45);
  for (char const* variant :
       {"dots", "dots_free", "gradient_atomic", "quadratic_pack", "quadratic_loop"}) {
    int count = 0;
    for (BenchRow const& row : rows) count += row.kernel == variant;
    CAPTURE(variant);
    CHECK(count == 3);
  }
  std::string const tables = bench_tables(rows, {machine});
  CHECK_THAT(tables, ContainsSubstring("stable_neo_hookean_2018"));
  CHECK_THAT(tables, ContainsSubstring("against atomics"));
}

TEST_CASE("what the bench does not know is refused", "[bench]") {
  BenchOptions options;
  options.tets = {100};
  options.seconds = 0;
  options.materials = {"jelly"};
  CHECK_THROWS_AS(measure_elastic(options, {1, 1, 1, 1}), Error);
  options.materials = {"arap"};
  options.precisions = {"fp16"};
  CHECK_THROWS_AS(measure_elastic(options, {1, 1, 1, 1}), Error);
}

TEST_CASE("options of bench are checked before anything is measured", "[bench]") {
  auto const refused = [](BenchOptions const& options, std::string const& part) {
    CHECK_THROWS_WITH(bench_command(options), Catch::Matchers::ContainsSubstring(part));
  };
  BenchOptions options;
  options.materials = {"jelly"};
  refused(options, "--materials jelly: choose of stable_neo_hookean");
  options = {};
  options.precisions = {"fp16"};
  refused(options, "--precisions fp16: choose of fp32, mixed, fp64");
  options = {};
  options.tets = {-5};
  refused(options, "--tets -5");
  options = {};
  options.seconds = 0;
  refused(options, "--seconds 0");
}
