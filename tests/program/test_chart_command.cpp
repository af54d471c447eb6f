// `taut chart` from scene to data.csv.
#include <taut/apps/chart/method.hpp>
#include <taut/apps/program/methods.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "chart_data.hpp"

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

TEST_CASE("methods meet at the solution of the reference", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.methods = {"dk", "lbfgs", "newton", "dk:precision=fp32", "dk:preconditioner=jacobi"};
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# kind = comparison\n"));
  CHECK_THAT(data.header, ContainsSubstring("# tets = 144\n"));
  CHECK_THAT(data.header, ContainsSubstring("# frame 2 length_m = "));
  CHECK_THAT(data.header, ContainsSubstring("# threads = "));

  for (std::string const method : {"DK", "L-BFGS", "Newton", "DK jacobi"}) {
    CAPTURE(method);
    std::vector<Row> const rows = data.of(method);
    REQUIRE(!rows.empty());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      CHECK(number(rows[k], "frame") == 2);
      CHECK(number(rows[k], "iteration") == double(k + 1));
      CHECK(number(rows[k], "seconds") >= 0);
      CHECK(rows[k].at("ended").empty() == (k + 1 < rows.size()));
    }
    CHECK(rows.back().at("ended") == "accurate");
    CHECK(number(rows.back(), "position_error") <= options.lowest);
    CHECK(number(rows.back(), "energy_gap") < 1e-12);
  }
  // Newton's error falls in every iteration, and ever faster.
  std::vector<Row> const newton = data.of("Newton");
  REQUIRE(newton.size() >= 2);
  CHECK(newton.size() < 10);
  for (std::size_t k = 1; k < newton.size(); ++k)
    CHECK(number(newton[k], "position_error") < number(newton[k - 1], "position_error"));

  // Single precision has a floor, which is neither the solution nor far from it.
  std::vector<Row> const single = data.of("DK fp32");
  CHECK(single.back().at("ended") != "accurate");
  CHECK(number(single.back(), "position_error") > options.lowest);
  CHECK(number(single.back(), "position_error") < options.target);
}

TEST_CASE("every method starts from the same state", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.methods = {"dk", "gradient", "newton"};
  Data const one = chart(options);
  options.methods = {"newton", "dk"};
  options.force = true;
  Data const other = chart(options);
  for (std::string const method : {"DK", "Newton"}) {
    std::vector<Row> const a = one.of(method), b = other.of(method);
    REQUIRE(a.size() == b.size());
    for (std::size_t k = 0; k < a.size(); ++k)
      CHECK(a[k].at("position_error") == b[k].at("position_error"));
  }
}

TEST_CASE("several frames and failures", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.scene.changes.overrides = {"object.cube.material.young=1e8"};
  options.frames = {1, 3};
  options.methods = {"gradient"};
  options.max_iterations = 2;
  Data const data = chart(options);
  REQUIRE(data.rows.size() == 4);
  CHECK(number(data.rows[0], "frame") == 1);
  CHECK(number(data.rows[2], "frame") == 3);
  CHECK(data.rows[1].at("ended") == "budget");
  CHECK(data.rows[3].at("ended") == "budget");
  CHECK(number(data.rows[3], "position_error") > options.target);
}

TEST_CASE("a sweep says what it took, or that it failed", "[chart]") {
  test::ScratchFolder const folder;
  std::string const sweep =
      "\n[sweep]\nkey = \"object.cube.material.young\"\nvalues = [1e4, 1e8]\n";
  ChartOptions options = options_for(folder, test::plain_scene + sweep);
  options.sweep = true;
  options.methods = {"dk", "newton", "gradient"};
  options.scene.changes.overrides.push_back("solver.preconditioner=block_jacobi");
  options.max_iterations = 60;
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# kind = sweep\n"));
  CHECK_THAT(data.header, ContainsSubstring("# key = object.cube.material.young\n"));
  REQUIRE(data.rows.size() == 6);
  std::vector<Row> const dk = data.of("DK"), gradient = data.of("gradient");
  CHECK(number(dk[0], "value") == 1e4);
  CHECK(number(dk[1], "value") == 1e8);
  // One length for all: the motion at the first value.
  CHECK(data.header.find("length_m = ") == data.header.rfind("length_m = "));
  // Stiffness costs conjugate gradients iterations, and gradient descent its life.
  CHECK(number(dk[0], "iterations") < number(dk[1], "iterations"));
  CHECK(dk[1].at("ended") == "accurate");
  CHECK(gradient[1].at("iterations").empty());
  CHECK(gradient[1].at("seconds").empty());
  CHECK(gradient[1].at("ended") == "budget");
  CHECK(number(gradient[1], "position_error") > options.target);
}

TEST_CASE("a chart that is there stays, unless forced", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.methods = {"newton"};
  std::filesystem::create_directories(options.out);
  write_file_atomically(options.out / "data.csv", "mine");
  CHECK_THROWS_MATCHES(chart_command(options), Error, MessageMatches(ContainsSubstring("--force")));
  CHECK(read_file(options.out / "data.csv") == "mine");
  options.force = true;
  CHECK(!chart(options).rows.empty());
}

