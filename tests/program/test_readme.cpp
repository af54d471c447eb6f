// The README's example is the one that a stranger's project is tested with.
#include <taut/core/io/file.hpp>

#include "scene_text.hpp"

using namespace taut;

TEST_CASE("README's code is that of tests/package/stranger", "[docs]") {
  std::filesystem::path const root = test::scene_folder() / "../..";
  std::string const readme = read_file(root / "README.md");
  std::string const source = read_file(root / "tests/package/stranger/main.cpp");
  std::string const fence = "```cpp\n";
  std::size_t const begin = readme.find(fence);
  REQUIRE(begin != std::string::npos);
  std::size_t const end = readme.find("```", begin + fence.size());
  REQUIRE(end != std::string::npos);
  std::string const code = readme.substr(begin + fence.size(), end - begin - fence.size());
  // The source has a line of its own above it.
  CHECK(source.substr(source.find('\n') + 1) == code);
}
