#include <taut/apps/chart/table.hpp>

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <sstream>

namespace taut {
namespace {

using Json = nlohmann::ordered_json;

Json value_of(std::string const& text) {
  if (text.empty()) return nullptr;
  char* end = nullptr;
  double const number = std::strtod(text.c_str(), &end);
  if (end != text.c_str() + text.size()) return text;
  if (text.find_first_of(".eEn") == std::string::npos) return std::stoll(text);
  return number;
}

/// Of rows first to last (excluded), which are the iterations of one method.
Json summary(Json const& rows, std::size_t first, std::size_t last, Json const& facts) {
  double const target = facts["target"].get<double>();
  Json result;
  for (char const* key : {"scene", "frame", "method"}) result[key] = rows[first][key];
  result["ended"] = rows[last - 1]["ended"];
  result["last_error"] = rows[last - 1]["position_error"];
  std::size_t reached = last;
  auto const below = [&](Json const& error) {
    return error.is_number() && error.get<double>() <= target;
  };
  while (reached > first && below(rows[reached - 1]["position_error"])) --reached;
  for (char const* key : {"iterations_to_target", "seconds_to_target", "frames_per_second"})
    result[key] = nullptr;
  if (facts.contains("residual")) {
    double const tolerance = facts["residual"].get<double>();
    result["last_residual"] = rows[last - 1]["residual"];
    for (char const* key : {"iterations_to_residual", "seconds_to_residual"}) result[key] = nullptr;
    for (std::size_t k = first; k < last; ++k) {
      if (!rows[k]["residual"].is_number() || rows[k]["residual"].get<double>() >= tolerance) {
        continue;
      }
      result["iterations_to_residual"] = rows[k]["iteration"];
      result["seconds_to_residual"] = rows[k]["seconds"];
      break;
    }
  }
  if (reached == last) return result;
  result["iterations_to_target"] = rows[reached]["iteration"];
  result["seconds_to_target"] = rows[reached]["seconds"];
  if (rows[reached]["seconds"].is_number())
    result["frames_per_second"] = 1 / rows[reached]["seconds"].get<double>();
  return result;
}

}  // namespace

std::vector<std::string> split_row(std::string const& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    char const c = line[k];
    if (c == '"' && quoted && line.substr(k + 1, 1) == "\"") {  // two stand for one
      fields.back() += c;
      ++k;
    } else if (c == '"' && (quoted || fields.back().empty())) {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::string to_json(std::string const& table) {
  Json facts = Json::object(), rows = Json::array();
  std::istringstream text(table);
  std::vector<std::string> names;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("# ")) {
      std::size_t const at = line.find(" = ");
      std::string const name = line.substr(2, at - 2);
      Json const value = value_of(line.substr(at + 3));
      if (name == "with" || name == "left_out") {  // any number of them
        facts[name].push_back(value);
      } else {
        facts[name] = value;
      }
    } else if (names.empty()) {
      names = split_row(line);
    } else {
      std::vector<std::string> const fields = split_row(line);
      Json row;
      for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = value_of(fields[i]);
      rows.push_back(row);
    }
  }
  Json chart{{"facts", facts}};
  if (facts["kind"] == "comparison") {
    Json methods = Json::array();
    for (std::size_t first = 0, last; first < rows.size(); first = last) {
      last = first + 1;
      while (last < rows.size() && rows[last]["iteration"].get<int>() > 1) ++last;
      methods.push_back(summary(rows, first, last, facts));
    }
    chart["methods"] = methods;
  }
  chart["rows"] = rows;
  return chart.dump(1) + "\n";
}

}  // namespace taut
