#include <taut/apps/bench/table.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace taut {
namespace {

using Rows = std::vector<BenchRow>;

/// The row that differs from `like` in kernel and threads alone; null if there is none.
BenchRow const* find(Rows const& rows, BenchRow const& like, std::string_view kernel, int threads) {
  auto const found = std::find_if(rows.begin(), rows.end(), [&](BenchRow const& r) {
    return r.material == like.material && r.precision == like.precision && r.tets == like.tets &&
           r.kernel == kernel && r.threads == threads;
  });
  return found == rows.end() ? nullptr : &*found;
}

/// "12.3 (45%)"
std::string cell(BenchRow const* row) {
  return row ? fmt::format("{:.2f} ({:.0f}%)", row->ns_per_tet, 100 * row->fraction) : "-";
}

/// Bytes and flops at the largest mesh.
std::string counts_table(Rows const& rows) {
  std::string text =
      "\ncounted per tet            gradient+diagonal             p'Hp        iteration\n";
  int largest = 0;
  for (BenchRow const& row : rows) largest = std::max(largest, row.tets);
  for (BenchRow const& row : rows) {
    bool const first =
        row.kernel == "iteration" && row.tets == largest && row.threads == rows.front().threads;
    if (!first) continue;
    text += fmt::format("{:<24}{:<5}", row.material, row.precision);
    for (char const* kernel : {"gradient", "quadratic_form", "iteration"}) {
      BenchRow const& r = *find(rows, row, kernel, row.threads);
      text += fmt::format("{:>6.0f} B {:>4.0f} fl", r.bytes, r.flops);
    }
    text += '\n';
  }
  return text;
}

std::string elastic_table(Rows const& rows) {
  std::string text = fmt::format(
      "\nns per tet (share of the smaller "
      "limit)\n{:<24}{:<6}{:>9}{:>8}{:>15}{:>15}{:>16}{:>10}{:>9}"
      "{:>8}{:>12}{:>8}\n",
      "material", "", "tets", "threads", "gradient+diag", "p'Hp", "iteration", "Mtets/s",
      "speed-up", "held B", "resident B", "allocs");
  int tets = 0;
  for (BenchRow const& row : rows) {
    if (row.kernel != "iteration") continue;
    if (tets != row.tets && tets != 0) text += '\n';
    tets = row.tets;
    BenchRow const* alone = find(rows, row, "iteration", 1);
    bool const faster = alone != nullptr && row.threads > 1;
    text += fmt::format(
        "{:<24}{:<6}{:>9}{:>8}{:>15}{:>15}{:>16}{:>10.2f}{:>9}{:>8.0f}{:>12.0f}{:>8}\n",
        row.material, row.precision, row.tets, row.threads,
        cell(find(rows, row, "gradient", row.threads)),
        cell(find(rows, row, "quadratic_form", row.threads)), cell(&row), 1e3 / row.ns_per_tet,
        faster ? fmt::format("{:.2f}", alone->ns_per_tet / row.ns_per_tet) : "", row.held,
        row.resident, row.allocations);
  }
  return text;
}

/// Each pair: the library's choice, and what it is compared with.
std::string variants_table(Rows const& rows) {
  struct Pair {
    char const *title, *ours, *other;
  };
  constexpr Pair pairs[] = {
      {"sums in a fixed order, against any", "dots", "dots_free"},
      {"forces gathered in order, against atomics", "gradient", "gradient_atomic"},
      {"p'Hp in cache: SIMD packs, against a loop", "quadratic_pack", "quadratic_loop"}};
  std::string text =
      fmt::format("\nchoices, ns per tet{:>36}{:>12}{:>10}\n", "ours", "other", "ours/other");
  for (Pair const& pair : pairs) {
    for (BenchRow const& row : rows) {
      if (row.kernel != pair.other) continue;
      BenchRow const* ours = find(rows, row, pair.ours, row.threads);
      if (ours == nullptr) continue;
      text += fmt::format("{:<42}{:<6}{} thr{:>9.3f}{:>12.3f}{:>10.2f}\n", pair.title,
                          row.precision, row.threads, ours->ns_per_tet, row.ns_per_tet,
                          ours->ns_per_tet / row.ns_per_tet);
    }
  }
  return text;
}

}  // namespace

std::string machine_table(std::vector<MachineRates> const& machines) {
  std::string text = "machine        triad GB/s   fma fp32 GFLOP/s   fma fp64 GFLOP/s\n";
  for (MachineRates const& m : machines) {
    text += fmt::format("{:>2} thread{}   {:>12.1f} {:>18.1f} {:>18.1f}\n", m.threads,
                        m.threads == 1 ? " " : "s", m.triad, m.fma32, m.fma64);
  }
  return text;
}

std::string bench_tables(Rows const& rows, std::vector<MachineRates> const& machines) {
  return machine_table(machines) + counts_table(rows) + elastic_table(rows) + variants_table(rows);
}

}  // namespace taut
