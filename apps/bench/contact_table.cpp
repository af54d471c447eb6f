#include <taut/apps/bench/contact.hpp>
#include <taut/apps/bench/table.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace taut {
namespace {

using Rows = std::vector<ContactRow>;
constexpr int width = 26;

struct Block {
  std::string precision;
  int threads;
};

ContactRow const* find(Rows const& rows, Block const& block, int asked, std::string_view kernel) {
  auto const found = std::find_if(rows.begin(), rows.end(), [&](ContactRow const& r) {
    return r.precision == block.precision && r.threads == block.threads && r.asked == asked &&
           r.kernel == kernel;
  });
  return found == rows.end() ? nullptr : &*found;
}

/// Every value of a member once, in the order of the rows.
template <class T>
std::vector<T> values(Rows const& rows, T ContactRow::*member) {
  std::vector<T> list;
  for (ContactRow const& row : rows)
    if (std::find(list.begin(), list.end(), row.*member) == list.end()) list.push_back(row.*member);
  return list;
}

/// A line of what `cell` makes of the row of a kernel at each size.
template <class Cell>
std::string line(Rows const& rows, Block const& block, std::string_view title,
                 std::string_view kernel, Cell const& cell) {
  std::string text = fmt::format("{:<26}", title);
  for (int asked : values(rows, &ContactRow::asked)) {
    ContactRow const* row = find(rows, block, asked, kernel);
    text += fmt::format("{:>{}}", row ? cell(*row) : "-", width);
  }
  return text + '\n';
}

/// "4.2 | 12.3 (45%)"
std::string cost(ContactRow const& row) {
  bool const search = row.kernel.starts_with("search");
  double const ns = 1e9 * row.seconds;
  std::string text =
      fmt::format("{:.1f} | {:.1f}", ns / (search ? row.candidates : row.kept), ns / row.contacts);
  if (row.fraction > 0) text += fmt::format(" ({:.0f}%)", 100 * row.fraction);
  return text;
}

std::string block_table(Rows const& rows, Block const& block) {
  auto const counted = [](int ContactRow::*member) {
    return [member](ContactRow const& row) { return fmt::format("{}", row.*member); };
  };
  auto const with = [&](std::string_view title, std::string_view kernel, auto const& cell) {
    return line(rows, block, title, kernel, cell);
  };
  std::string text = fmt::format("\n{}, {} thread{}\n", block.precision, block.threads,
                                 block.threads == 1 ? "" : "s");
  text += with("contacts", "iteration", counted(&ContactRow::contacts));
  text += with("candidates kept", "iteration", counted(&ContactRow::kept));
  text += with("candidates by boxes", "iteration", counted(&ContactRow::candidates));
  text += with("tets", "iteration", counted(&ContactRow::tets));
  for (std::string const& kernel : values(rows, &ContactRow::kernel))
    text += with(kernel, kernel, cost);
  text += with("tets in an iteration, ns", "iteration", [](ContactRow const& row) {
    return fmt::format("{:.1f}", 1e9 * row.seconds / row.tets);
  });
  text += with("full searches per iteration", "iteration",
               [](ContactRow const& row) { return fmt::format("{:.2f}", row.searches); });
  text += with("share search + bound", "iteration", [](ContactRow const& row) {
    return fmt::format("{:.0f}% + {:.0f}%", 100 * row.search_share, 100 * row.bound_share);
  });
  if (block.threads > 1) {
    text += with("speed-up of an iteration", "iteration", [&](ContactRow const& row) {
      ContactRow const* alone = find(rows, {block.precision, 1}, row.asked, row.kernel);
      return alone ? fmt::format("{:.2f}", alone->seconds / row.seconds) : std::string("-");
    });
  }
  auto const bytes = [&](double ContactRow::*member) {
    return [member](ContactRow const& row) {
      return fmt::format("{:.0f} | {:.0f}", row.*member / row.kept, row.*member / row.contacts);
    };
  };
  text += with("held, B", "iteration", bytes(&ContactRow::held));
  text += with("held at most, B", "iteration", bytes(&ContactRow::peak));
  text += with("allocations of a step", "iteration", counted(&ContactRow::allocations));
  return text;
}

}  // namespace

std::string contact_tables(Rows const& rows, std::vector<MachineRates> const& machines) {
  std::string text = machine_table(machines);
  text +=
      "\nns per candidate | per contact (share of the smaller limit; what that counts: a machine "
      "that knew which pairs act)\n";
  for (std::string const& precision : values(rows, &ContactRow::precision))
    for (int threads : values(rows, &ContactRow::threads))
      text += block_table(rows, {precision, threads});
  return text;
}

}  // namespace taut
