// Contact in the program: what the table [contact] makes of a run, and how a run ends that would
// have to force bodies through each other.
#include "scene_run.hpp"

#include <taut/contact/barrier.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

namespace {

/// A cube flies at a slab that is held, 0.1 m per step, and bounces.
std::string const bounce = R"(name = "bounce"

[time]
step = 0.01
frames = 12

[[object]]
name = "slab"
shape = { kind = "box", size = [0.3, 2, 2], resolution = 5 }
material = { young = 1e6, poisson = 0.4, density = 1000 }

[[object]]
name = "cube"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
rotate = { axis = [1, 2, 3], angle = 25 }
translate = [1.4, 0, 0]
velocity = { linear = [-10, 0, 0] }
material = { young = 1e6, poisson = 0.4, density = 1000 }

[[pin]]
name = "hold"
object = "slab"
select = { side = "x_min" }

[contact]
)";

struct ContactRun : SceneRun {
  explicit ContactRun(std::string const& text, std::vector<std::string> overrides = {})
      : SceneRun("scene.toml", text, std::move(overrides), CheckRun::every_iteration) {}
};

}  // namespace

TEST_CASE("with [contact] a cube that flies at a slab bounces off", "[contact]") {
  std::string const precision = GENERATE("fp64", "mixed", "fp32");
  CAPTURE(precision);
  ContactRun run(bounce, {"solver.precision=" + precision});
  CHECK(run_command(run.options) == 0);
  auto const summary = run.summary();
  CHECK(summary.at("ended") == "finished");
  CHECK(summary.at("steps_converged") == 12);
  CHECK(summary.at("most_contacts") > 3);
  CHECK(summary.at("smallest_gap") > 1e-3);
  CHECK(summary.at("smallest_gap") < 0.9);
  auto const report = run.report();
  REQUIRE(report.size() == 12);
  CHECK(report.front().at("contacts") == 0);
  CHECK(check_command(run.options.out) == 0);
}

TEST_CASE("every policy of contact runs by its name", "[contact]") {
  auto const others =
      GENERATE(std::vector<std::string>{"contact.barrier=ipc"},
               std::vector<std::string>{"contact.barrier=log_squared"},
               std::vector<std::string>{"contact.barrier=cubic"},
               std::vector<std::string>{"contact.curvature=truncated"},
               std::vector<std::string>{"contact.curvature=exact"},
               std::vector<std::string>{"contact.mollifier=false"},
               std::vector<std::string>{"contact.search=spatial_hash"},
               std::vector<std::string>{"contact.search=brute_force"},
               std::vector<std::string>{"contact.bound=closing"},
               std::vector<std::string>{"contact.stiffness=given", "contact.pressure=1e5"},
               std::vector<std::string>{"contact.stiffness=ipc_adaptive"},
               std::vector<std::string>{"solver.method=newton"},
               std::vector<std::string>{"solver.method=newton", "solver.hessian=matrix_free"},
               std::vector<std::string>{"solver.method=newton", "solver.hessian=direct"},
               std::vector<std::string>{"solver.method=lbfgs"},
               std::vector<std::string>{"solver.preconditioner=schwarz_32"},
               std::vector<std::string>{"contact.dhat=0.05"});
  CAPTURE(others);
  ContactRun run(bounce, others);
  run.options.scene.changes.overrides.push_back("time.frames=6");
  CHECK(run_command(run.options) == 0);
  CHECK(run.summary().at("steps_converged") == 6);
  CHECK(run.summary().at("most_contacts") > 0);
}

TEST_CASE("a floor that is a formula has the barrier of the scene", "[contact]") {
  // Under its own weight, 1e4 Pa, a cube rests where the barrier of a layer of 1e5 Pa pushes back.
  std::string const rest = R"(name = "rest"
gravity = [0, -10, 0]

[time]
step = 0.05
frames = 30

[[object]]
name = "cube"
shape = { kind = "box", size = [1, 1, 1], resolution = 1 }
translate = [0, 0.56, 0]
material = { model = "neo_hookean", young = 1e7, poisson = 0, density = 1000 }

[[obstacle]]
name = "floor"
shape = { kind = "half_space" }

[contact]
dhat = 0.05
stiffness = "given"
pressure = 1e5

[solver]
tolerance = 1e-6
)";
  auto const rests_at = [&]<class B>(B) {
    CAPTURE(B::name);
    ContactRun run(rest, {std::string("contact.barrier=") + B::name});
    REQUIRE(run_command(run.options) == 0);
    double const x = run.report().back().at("smallest_gap");
    double const slope = Normalised<B>::slope(RelativeDistance<double>{x, 1 - x, std::log(x)});
    CHECK_THAT(slope, Catch::Matchers::WithinRel(-0.1, 0.02));
  };
  rests_at(LogBarrier());
  rests_at(IpcBarrier());
  rests_at(LogSquaredBarrier());
  rests_at(CubicBarrier());
}

TEST_CASE("the paper's clamp is run as it is, and blamed for what it lets through", "[contact]") {
  std::vector<std::string> const paper{"contact.bound=half_dhat", "contact.curvature=truncated",
                                       "contact.mollifier=false"};
  ContactRun run(bounce, paper);
  run.options.check = CheckRun::off;
  CHECK(run_command(run.options) == 0);
}

