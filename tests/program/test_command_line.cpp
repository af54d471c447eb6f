// The command line of the program itself: what it takes, and what it says to what it does not.
#include "command_line.hpp"

#include <taut/apps/program/command_line.hpp>
#include <taut/core/io/file.hpp>

#include <Kokkos_Core.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <new>

using Catch::Matchers::ContainsSubstring;
using namespace taut;
using test::says;
using test::taut_with;

TEST_CASE("options do not swallow the scene after them", "[cli]") {
  test::ScratchFolder const folder;
  std::string const scene = folder.write("plain.toml", test::plain_scene).string();
  says("plan --set time.frames=2 --set gravity=[0,0,0] " + scene, 0, "no body force");
  says("plan " + scene + " --set solver.method=newton --set solver.tolerance=1e-4", 0, "newton");
  says("chart --methods dk,newtom " + scene, 1, "did you mean \"newton\"?");
  says("render --frames 0,last " + scene + ".none", 1, "no such result");
}

TEST_CASE("mistakes are answered by the nearest word, if any is near", "[cli]") {
  says("rnu drag", 1, "there is no command \"rnu\": did you mean \"run\"?");
  says("dance", 1, "there is no command \"dance\"; `taut --help`");
  says("plan dragg", 1, "the nearest is \"drag\"");
  says("plan elephant", 1, "this name; `taut scenes`");
  says("plan --smal drag", 1, "`taut plan` has no option --smal: did you mean --small?");
  says("plan drag --resoluton=2", 1, "no option --resoluton: did you mean --resolution?");
  says("--versio", 1, "`taut` has no option --versio: did you mean --version?");
  says("plan drag --elephant 3", 1, "no option --elephant; `taut plan --help` lists them");
  says("plan drag one more", 1, "\"one\" is a word too many for `taut plan`; `taut plan --help`");
}

#ifdef NDEBUG  // the address sanitizer ends a program that asks for so much
TEST_CASE("what does not fit into memory is answered by the mend", "[cli]") {
  test::ScratchFolder const folder;
  auto const said = folder.path() / "said";
  // Kokkos throws something of its own, not std::bad_alloc.
  for (bool const kokkos : {true, false}) {
    std::fflush(stderr);
    int const terminal = ::dup(2), file = ::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    ::dup2(file, 2);
    int const status = ending_in_words([&]() -> int {
      if (!kokkos) throw std::bad_alloc();
      return int(Kokkos::View<double*>("too_much", std::size_t(1) << 55).extent(0));
    });
    std::fflush(stderr);
    ::dup2(terminal, 2);
    ::close(terminal);
    ::close(file);
    CHECK(status == 1);
    std::string const text = read_file(said);
    CHECK_THAT(text, ContainsSubstring("taut: out of memory: lower the resolution"));
    CHECK(std::count(text.begin(), text.end(), '\n') == 1);
    CHECK((text.find("too_much") != text.npos) == kokkos);
  }
}
#endif

TEST_CASE("help has the program's name and an example everywhere", "[cli]") {
  says("--help", 0, "example: taut run");
  says("--version", 0, "taut 0.");
  for (std::string const command : {"run", "scenes", "methods", "check", "plan", "chart", "render",
                                    "bench", "bench elastic", "bench contact", "bench hot"}) {
    says(command + " --help", 0, "Usage: taut " + command);
    says(command + " --help", 0, "example: taut " + command);
  }
}

TEST_CASE("what the first program leaves out is found in the whole one", "[cli]") {
  test::ScratchFolder const folder;
  std::string const scene = folder.write("plain.toml", test::plain_scene).string();
  for (std::string const part : {"precision=mixed", "precision=fp32", "curvature=limit"}) {
    auto const out = folder.path() / part;
    says("run " + scene + " --frames 1 --set solver." + part + " --out " + out.string(), 0,
         "steps 1 to 1");
    CHECK(std::filesystem::exists(out / "result.vtkhdf"));
  }
}

