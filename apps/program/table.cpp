// `taut table`: the summaries of results side by side, as a table in Markdown.
#include <taut/apps/program/commands.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include <optional>

namespace taut {

namespace {

using Summary = nlohmann::json;

/// None where there is none, or where it is not finite, which is null in a summary.
std::optional<double> number_if_any(Summary const& s, char const* key) {
  auto const found = s.find(key);
  if (found == s.end() || !found->is_number()) return {};
  return found->get<double>();
}
double number(Summary const& s, char const* key) { return number_if_any(s, key).value_or(0); }
std::string number_or_dash(Summary const& s, char const* key, char const* format) {
  auto const found = number_if_any(s, key);
  return found ? fmt::format(fmt::runtime(format), *found) : "-";
}
std::string text(Summary const& s, char const* key) {
  auto const found = s.find(key);
  return found != s.end() && found->is_string() ? found->get<std::string>() : "?";
}
/// What share of the steps `key` counts.
std::string share(Summary const& s, char const* key) {
  double const steps = number(s, "frames");
  return steps > 0 ? fmt::format("{:.3g} %", 100 * number(s, key) / steps) : "-";
}

struct Column {
  char const* title;
  std::string (*cell)(Summary const&);
};

constexpr Column columns[] = {
    {"scene", [](Summary const& s) { return text(s, "scene"); }},
    {"vertices, tets",
     [](Summary const& s) {
       if (s.contains("particles")) {
         return fmt::format("{:.0f} nodes, {:.0f} particles", number(s, "nodes"),
                            number(s, "particles"));
       }
       return fmt::format("{:.0f}, {:.0f}", number(s, "vertices"), number(s, "tets"));
     }},
    {"steps",
     [](Summary const& s) {
       double const done = number(s, "frames"), asked = number(s, "frames_asked");
       return done == asked ? fmt::format("{:.0f}", done)
                            : fmt::format("{:.0f} of {:.0f}", done, asked);
     }},
    {"ended", [](Summary const& s) { return text(s, "ended"); }},
    {"contacts, mean (max)",
     [](Summary const& s) {
       if (!s.contains("mean_contacts")) return std::string("no contact");
       return fmt::format("{:.0f} ({:.0f})", number(s, "mean_contacts"),
                          number(s, "most_contacts"));
     }},
    {"iterations",
     [](Summary const& s) { return fmt::format("{:.1f}", number(s, "mean_iterations")); }},
    {"converged", [](Summary const& s) { return share(s, "steps_converged"); }},
    {"cut", [](Summary const& s) { return share(s, "steps_cut"); }},
    {"smallest gap / dhat",
     [](Summary const& s) { return number_or_dash(s, "smallest_gap", "{:.2g}"); }},
    {"error, m",
     [](Summary const& s) { return number_or_dash(s, "largest_error_estimate_m", "{:.1e}"); }},
    {"intersections", [](Summary const& s) { return text(s, "intersections"); }},
    {"inverted, steps",
     [](Summary const& s) {
       return fmt::format("{:.0f}", number(s, "steps_with_inverted_elements"));
     }},
    {"s per step",
     [](Summary const& s) {
       double const steps = number(s, "frames");
       return steps > 0 ? fmt::format("{:.3g}", number(s, "seconds") / steps) : "-";
     }},
};

Summary read_summary(std::filesystem::path const& result) {
  std::filesystem::path const file = result / "summary.json";
  if (!std::filesystem::exists(file)) {
    throw Error("{}: the folder holds no summary.json; name folders that `taut run` wrote",
                result.string());
  }
  Summary const summary = Summary::parse(read_file(file), nullptr, false);
  if (!summary.is_object()) throw Error("{}: this is no summary of a run", file.string());
  return summary;
}

}  // namespace

int table_command(std::vector<std::filesystem::path> const& results) {
  std::vector<Summary> summaries;
  for (auto const& result : results) summaries.push_back(read_summary(result));
  std::vector<std::string> cells;
  for (Column const& column : columns) cells.emplace_back(column.title);
  fmt::print("| {} |\n", fmt::join(cells, " | "));
  fmt::print("|{}\n", fmt::join(std::vector<std::string>(cells.size(), "---|"), ""));
  for (Summary const& summary : summaries) {
    cells.clear();
    for (Column const& column : columns) cells.push_back(column.cell(summary));
    fmt::print("| {} |\n", fmt::join(cells, " | "));
  }
  return 0;
}

}  // namespace taut
