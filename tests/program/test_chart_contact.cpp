// Charts of scenes with contact: errors of methods, the same step without contact, other scenes
// beside it, and how far policies of contact go.
#include <taut/apps/chart/policy.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <nlohmann/json.hpp>

#include "chart_data.hpp"

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinRel;
using Json = nlohmann::json;

namespace {

/// Two cubes thrown onto each other and the floor: in step 3 both pairs act.
std::string const falling = R"(name = "falling"
gravity = [0, -10, 0]

[time]
step = 0.01
frames = 6

[[object]]
name = "cube"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
copies = { count = [1, 2, 1], step = [1.2, 1.05, 1.2] }
translate = [0, 0.52, 0]
velocity = { linear = [0, -4, 0] }
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[obstacle]]
name = "floor"
shape = { kind = "half_space" }

[contact]
)";

Json read_json(ChartOptions const& options) {
  return Json::parse(read_file(options.out / "data.json"));
}

ChartOptions stability_for(ScratchFolder const& folder, std::string const& scene) {
  ChartOptions options = options_for(folder, scene);
  options.frames = {};
  options.stability = true;
  return options;
}

}  // namespace

TEST_CASE("with contact, methods meet at the solution of the reference", "[chart][contact]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, falling);
  options.frames = {3};
  options.methods = {"dk", "newton", "gradient"};
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# frame 3 contacts = "));
  Json const json = read_json(options);
  CHECK(json.at("facts").at("frame 3 contacts") > 0);
  CHECK(json.at("facts").at("frame 3 smallest_gap") < 1);
  for (std::string const method : {"DK", "Newton"}) {
    CAPTURE(method);
    std::vector<Row> const rows = data.of(method);
    REQUIRE(!rows.empty());
    CHECK(number(rows.back(), "position_error") <= 1e-6);
    // That of contact is not in the energies that a chart knows.
    for (Row const& row : rows) CHECK(row.at("energy_gap").empty());
  }

  // The same numbers, and what they amount to.
  CHECK(json.at("rows").size() == data.rows.size());
  REQUIRE(json.at("methods").size() == 3);
  for (Json const& method : json.at("methods")) {
    std::vector<Row> const rows = data.of(method.at("method"));
    CHECK(method.at("scene") == "falling");
    CHECK(method.at("frame") == 3);
    CHECK(method.at("ended") == rows.back().at("ended"));
    if (method.at("iterations_to_target").is_null()) {
      CHECK(number(rows.back(), "position_error") > options.target);
      CHECK(method.at("frames_per_second").is_null());
      continue;
    }
    int const k = method.at("iterations_to_target");
    CHECK(number(rows[k - 1], "position_error") <= options.target);
    if (k > 1) CHECK(number(rows[k - 2], "position_error") > options.target);
    CHECK_THAT(method.at("frames_per_second").get<double>(),
               WithinRel(1 / number(rows[k - 1], "seconds"), 1e-5));
  }
}

TEST_CASE("a step with and without contact, and other scenes, share a chart", "[chart][contact]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, falling);
  options.frames = {3};
  options.methods = {"newton"};
  options.without_contact = true;
  options.with = {folder
                      .write("one.toml",
                             "base = \"scene.toml\"\nname = \"one\"\nobject.cube.copies.count = "
                             "[1, 1, 1]\n")
                      .string()};
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# with = one\n"));
  for (std::string const scene : {"falling", "one"}) {
    CAPTURE(scene);
    CHECK_THAT(data.header, ContainsSubstring("# " + scene + " frame 3 contacts = "));
    CHECK_THAT(data.header, ContainsSubstring("# " + scene + " without contact frame 3 length_m"));
    for (std::string const contact : {"", " without contact"}) {
      std::vector<Row> const rows = data.where("scene", scene + contact);
      REQUIRE(!rows.empty());
      CHECK(number(rows.back(), "position_error") <= 1e-6);
      // Without contact the energy is known.
      CHECK(rows.back().at("energy_gap").empty() == contact.empty());
    }
  }
  // Bodies that nothing stops move on, as they did.
  Json const facts = read_json(options).at("facts");
  CHECK_THAT(facts.at("one without contact frame 3 length_m").get<double>(),
             WithinRel(0.01 * (4 + 0.3), 0.5));
  CHECK(facts.at("one frame 3 contacts") > 0);
  CHECK(facts.at("with") == Json{"one"});
}

TEST_CASE("policies go as far as their steps are clean", "[chart][contact]") {
  ScratchFolder const folder;
  ChartOptions options = stability_for(folder, falling);
  options.policies = {"default", "bound=closing", "solver.max_iterations=2:cap=0.25"};
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# kind = stability\n"));
  REQUIRE(data.rows.size() == 3);
  for (std::string const policy : {"default", "bound = closing"}) {
    CAPTURE(policy);
    Row const row = data.where("policy", policy).at(0);
    CHECK(row.at("ended") == "end of scene");
    CHECK(row.at("why").empty());
    CHECK(number(row, "steps") == 6);
    CHECK_THAT(number(row, "seconds_simulated"), WithinRel(0.06, 1e-6));
    CHECK(number(row, "turns") == 0);
    CHECK(number(row, "iterations") >= 1);
    CHECK(number(row, "most_contacts") > 0);
    CHECK(number(row, "smallest_gap") < 1);
  }
  Row const poor = data.where("policy", "solver.max_iterations = 2; cap = 0.25").at(0);
  CHECK(poor.at("ended") == "not converged");
  CHECK_THAT(poor.at("why"), ContainsSubstring("after 2 iterations"));
  CHECK(number(poor, "steps") < 6);
  CHECK(read_json(options).at("rows").size() == 3);
}

