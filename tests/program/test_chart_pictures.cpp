// Which frames of a result are drawn.
#include <taut/apps/program/render.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

TEST_CASE("frames to draw are named by number or as the last", "[render]") {
  using Frames = std::vector<int>;
  CHECK(resolve_frames({}, 101) == Frames{0, 50, 100});
  CHECK(resolve_frames({}, 1) == Frames{0});
  CHECK(resolve_frames({"10", "0", "last", "10"}, 21) == Frames{0, 10, 20});
  for (std::string const bad : {"21", "-1", "1.5", "", "end", "99999999999"}) {
    CAPTURE(bad);
    CHECK_THROWS_MATCHES(resolve_frames({bad}, 21), Error,
                         MessageMatches(ContainsSubstring("0 to 20")));
  }
  CHECK_THROWS_AS(resolve_frames({}, 0), Error);
}

TEST_CASE("options of render are checked before anything is drawn", "[render]") {
  test::ScratchFolder const folder;
  RenderOptions options;
  options.result = folder.write("result.vtkhdf", "no result");
  options.colour = "sped";
  CHECK_THROWS_MATCHES(render_command(options), Error,
                       MessageMatches(ContainsSubstring("object, speed, displacement")));
  options.colour = "speed";
  options.animation = "avi";
  CHECK_THROWS_MATCHES(render_command(options), Error,
                       MessageMatches(ContainsSubstring("gif, mp4, none")));
  options.animation = "gif";
  CHECK_THROWS_AS(render_command(options), Error);  // what is there is no result
}
