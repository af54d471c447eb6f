// Charts of small scenes, and their data as tests read it.
#pragma once

#include <taut/apps/chart/table.hpp>
#include <taut/core/io/file.hpp>

#include <map>
#include <sstream>

#include "scene_text.hpp"

namespace taut::test {

using Row = std::map<std::string, std::string>;

struct Data {
  std::string header;
  std::vector<Row> rows;
  std::vector<Row> of(std::string const& method) const { return where("method", method); }
  std::vector<Row> where(std::string const& column, std::string const& value) const {
    std::vector<Row> mine;
    for (Row const& row : rows)
      if (row.at(column) == value) mine.push_back(row);
    return mine;
  }
};

inline Data read_data(std::filesystem::path const& file) {
  Data data;
  std::istringstream text(read_file(file));
  std::vector<std::string> names;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("# ")) {
      data.header += line + "\n";
    } else if (names.empty()) {
      names = split_row(line);
    } else {
      std::vector<std::string> const fields = split_row(line);
      REQUIRE(fields.size() == names.size());
      Row row;
      for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields[i];
      data.rows.push_back(row);
    }
  }
  return data;
}

inline double number(Row const& row, std::string const& name) { return std::stod(row.at(name)); }

inline ChartOptions options_for(ScratchFolder const& folder, std::string const& scene) {
  ChartOptions options;
  options.scene.scene = folder.write("scene.toml", scene).string();
  options.out = std::filesystem::path(options.scene.scene).parent_path() / "chart";
  options.frames = {2};
  options.repetitions = 1;
  options.draw = false;
  return options;
}

inline Data chart(ChartOptions const& options) {
  REQUIRE(chart_command(options) == 0);
  return read_data(options.out / "data.csv");
}

}  // namespace taut::test