TEST_CASE("what ends a policy is named", "[chart][contact]") {
  ScratchFolder const folder;
  SECTION("an intersection") {
    // One flies at the other, and nothing but a pressure of next to nothing is between them.
    std::string const ball = R"(
[[object]]
name = "ball"
shape = { kind = "box", size = [0.5, 0.5, 0.5], resolution = 2 }
translate = [0, 2.6, 0]
velocity = { linear = [0, -30, 0] }
material = { young = 1e5, poisson = 0.4, density = 1000 }
)";
    ChartOptions options =
        stability_for(folder, replaced(falling, "\n[contact]", ball + "\n[contact]"));
    options.policies = {"bound=half_dhat:stiffness=given:pressure=1e-6"};
    Row const row = chart(options).rows.at(0);
    CHECK(row.at("ended") == "intersects");
    CHECK_THAT(row.at("why"), ContainsSubstring("of ball with cube-1"));
    CHECK(number(row, "steps") < 6);
  }
  SECTION("pins that nothing lets through, with the turns so far") {
    std::string const pin = R"(
[[pin]]
name = "press"
object = "cube-1"
select = "all"
motion = [{ velocity = [0, -10, 0], axis = [0, 1, 0], centre = [0, 0, 0], angular_velocity = 90 }]

[[pin]]
name = "hold"
object = "cube-0"
select = "all"
)";
    ChartOptions options = stability_for(folder, falling + pin);
    options.policies = {"default"};
    Row const row = chart(options).rows.at(0);
    CHECK(row.at("ended") == "no step");
    CHECK_THAT(row.at("why"), ContainsSubstring("held up"));
    CHECK_THAT(number(row, "turns"), WithinRel(0.25 * number(row, "seconds_simulated"), 1e-3));
  }
  SECTION("time") {
    ChartOptions options = stability_for(folder, falling);
    options.policies = {"default"};
    options.max_seconds = 1e-9;
    Row const row = chart(options).rows.at(0);
    CHECK(row.at("ended") == "out of time");
    CHECK(number(row, "steps") == 1);
  }
}

TEST_CASE("policies are named by their keys", "[chart][contact]") {
  ScratchFolder const folder;
  std::filesystem::path const file = folder.write("scene.toml", falling);
  Scene const scene = load_scene(file);
  ChartPolicy const policy = parse_policy("stiffness=given:solver.tolerance=1e-4", scene);
  CHECK(policy.label == "stiffness = given; solver.tolerance = 1e-4");
  CHECK(policy.overrides ==
        std::vector<std::string>{"contact.stiffness=given", "solver.tolerance=1e-4"});
  CHECK(parse_policies({}, scene).size() == default_policies(scene).size());
  for (ChartPolicy const& one : default_policies(scene)) {
    CAPTURE(one.label);
    SceneChanges changes;
    changes.overrides = one.overrides;
    CHECK_NOTHROW(load_scene(file, changes));
  }
  for (std::string const bad : {"bound", "=closing", "bound=", "bound=closing:"}) {
    CAPTURE(bad);
    CHECK_THROWS_MATCHES(parse_policy(bad, scene), Error,
                         MessageMatches(ContainsSubstring("KEY=VALUE")));
  }
  CHECK_THROWS_MATCHES(parse_policies({"paper", "paper"}, scene), Error,
                       MessageMatches(ContainsSubstring("twice")));
}

TEST_CASE("a scene that cannot be compared does not cost the others", "[chart][contact]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, falling);
  options.methods = {"newton"};
  options.with = {
      folder.write("still.toml", replaced(plain_scene, "[0, -10, 0]", "[0, 0, 0]")).string()};
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# left_out = plain: nothing moves"));
  CHECK(!data.rows.empty());
  CHECK(data.rows.back().at("ended") == "accurate");
  CHECK(read_json(options).at("facts").at("left_out").size() == 1);
  options.force = true;
  options.scene.scene = options.with.front();
  CHECK_THROWS_MATCHES(chart_command(options), Error,
                       MessageMatches(ContainsSubstring("no scene can be compared")));
  options.with = {};
  CHECK_THROWS_MATCHES(chart_command(options), Error,
                       MessageMatches(ContainsSubstring("nothing moves")));
}

TEST_CASE("charts that mix what does not belong together are refused", "[chart][contact]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, falling);
  auto const refused = [&](std::string const& part) {
    CHECK_THROWS_MATCHES(chart_command(options), Error, MessageMatches(ContainsSubstring(part)));
    CHECK(!std::filesystem::exists(options.out / "data.csv"));
  };
  SECTION("a sweep of policies") {
    options.sweep = options.stability = true;
    refused("choose one");
  }
  SECTION("stability of methods") {
    options.stability = true;
    options.methods = {"dk"};
    refused("--policies");
  }
  SECTION("policies of a comparison") {
    options.policies = {"default"};
    refused("--stability");
  }
  SECTION("stability with other scenes") {
    options.stability = true;
    options.frames = {};
    options.with = {"eight_letters"};
    refused("--with");
  }
  SECTION("stability of a scene without contact") {
    options = stability_for(folder, plain_scene);
    refused("[contact]");
  }
  SECTION("a policy that does not exist") {
    options = stability_for(folder, falling);
    options.policies = {"bound=closed"};
    refused("closing");
  }
  SECTION("obstacles that leave the scene with their vertices") {
    std::string const ball =
        "\n[[obstacle]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius = 0.2, resolution = "
        "4 }\ntranslate = [3, 0.5, 0]\n";
    options = options_for(folder, replaced(falling, "\n[contact]", ball + "\n[contact]"));
    options.methods = {"newton"};
    options.without_contact = true;
    refused("--without-contact");
  }
}
