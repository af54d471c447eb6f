// The shared data of the tests: found through the environment variable TAUT_DATA_DIR.
#pragma once

#include <catch2/catch_test_macros.hpp>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace taut::test {

/// Path of a data file; skips the running test with a message where the data are absent.
inline std::filesystem::path data_file(std::string const& relative) {
  char const* directory = std::getenv("TAUT_DATA_DIR");
  if (directory == nullptr ||
      !std::filesystem::exists(std::filesystem::path(directory) / relative)) {
    SKIP("needs " << relative << " in TAUT_DATA_DIR");
  }
  return std::filesystem::path(directory) / relative;
}

inline nlohmann::json vectors(std::string const& key) {
  return nlohmann::json::parse(std::ifstream(data_file("vectors/pncg_vectors.json"))).at(key);
}

/// Of the material point method.
inline nlohmann::json hot_vectors(std::string const& key) {
  return nlohmann::json::parse(std::ifstream(data_file("vectors/hot_vectors.json"))).at(key);
}

}  // namespace taut::test
