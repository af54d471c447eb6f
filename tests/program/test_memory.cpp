// Meshes that are too large are refused from the scene alone.
#include <taut/apps/program/memory.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <cstdlib>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

namespace {

Scene scene_of(std::string const& shape) {
  test::ScratchFolder const folder;
  return load_scene(folder.write(
      "scene.toml", test::replaced(test::plain_scene,
                                   "{ kind = \"box\", size = [1, 1, 1], resolution = 2 }", shape)));
}

void check_close(Scene const& scene) {
  MeshSize const expected = estimate_size(scene), built = size_of(build_geometry(scene));
  CAPTURE(expected.tets, built.tets, expected.vertices, built.vertices);
  CHECK(std::abs(expected.tets - built.tets) < 0.25 * built.tets);
  CHECK(std::abs(expected.vertices - built.vertices) < 0.4 * built.vertices);
}

}  // namespace

TEST_CASE("the size of a mesh is known before it is built", "[memory]") {
  for (char const* shape :
       {"{ kind = 'box', size = [1, 2, 3], resolution = 9 }",
        "{ kind = 'sheet', length = 1, width = 2, thickness = 0.1, resolution = 20 }",
        "{ kind = 'letter_e', depth = 0.5, resolution = 18 }",
        "{ kind = 'cylinder', radius = 1, height = 3, resolution = 6 }",
        "{ kind = 'sphere', radius = 1, resolution = 8 }",
        "{ kind = 'torus', radius = 2, tube_radius = 0.5, resolution = 4 }",
        "{ kind = 'boxes', boxes = [[[0, 0, 0], [4, 1, 1]], [[0, 1, 0], [1, 4, 1]]], resolution = "
        "12 }",
        "{ kind = 'bowl', radius = 1, thickness = 0.3, height = 0.8, resolution = 12 }",
        "{ kind = 'funnel', radius = 1, throat = 0.5, height = 0.8, spout = 0.5, thickness = 0.2, "
        "resolution = 8 }",
        "{ kind = 'tets', points = [[0,0,0], [1,0,0], [0,1,0], [0,0,1]], tets = [[0,1,2,3]], "
        "resolution = 12 }"}) {
    INFO(shape);
    check_close(scene_of(shape));
  }
}

TEST_CASE("so is that of a file", "[memory]") {
  if (std::getenv("TAUT_DATA_DIR") == nullptr) SKIP("needs TAUT_DATA_DIR");
  MeshSize const size = estimate_size(load_scene(test::scene_folder() / "drag_armadillo.toml"));
  CHECK(size.vertices == 13230);
  CHECK(size.tets == 54985);
}

TEST_CASE("a scene beyond all memory is refused at once", "[memory]") {
  CHECK_THROWS_MATCHES(
      build_within_memory(scene_of("{ kind = 'box', size = [1, 1, 1], resolution = 100000 }")),
      Error, MessageMatches(ContainsSubstring("1.2e+16 tets") && ContainsSubstring("resolution")));
}

TEST_CASE("what is free is the least of what the system and control groups leave", "[memory]") {
  test::ScratchFolder const folder;
  std::filesystem::path const root = folder.write("x", "").parent_path();
  CHECK(std::isinf(memory_available(root)));
  write_file_atomically(root / "proc/meminfo", "MemTotal: 9000 kB\nMemAvailable: 4000 kB\n");
  CHECK(memory_available(root) == 4000 * 1024);
  write_file_atomically(root / "proc/self/cgroup", "0::/user/one\n");
  write_file_atomically(root / "sys/fs/cgroup/user/one/memory.max", "max\n");
  write_file_atomically(root / "sys/fs/cgroup/user/one/memory.current", "1000\n");
  CHECK(memory_available(root) == 4000 * 1024);
  write_file_atomically(root / "sys/fs/cgroup/user/memory.max", "3000000\n");
  write_file_atomically(root / "sys/fs/cgroup/user/memory.current", "1000000\n");
  CHECK(memory_available(root) == 2000000);
  write_file_atomically(root / "sys/fs/cgroup/user/memory.stat", "anon 5\ninactive_file 500\n");
  CHECK(memory_available(root) == 2000500);
  // The first version, as seen from within a container.
  write_file_atomically(root / "proc/self/cgroup", "12:cpu:/a\n4:memory:/docker/abc\n");
  write_file_atomically(root / "sys/fs/cgroup/memory/memory.limit_in_bytes", "900000\n");
  write_file_atomically(root / "sys/fs/cgroup/memory/memory.usage_in_bytes", "1000000\n");
  CHECK(memory_available(root) == 0);
}
