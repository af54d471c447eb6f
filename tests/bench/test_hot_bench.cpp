// The rows of the bench of material points and what its times are measured against. Times
// themselves are not judged.
#include <taut/apps/bench/hot.hpp>
#include <taut/apps/bench/hot_counts.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <set>

using Catch::Matchers::ContainsSubstring;
using namespace taut;

TEST_CASE("what a particle cannot do without is counted", "[bench]") {
  double const particles = 5;
  for (char const* kernel :
       {"to_grid", "to_particles", "change", "gradient", "quadratic_form", "linearise", "product",
        "linearise_fp32", "product_fp32", "assembly"}) {
    CAPTURE(kernel);
    SweepCounts const some = count_particles(kernel, particles);
    CHECK(some.bytes > 0);
    // What the nodes need is shared by more particles.
    CHECK(count_particles(kernel, 2 * particles).bytes < some.bytes);
    CHECK(count_particles(kernel, 2 * particles).flops == some.flops);
  }
  CHECK(count_particles("rebuild", particles).bytes == 0);
  // A row of 125 blocks of nine numbers per node, and the 45 numbers of a particle.
  CHECK(count_particles("assembly", particles).bytes == 45 * 8 + 125 * 9 * 8 / particles);
}

TEST_CASE("a row per kernel of material points, level and cycle", "[bench]") {
  HotBenchOptions options;
  options.cells = {6};
  options.seconds = 1e-4;
  MachineRates const machine{.threads = 2, .triad = 10, .fma32 = 40, .fma64 = 20};
  std::vector<HotRow> const rows = measure_hot(options, machine);
  std::set<std::string> kernels;
  for (HotRow const& row : rows) {
    CAPTURE(row.kernel, row.cycle, row.level);
    kernels.insert(row.kernel);
    CHECK(row.ns > 0);
    CHECK(row.cells == 6);
    CHECK(std::abs(row.particles - 8 * 216) < 20);  // blue noise
    CHECK(row.nodes > 0);
    CHECK((row.fraction > 0) == (row.bytes > 0));
    if (row.per == "particle") CHECK(row.cycle.empty());
    if (row.kernel == "hierarchy") CHECK(row.held > 0);
  }
  CHECK(kernels == std::set<std::string>{"rebuild", "to_grid", "to_particles", "change", "gradient",
                                         "gradient_blocks", "quadratic_form", "linearise",
                                         "product", "linearise_fp32", "product_fp32", "assembly",
                                         "hierarchy", "smoother", "cycle"});
  auto const one = [&](std::string const& cycle, std::string const& kernel,
                       std::string const& per) {
    return *std::find_if(rows.begin(), rows.end(), [&](HotRow const& row) {
      return row.cycle == cycle && row.kernel == kernel && row.per == per;
    });
  };
  // HOT's fine matrix alone is 125 blocks of nine doubles a node.
  CHECK(one("hot", "hierarchy", "node").held > 9000);
  CHECK(one("default", "hierarchy", "node").held < one("hot", "hierarchy", "node").held);
  // Inside a row has 125 blocks, at the rim fewer.
  double const blocks = one("hot", "cycle", "node").ns / one("hot", "cycle", "block").ns;
  CHECK(blocks > 40);
  CHECK(blocks < 125);

  std::vector<HotRow> const back = hot_rows(to_json(rows));
  REQUIRE(back.size() == rows.size());
  CHECK(to_json(back) == to_json(rows));
  std::string const tables = hot_tables(rows, {machine});
  for (std::string const& kernel : kernels) CHECK_THAT(tables, ContainsSubstring(kernel));
}

TEST_CASE("options of the bench of material points are checked first", "[bench]") {
  HotBenchOptions options;
  auto const refused = [&](std::string const& part) {
    CHECK_THROWS_WITH(bench_hot_command(options), ContainsSubstring(part));
  };
  options.cells = {2};
  refused("--cells 2: it must be 4 to 256");
  options = {};
  options.seconds = 0;
  refused("--seconds 0: it must be above 0");
}