TEST_CASE("policies that are not compiled together are refused by name", "[contact]") {
  SECTION("two at a time") {
    ContactRun run(bounce, {"contact.barrier=ipc", "contact.search=spatial_hash"});
    CHECK_THROWS_MATCHES(
        run_command(run.options), Error,
        MessageMatches(ContainsSubstring(
            "barrier = \"ipc\" and search = \"spatial_hash\" are not compiled together")));
  }
  SECTION("in another precision") {
    ContactRun run(bounce, {"contact.barrier=ipc", "solver.precision=mixed"});
    CHECK_THROWS_MATCHES(
        run_command(run.options), Error,
        MessageMatches(ContainsSubstring("barrier = \"ipc\" is compiled for fp64 alone")));
  }
  SECTION("a stiffness that is not given") {
    ContactRun run(bounce, {"contact.stiffness=given"});
    CHECK_THROWS_MATCHES(run_command(run.options), Error,
                         MessageMatches(ContainsSubstring("needs a pressure")));
  }
  SECTION("a distance of contact beyond a body") {
    ContactRun run(bounce, {"contact.dhat=1.9"});
    CHECK_THROWS_MATCHES(run_command(run.options), Error,
                         MessageMatches(ContainsSubstring("contact begins to act at 1.9 m") &&
                                        ContainsSubstring("object cube is only 1.") &&
                                        ContainsSubstring("reduce contact.dhat")));
  }
}

TEST_CASE("more motions than contact keeps apart are refused", "[contact]") {
  auto const scene = [](int moving) {
    std::string text =
        replaced(plain_scene, "resolution = 2 }",
                 "resolution = 1 }\ncopies = { count = [255, 1, 1], step = [2, 0, 0] }");
    text += "[contact]\n";
    for (int k = 0; k < moving; ++k) {
      text += fmt::format(
          "[[pin]]\nname = \"p{0}\"\nobject = \"cube-{0}\"\nselect = {{ side = \"y_max\" }}\n"
          "motion = [{{ name = \"up\", velocity = [0, 0.1, 0] }}]\n",
          k);
    }
    return text;
  };
  ContactRun most(scene(254), {"time.frames=1"}), more(scene(255), {"time.frames=1"});
  CHECK(run_command(most.options) == 0);
  CHECK_THROWS_MATCHES(
      run_command(more.options), Error,
      MessageMatches(ContainsSubstring("255 pins and 0 obstacles") &&
                     ContainsSubstring("no more than 254") && ContainsSubstring("make one pin")));
}

TEST_CASE("with contact, a scene that starts intersecting is refused", "[contact]") {
  ContactRun run(replaced(bounce, "[1.4, 0, 0]", "[0.5, 0, 0]"));
  run.options.check = CheckRun::off;
  CHECK_THROWS_MATCHES(run_command(run.options), Error,
                       MessageMatches(ContainsSubstring("the scene starts with ") &&
                                      ContainsSubstring(" of cube with slab); the first: ") &&
                                      ContainsSubstring("object.NAME.translate")));
}

TEST_CASE("a run with contact goes on bitwise after a restart", "[contact]") {
  ContactRun whole(bounce), parts(bounce);
  CHECK(run_command(whole.options) == 0);
  parts.options.scene.changes.overrides = {"time.frames=5"};
  CHECK(run_command(parts.options) == 0);
  parts.options.scene.changes.overrides = {};
  parts.options.restart = true;
  CHECK(run_command(parts.options) == 0);
  auto const a = whole.report(), b = parts.report();
  REQUIRE(a.size() == b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    CAPTURE(k);
    for (char const* key : {"iterations", "energy_change", "contacts", "smallest_gap"}) {
      CHECK(a[k].at(key) == b[k].at(key));
    }
  }
}

TEST_CASE("pins that force bodies through each other end the run, which names them", "[contact]") {
  bool const wholly = GENERATE(false, true);
  CAPTURE(wholly);
  std::string const press = R"(
[[pin]]
name = "press"
object = "cube"
select = )" + std::string(wholly ? "\"all\"" : "{ side = \"x_max\" }") +
                            R"(
motion = [{ name = "push", start = 0, end = 10, velocity = [-8, 0, 0] }]
)";
  std::string text = replaced(bounce, "select = { side = \"x_min\" }", "select = \"all\"");
  text = replaced(text, "rotate = { axis = [1, 2, 3], angle = 25 }\n", "");
  ContactRun run(replaced(text, "\n[contact]", press + "\n[contact]"),
                 {"time.frames=40", "object.cube.velocity.linear=[0,0,0]"});
  try {
    run_command(run.options);
    FAIL("the run came to its end");
  } catch (Error const& error) {
    CHECK_THAT(error.what(),
               ContainsSubstring("what moves by script (pin.hold, pin.press) is held up by ") &&
                   ContainsSubstring(" touch, vert") && ContainsSubstring(" of cube"));
    // What is squashed touches itself first.
    if (wholly) CHECK_THAT(error.what(), ContainsSubstring(" of slab"));
  }
  CHECK(run.summary().at("ended") == "stopped by an error");
  int const frames = run.summary().at("frames");
  CHECK(frames >= 5);
  CHECK(run.report().size() == std::size_t(frames));
  CHECK(std::filesystem::exists(run.options.out / "checkpoint.h5"));
  if (wholly) CHECK(check_command(run.options.out) == 0);
}
