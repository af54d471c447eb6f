// The shared data of the tests: found through the environment variable TAUT_DATA_DIR.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

namespace taut::test {

/// Path of a data file; skips the running test with a message where the data are absent.
std::filesystem::path data_file(std::string const& relative);

/// The parser is compiled once, here.
nlohmann::json parse_json(std::string const& text);
nlohmann::json read_json(std::filesystem::path const& file);

nlohmann::json vectors(std::string const& key);
/// Of the material point method.
nlohmann::json hot_vectors(std::string const& key);

}  // namespace taut::test
