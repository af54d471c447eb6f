// Patterns of the matrices of hierarchies over material points.
#include <taut/apps/chart/node_pattern.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <random>

#include "chart_data.hpp"

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinRel;

namespace {

double blocks_per_row(NodePattern const& pattern) {
  return static_cast<double>(pattern.blocks()) / static_cast<double>(pattern.nodes.size());
}

bool couples(NodePattern const& pattern, std::size_t i, NodeAt const& at) {
  NodeAt const& own = pattern.nodes[i];
  for (int c = 0; c < 3; ++c)
    if (std::abs(at[c] - own[c]) > NodePattern::reach) return false;
  int const bit = NodePattern::bit(at[0] - own[0], at[1] - own[1], at[2] - own[2]);
  return pattern.coupled[i][static_cast<std::size_t>(bit)];
}

}  // namespace

TEST_CASE("a point couples the 27 nodes that it reaches", "[chart][mpm]") {
  NodePattern const pattern = pattern_of_points({{0.26, -0.26, 0.01}}, 0.1);
  REQUIRE(pattern.nodes.size() == 27);
  CHECK(pattern.nodes.front() == NodeAt{2, -4, -1});
  CHECK(pattern.nodes.back() == NodeAt{4, -2, 1});
  CHECK(pattern.blocks() == 27 * 27);
  CHECK(pattern.find({3, -3, 0}) == 13);
  CHECK(pattern.find({5, -3, 0}) == -1);
}

TEST_CASE("P'AP couples what the product does", "[chart][mpm]") {
  // Two clouds, on both sides of the origin, where halving must not round towards it.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> somewhere(-0.6, 0.5);
  std::vector<Vec3<double>> x;
  for (int k = 0; k < 12; ++k)
    x.push_back({somewhere(random), somewhere(random), somewhere(random)});
  NodePattern const fine = pattern_of_points(x, 0.1), coarse = coarser_pattern(fine);

  auto const weight = [](int c, int f) { return std::max(0.0, 1 - 0.5 * std::abs(2 * c - f)); };
  auto const interpolates = [&](NodeAt const& c, NodeAt const& f) {
    return weight(c[0], f[0]) * weight(c[1], f[1]) * weight(c[2], f[2]) > 0;
  };
  std::size_t found = 0;
  for (std::size_t I = 0; I < coarse.nodes.size(); ++I)
    for (std::size_t J = 0; J < coarse.nodes.size(); ++J) {
      bool product = false;
      for (std::size_t i = 0; i < fine.nodes.size() && !product; ++i) {
        if (!interpolates(coarse.nodes[I], fine.nodes[i])) continue;
        for (std::size_t j = 0; j < fine.nodes.size() && !product; ++j) {
          product = interpolates(coarse.nodes[J], fine.nodes[j]) && couples(fine, i, fine.nodes[j]);
        }
      }
      if (couples(coarse, I, coarse.nodes[J]) != product) FAIL("nodes " << I << " and " << J);
      found += product;
    }
  CHECK(found > coarse.nodes.size());
  CHECK(static_cast<std::int64_t>(found) == coarse.blocks());
}

TEST_CASE("a solid has full stencils on every level, a sheet ever smaller ones", "[chart][mpm]") {
  SECTION("solid") {
    std::vector<Vec3<double>> x;
    for (int i = 0; i < 32; ++i)
      for (int j = 0; j < 32; ++j)
        for (int k = 0; k < 32; ++k) x.push_back({i + 0.5, j + 0.5, k + 0.5});
    NodePattern pattern = pattern_of_points(x, 1);
    for (int level = 0; level < 3; ++level, pattern = coarser_pattern(pattern)) {
      int const middle = pattern.find({16 >> level, 16 >> level, 16 >> level});
      REQUIRE(middle >= 0);
      CHECK(pattern.coupled[static_cast<std::size_t>(middle)].all());
    }
  }
  SECTION("the trampoline of HOT's Figure 3") {
    // Blocks per row that a count in Python found, for another sampling of the same disc.
    constexpr double galerkin[] = {92.67, 71.40, 45.56, 41.97, 36.57};
    constexpr double of_particles[] = {92.67, 71.48, 80.01, 63.65, 57.0};
    constexpr double radius = 2.4, half = 0.04, dx = 0.04, spacing = dx / 3;
    std::vector<Vec3<double>> x;
    for (double a = -radius; a < radius; a += spacing)
      for (double b = -radius; b < radius; b += spacing) {
        if (a * a + b * b > radius * radius) continue;
        for (double y = -half + spacing / 2; y < half; y += spacing)
          x.push_back({10 + a, 10 + y, 10 + b});
      }
    NodePattern pattern = pattern_of_points(x, dx);
    for (int level = 0; level < 5; ++level, pattern = coarser_pattern(pattern)) {
      CAPTURE(level);
      CHECK_THAT(blocks_per_row(pattern), WithinRel(galerkin[level], 0.005));
      CHECK_THAT(blocks_per_row(pattern_of_points(x, dx * (1 << level))),
                 WithinRel(of_particles[level], 0.005));
    }
  }
}

TEST_CASE("a chart of matrices", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, R"(name = "block"

[time]
step = 0.02
frames = 3

[grid]
spacing = 0.1

[[object]]
name = "block"
shape = { kind = "box", size = [0.8, 0.4, 0.4] }
material = { young = 1e4, poisson = 0.3, density = 1000 }
)");
  options.matrices = true;
  options.levels = 3;
  Data const data = chart(options);
  CHECK_THAT(data.header,
             ContainsSubstring("# kind = matrices\n") && ContainsSubstring("# frame = 2\n"));
  REQUIRE(data.rows.size() == 5);  // one fine level, two of each kind below it
  for (Row const& row : data.rows) {
    double const nodes = number(row, "nodes"), nonzeros = number(row, "nonzeros");
    CHECK_THAT(number(row, "per_row"), WithinRel(nonzeros / (3 * nodes), 1e-4));
    CHECK(number(row, "per_row") <= 375);
  }
  CHECK(number(data.rows[1], "nodes") < number(data.rows[0], "nodes"));

  Data const patterns = read_data(options.out / "patterns.csv");
  std::map<std::string, double> blocks;
  for (Row const& row : patterns.rows)
    blocks[row.at("hierarchy") + row.at("level")] += number(row, "blocks");
  for (Row const& row : data.rows)
    CHECK(9 * blocks[row.at("hierarchy") + row.at("level")] == number(row, "nonzeros"));

  auto const refused = [&](std::string const& part) {
    options.force = true;
    CHECK_THROWS_MATCHES(chart_command(options), Error, MessageMatches(ContainsSubstring(part)));
  };
  SECTION("another chart leaves no patterns behind") {
    options.matrices = false;
    options.methods = {"lbfgs"};
    options.scene.changes.overrides = {"gravity=[0,-10,0]"};
    options.force = true;
    chart(options);
    CHECK(!std::filesystem::exists(options.out / "patterns.csv"));
  }
  SECTION("methods are none of its business") {
    options.methods = {"hot"};
    refused("leave them out");
  }
  SECTION("meshes have no grid") {
    options.scene.scene = folder.write("plain.toml", plain_scene).string();
    refused("material points");
  }
}
