// Scenes of the tests: files that live as long as the test, and a small valid scene to spoil.
#pragma once

#include <unistd.h>

#include <catch2/catch_test_macros.hpp>
#include <filesystem>
#include <fstream>
#include <string>

namespace taut::test {

/// A folder of its own that vanishes with the object.
class ScratchFolder {
public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "taut_scene_XXXXXX").string();
    REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ScratchFolder(ScratchFolder const&) = delete;
  ScratchFolder& operator=(ScratchFolder const&) = delete;
  ~ScratchFolder() { std::filesystem::remove_all(path_); }

  std::filesystem::path const& path() const { return path_; }
  std::filesystem::path write(std::string const& name, std::string const& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }

private:
  std::filesystem::path path_;
};

/// The program under test, which is built beside the tests.
inline std::filesystem::path program() {
  auto const path = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "taut";
  INFO("build the target taut_cli");
  REQUIRE(std::filesystem::exists(path));
  return path;
}

inline std::filesystem::path scene_folder() {
  return std::filesystem::path(__FILE__).parent_path() / "../../apps/scenes";
}

inline std::string const plain_scene = R"(name = "plain"
gravity = [0, -10, 0]

[time]
step = 0.01
frames = 4

[[object]]
name = "cube"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[pin]]
name = "floor"
select = { side = "y_min" }
)";

/// The text with the first occurrence of `old` replaced; `old` must be there.
inline std::string replaced(std::string text, std::string const& old, std::string const& by) {
  std::size_t const at = text.find(old);
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), by);
}

}  // namespace taut::test
