// The rows of the contact bench, its scene and what its times are measured against. Times
// themselves are not judged.
#include <taut/apps/bench/contact.hpp>
#include <taut/apps/bench/contact_counts.hpp>
#include <taut/apps/bench/contact_scene.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/contact/intersection.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <nlohmann/json.hpp>

#include <cmath>
#include <map>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("the scene of the contact bench is whole at every size", "[bench]") {
  for (int contacts : {100, 1'000, 20'000}) {
    ContactScene const scene(contacts);
    CAPTURE(contacts, scene.cells);
    for (Tet const& tet : scene.rest.tets) REQUIRE(rest_shape(scene.rest.points, tet).W > 0);
    IntersectionTest const test({scene.surface.triangles, scene.surface.edges, scene.object});
    CHECK(test.find(scene.rest.points).empty());
    // Shortly before and after the step of the bench as well.
    std::vector<Point> moved = scene.rest.points;
    for (std::size_t v = 0; v < moved.size(); ++v)
      for (int c = 0; c < 3; ++c) moved[v][c] += scene.direction[v][c];
    CHECK(test.find(moved).empty());
    CHECK(scene.mass.size() == scene.object.size());
    double const edge = edge_lengths(scene.surface, scene.rest.points).mean;
    CHECK_THAT(scene.dhat, WithinRel(0.3 * edge, 1e-12));
  }
}

TEST_CASE("what contact cannot do without is counted as published", "[bench]") {
  ContactSizes const sizes{100, 300, 200, 5000, 1000};
  // 16 bytes of vertices and 3 parameters per contact; positions, and what is read and written.
  CHECK(count_contact("gradient", "fp32", sizes).bytes == 28'000 + 100 * (12 + 24));
  CHECK(count_contact("gradient_diagonal", "mixed", sizes).bytes == 28'000 + 100 * (24 + 48));
  CHECK(count_contact("quadratic_form", "fp64", sizes).bytes == 40'000 + 100 * (24 + 24));
  CHECK(count_contact("search_hash", "fp64", sizes).bytes ==
        100 * 24 + 300 * 8 + 200 * 12 + 5000 * 16);
  CHECK_THAT(count_contact("gradient", "fp32", sizes).flops, WithinAbs(1000 * (113 + 29), 1));
  CHECK_THAT(count_contact("quadratic_form", "fp32", sizes).flops, WithinAbs(1000 * (113 + 33), 1));
  CHECK(count_contact("features", "fp32", sizes).flops == 75'000);
  CHECK(count_contact("search_hash", "fp32", sizes).bytes ==
        count_contact("search_bvh", "fp32", sizes).bytes);
  for (char const* kernel : {"iteration", "elastic", "renewal"}) {
    CHECK(count_contact(kernel, "fp32", sizes).bytes == 0);
  }
  // A bound reads what a form reads but no parameters, and does more with it.
  CHECK(count_contact("max_step", "fp64", sizes).bytes ==
        count_contact("quadratic_form", "fp64", sizes).bytes - 24'000);
  CHECK(count_contact("max_step", "fp64", sizes).flops >
        count_contact("features", "fp64", sizes).flops);
}

TEST_CASE("a row per kernel of contact, size and precision", "[bench]") {
  ContactBenchOptions options;
  options.contacts = {600, 3000};
  options.precisions = {"mixed", "fp64"};
  options.iterations = 6;
  options.seconds = 0;
  MachineRates const machine{2, 10, 50, 20};
  std::vector<ContactRow> const rows = measure_contact(options, machine);
  char const* const kernels[] = {
      "search_hash",     "search_bvh",     "features", "gradient",  "gradient_diagonal",
      "gradient_blocks", "quadratic_form", "max_step", "renewal",   "additive_ccd",
      "pairwise",        "half_dhat",      "planar",   "isotropic", "elastic",
      "iteration"};
  CHECK(rows.size() == std::size(kernels) * 2 * 2);

  std::map<int, std::pair<int, int>>
      counts;  // per size: contacts and candidates, of all precisions
  for (ContactRow const& row : rows) {
    CAPTURE(row.precision, row.kernel, row.asked);
    CHECK(row.threads == 2);
    CHECK(row.seconds > 0);
    CHECK(std::isfinite(row.seconds));
    CHECK(row.contacts > 0.7 * row.asked);
    CHECK(row.contacts < 1.4 * row.asked);
    CHECK(row.kept >= row.contacts);
    CHECK(row.candidates >= row.kept);
    CHECK(row.tets > 0);
    double const ns = 1e9 * row.seconds;
    double const limit = limit_ns(machine, row.precision, {row.bytes, row.flops});
    CHECK_THAT(row.fraction * ns, WithinAbs(limit, 1e-9 * limit));
    auto const [at, first] = counts.insert({row.asked, {row.contacts, row.candidates}});
    // mixed and fp64 may disagree about a pair whose distance is that of activation.
    CHECK(std::abs(at->second.first - row.contacts) <= 2);
    CHECK(std::abs(at->second.second - row.candidates) <= 20);
    if (row.kernel != "iteration") continue;
    CHECK(row.held > 16 * row.kept);
    CHECK(row.peak >= row.held);
    CHECK(row.searches > 0);
    CHECK(row.search_share >= 0);
    CHECK(row.bound_share > 0);
    CHECK(row.allocations == 0);
  }
  for (char const* kernel : kernels) {
    CAPTURE(kernel);
    CHECK(std::count_if(rows.begin(), rows.end(),
                        [&](ContactRow const& row) { return row.kernel == kernel; }) == 4);
  }

  std::vector<ContactRow> const back = contact_rows(to_json(rows));
  REQUIRE(back.size() == rows.size());
  CHECK(to_json(back) == to_json(rows));
  std::string const tables = contact_tables(rows, {machine});
  for (char const* part : {"mixed, 2 threads", "share search + bound", "held at most, B",
                           "candidates by boxes", "search_bvh"}) {
    CHECK_THAT(tables, ContainsSubstring(part));
  }
}

TEST_CASE("options of the contact bench are checked before anything is measured", "[bench]") {
  auto const refused = [](ContactBenchOptions const& options, std::string const& part) {
    CHECK_THROWS_WITH(bench_contact_command(options), ContainsSubstring(part));
  };
  ContactBenchOptions options;
  options.precisions = {"fp16"};
  refused(options, "--precisions fp16: choose of mixed, fp64");
  options = {};
  options.contacts = {5};
  refused(options, "--contacts 5");
  options = {};
  options.iterations = 1;
  refused(options, "--iterations 1");
  options = {};
  options.seconds = 0;
  refused(options, "--seconds 0");
  // Here Kokkos runs.
  refused({}, "Kokkos runs already");
}