TEST_CASE("a chart leaves every file of another one, unless forced", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.methods = {"newton"};
  auto const refused = [&](std::string const& name) {
    CAPTURE(name);
    options.out = folder.path() / ("of_" + name);
    write_file_atomically(options.out / name, "mine");
    CHECK_THROWS_MATCHES(chart_command(options), Error,
                         MessageMatches(ContainsSubstring("(" + name + ")")));
    CHECK(read_file(options.out / name) == "mine");
    CHECK_FALSE(std::filesystem::exists(options.out / "data.csv"));
  };
  for (char const* name : {"data.json", "frames.csv", "fields.csv", "patterns.csv"}) refused(name);
  options.draw = true;
  for (char const* name : {"chart.svg", "chart.png", "residual.png", "fields_residual.svg"}) {
    refused(name);
  }
  // Pictures that are not drawn are none of its own.
  options.draw = false;
  CHECK(!chart(options).rows.empty());
  CHECK(read_file(options.out / "fields_residual.svg") == "mine");
}

TEST_CASE("a scene may have commas and quotes in its name", "[chart]") {
  CHECK(split_row("1,,\"a, \"\"b\"\"\",x = \"y\",\"\"") ==
        std::vector<std::string>{"1", "", "a, \"b\"", "x = \"y\"", ""});
  test::ScratchFolder const folder;
  std::string const name = GENERATE("a, \"b\"", "# a = b");
  ChartOptions options =
      options_for(folder, test::replaced(test::plain_scene, "\"plain\"", "'" + name + "'"));
  options.methods = {"newton"};
  for (bool const totals : {false, true}) {
    CAPTURE(totals);
    options.totals = totals;
    if (totals) options.frames = {};
    Data const data = chart(options);
    REQUIRE(!data.rows.empty());
    CHECK(data.rows.front().at("scene") == name);
    CHECK(data.rows.front().at("method") == "Newton");
    CHECK(number(data.rows.front(), totals ? "frames" : "frame") == (totals ? 4 : 2));
    options.force = true;
  }
}

TEST_CASE("totals have no errors where the reference has not converged", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  options.frames = {};
  options.totals = true;
  options.methods = {"newton"};
  Data const good = chart(options);
  CHECK_THAT(good.header, ContainsSubstring("# reference = dk, 4 of 4 frames, end of scene\n"));
  CHECK(number(good.rows.at(0), "error_m") < 1e-2);
  // Enough iterations for the tolerance of the methods, but not for a thousandth of it.
  options.force = true;
  options.scene.changes.overrides = {"solver.max_iterations=3"};
  options.methods = {"newton:max_iterations=100"};
  Data const bad = chart(options);
  CHECK_THAT(bad.header, ContainsSubstring("# reference = dk, 4 of 4 frames, not converged\n"));
  CHECK(bad.rows.at(0).at("ended") == "end of scene");
  CHECK(bad.rows.at(0).at("error_m").empty());
}

TEST_CASE("methods of a chart are named with their options", "[chart]") {
  ChartMethod const method = parse_method("lbfgs:preconditioner=jacobi:history=20");
  CHECK(method.label == "L-BFGS jacobi history=20");
  CHECK(method.overrides == std::vector<std::string>{"solver.method=lbfgs",
                                                     "solver.preconditioner=jacobi",
                                                     "solver.history=20"});
  CHECK(parse_methods({}).size() == method_titles().size());
  CHECK(parse_methods({"all"}).size() == method_titles().size());
  CHECK_THROWS_MATCHES(parse_method("newtom"), Error,
                       MessageMatches(ContainsSubstring("\"newton\"")));
  CHECK_THROWS_MATCHES(parse_method("dk:jacobi"), Error,
                       MessageMatches(ContainsSubstring("KEY=VALUE")));
  CHECK_THROWS_MATCHES(parse_methods({"dk", "dk"}), Error,
                       MessageMatches(ContainsSubstring("twice")));
}

TEST_CASE("bad charts are refused before anything is written", "[chart]") {
  test::ScratchFolder const folder;
  ChartOptions options = options_for(folder, test::plain_scene);
  auto const refused = [&](std::string const& part) {
    CHECK_THROWS_MATCHES(chart_command(options), Error, MessageMatches(ContainsSubstring(part)));
    CHECK(!std::filesystem::exists(options.out / "data.csv"));
  };
  SECTION("a key that does not exist") {
    options.methods = {"dk:preconditoner=jacobi"};
    refused("preconditioner");
  }
  SECTION("a sweep of a scene without one") {
    options.methods = {"dk"};
    options.sweep = true;
    refused("[sweep]");
  }
  SECTION("frames out of order") {
    options.methods = {"newton"};
    options.frames = {2, 1};
    refused("--frame 1");
  }
  SECTION("numbers that make no sense") {
    options.methods = {"newton"};
    options.target = -1;
    refused("--target -1");
    options.target = 0.01;
    options.max_seconds = -1;
    refused("--seconds -1");
    options.max_seconds = 1;
    options.repetitions = 0;
    refused("--repetitions 0");
    options.repetitions = 1;
    options.length = 0;
    refused("--length 0");
    CHECK(!std::filesystem::exists(options.out));
  }
  SECTION("a folder that cannot be made") {
    options.methods = {"newton"};
    options.out = std::filesystem::path(folder.write("file", "")) / "chart";
    refused("file");
  }
  SECTION("a frame before the first") {
    options.frames = {0};
    refused("--frame 0");
  }
}