TEST_CASE("without the whole program, or with a build that fails, it is named", "[cli]") {
  test::ScratchFolder const folder;
  std::string const scene = folder.write("plain.toml", test::plain_scene).string();
  auto const alone = folder.path() / "taut", out = folder.path() / "out";
  std::filesystem::copy(test::program(), alone);
  std::string const run = " run " + scene + " --set solver.precision=mixed --out " + out.string();
  test::Outcome const outcome = test::outcome_of(alone.string() + run);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.text, ContainsSubstring("precision = mixed is of") &&
                               ContainsSubstring("--target taut_whole"));
  CHECK_FALSE(std::filesystem::exists(out));
  test::Outcome const unbuilt = test::outcome_of("TAUT_BUILD=false " + alone.string() + run);
  CHECK(unbuilt.status == 1);
  CHECK_THAT(unbuilt.text, ContainsSubstring("could not be built"));
}

TEST_CASE("a program that takes over from a bound one has all its processors", "[cli]") {
  // What builds it is started like it, and tells.
  std::string const status = "grep Cpus_allowed: /proc/self/status";
  test::Outcome const own = test::outcome_of(status);
  REQUIRE_THAT(own.text, ContainsSubstring("Cpus_allowed:"));
  test::Outcome const bound = test::outcome_of("OMP_PROC_BIND=true TAUT_BUILD='" + status + ";:' " +
                                               test::program().string() + " bench --help");
  CHECK(bound.status == 0);
  CHECK_THAT(bound.text, ContainsSubstring(own.text));
}

TEST_CASE("scenes go on past a broken file", "[cli]") {
  test::ScratchFolder const folder;
  auto const broken = folder.write("broken.toml", "[[=");
  folder.write("mine.toml", "description = \"a scene of my own\"\n");
  ::setenv("TAUT_SCENES_DIR", broken.parent_path().c_str(), 1);
  says("scenes", 1, "a scene of my own");
  says("scenes", 1, "broken.toml");
  ::unsetenv("TAUT_SCENES_DIR");
  says("scenes", 0, "drag_armadillo");
}

TEST_CASE("methods lists every key with its default, and the materials", "[cli]") {
  for (char const* part : {"solver.tolerance = 0.001", "solver.safeguard = true", "at most 100",
                           "stable_neo_hookean_2018", "keeps J > 0"})
    says("methods", 0, part);
}

TEST_CASE("a run is restarted or replaced, not both", "[cli]") {
  says("run drag --restart --force", 108, "excludes");
}

TEST_CASE("a table has a dash for what a run does not know", "[cli]") {
  test::ScratchFolder const folder;
  // What is not finite is null.
  auto const result = folder
                          .write("summary.json", R"({"scene": "odd", "frames": 2,
    "frames_asked": 2, "mean_iterations": null, "largest_error_estimate_m": null,
    "smallest_gap": null, "ended": null})")
                          .parent_path();
  test::Outcome const outcome = taut_with("table " + result.string());
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.text, ContainsSubstring("| odd | ") && ContainsSubstring(" | - | - | ? | "));
}

TEST_CASE("plan says what a step ends by", "[cli]") {
  test::ScratchFolder const folder;
  std::string const scene = folder.write("plain.toml", test::plain_scene).string();
  says("plan " + scene, 0, "when the error is estimated to be below");
  says("plan " + scene + " --set solver.stopping=budget", 0, "whatever the error is then");
  says("plan " + scene + " --set solver.stopping=energy_drop", 0, "of what the first one did");
  says("plan twist", 0, "not ended after 400 iterations, a stronger one");
  says("plan twist --set solver.strong_cycle=never", 0, "the same however long a step takes");
  // Edges of 0.5 m, their diagonals in faces: 0.6 m on average.
  says("plan " + scene + " --set contact.friction=0", 0, " m (0.3 of the mean edge");
  says("plan " + scene + " --set contact.dhat=0.01", 0, "barrier below 0.01 m,");
  test::Outcome const quasi_static =
      taut_with("plan " + scene + " --set time.integrator=quasi_static");
  CHECK_THAT(quasi_static.text, !ContainsSubstring("wave") && !ContainsSubstring("m/s"));
}
