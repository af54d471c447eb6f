#include <taut/apps/bench/hot.hpp>
#include <taut/apps/bench/process.hpp>
#include <taut/apps/bench/table.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace taut {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(HotRow, cycle, kernel, per, level, threads, cells, particles,
                                   nodes, ns, bytes, flops, fraction, held)

nlohmann::json to_json(std::vector<HotRow> const& rows) {
  nlohmann::json list = nlohmann::json::array();
  for (HotRow const& row : rows) list.push_back(row);
  return list;
}
std::vector<HotRow> hot_rows(nlohmann::json const& list) { return list.get<std::vector<HotRow>>(); }

namespace {

using Rows = std::vector<HotRow>;
constexpr int width = 20;

bool same_line(HotRow const& a, HotRow const& b) {
  return a.threads == b.threads && a.cycle == b.cycle && a.kernel == b.kernel && a.per == b.per &&
         a.level == b.level;
}

/// "132.4 (12%)", in ns, or in us where that is shorter to read.
std::string cost(HotRow const& row) {
  std::string text =
      row.ns < 1e4 ? fmt::format("{:.1f} ns", row.ns) : fmt::format("{:.1f} us", row.ns / 1000);
  if (row.fraction > 0) text += fmt::format(" ({:.0f}%)", 100 * row.fraction);
  return text;
}

std::string title(HotRow const& row) {
  std::string text = row.cycle.empty() ? row.kernel : row.cycle + ' ' + row.kernel;
  if (row.level > 0 || row.kernel == "smoother") text += fmt::format(", level {}", row.level);
  return text + " per " + row.per;
}

/// The lines of one number of threads, in the order of their rows; a column per size.
std::string lines(Rows const& rows, int threads, std::vector<int> const& sizes) {
  std::string text;
  Rows done;
  for (HotRow const& row : rows) {
    auto const same = [&](HotRow const& other) { return same_line(row, other); };
    if (row.threads != threads || std::any_of(done.begin(), done.end(), same)) continue;
    done.push_back(row);
    std::string held = fmt::format("{:<36}", row.cycle + " held per fine node");
    text += fmt::format("{:<36}", title(row));
    for (int cells : sizes) {
      auto const found = std::find_if(rows.begin(), rows.end(), [&](HotRow const& other) {
        return same(other) && other.cells == cells;
      });
      text += fmt::format("{:>{}}", found != rows.end() ? cost(*found) : "-", width);
      held += fmt::format(
          "{:>{}}", found != rows.end() ? fmt::format("{:.2f} kB", found->held / 1e3) : "-", width);
    }
    text += '\n';
    if (row.kernel == "hierarchy") text += held + '\n';
  }
  return text;
}

}  // namespace

std::string hot_tables(Rows const& rows, std::vector<MachineRates> const& machines) {
  std::string text = machine_table(machines);
  text += "\nfp64; in brackets the share of the smaller limit of memory and arithmetic\n";
  std::vector<int> sizes;
  for (HotRow const& row : rows)
    if (std::find(sizes.begin(), sizes.end(), row.cells) == sizes.end()) sizes.push_back(row.cells);
  for (MachineRates const& machine : machines) {
    text += fmt::format(
        "\n{:<36}", fmt::format("{} thread{}", machine.threads, machine.threads == 1 ? "" : "s"));
    for (int cells : sizes) text += fmt::format("{:>{}}", fmt::format("{}^3 cells", cells), width);
    text += '\n' + lines(rows, machine.threads, sizes);
  }
  return text;
}

int bench_hot_command(HotBenchOptions const& asked) {
  HotBenchOptions options = asked;
  if (options.quick) {  // what the user has named stays
    HotBenchOptions const defaults;
    if (options.cells == defaults.cells) options.cells = {10};
    if (options.seconds == defaults.seconds) options.seconds = 0.02;
  }
  for (int cells : options.cells)
    if (cells < 4 || cells > 256) throw Error("--cells {}: it must be 4 to 256", cells);
  if (!(options.seconds > 0)) throw Error("--seconds {}: it must be above 0", options.seconds);
  Rows rows;
  std::vector<MachineRates> machines;
  for (int threads : bench_threads(options.threads)) {
    auto const measure = [&](MachineRates const& machine) {
      return to_json(measure_hot(options, machine));
    };
    Rows const measured = hot_rows(
        measure_in_process(threads, options.seconds, "--cells", measure, machines.emplace_back()));
    rows.insert(rows.end(), measured.begin(), measured.end());
  }
  fmt::print("{}", options.json ? to_json(rows).dump(1) + "\n" : hot_tables(rows, machines));
  return 0;
}

}  // namespace taut
