#include "support/data.hpp"

#include <catch2/catch_test_macros.hpp>
#include <nlohmann/json.hpp>
#include <taut/core/io/file.hpp>

#include <cstdlib>

namespace taut::test {

std::filesystem::path data_file(std::string const& relative) {
  char const* directory = std::getenv("TAUT_DATA_DIR");
  if (directory == nullptr ||
      !std::filesystem::exists(std::filesystem::path(directory) / relative)) {
    SKIP("needs " << relative << " in TAUT_DATA_DIR");
  }
  return std::filesystem::path(directory) / relative;
}

nlohmann::json parse_json(std::string const& text) { return nlohmann::json::parse(text); }

nlohmann::json read_json(std::filesystem::path const& file) { return parse_json(read_file(file)); }

nlohmann::json vectors(std::string const& key) {
  return read_json(data_file("vectors/pncg_vectors.json")).at(key);
}

nlohmann::json hot_vectors(std::string const& key) {
  return read_json(data_file("vectors/hot_vectors.json")).at(key);
}

}  // namespace taut::test
