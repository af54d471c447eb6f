#include <taut/core/sparse/smoothed_aggregation.hpp>

#include <algorithm>
#include <cstdint>

namespace taut {
namespace {

/// Collects the numbers that are marked, each once.
class Collector {
public:
  explicit Collector(int numbers) : last_seen_(numbers, -1) {}
  void add(int number) {
    if (last_seen_[number] == row_) return;
    last_seen_[number] = row_;
    found_.push_back(number);
  }
  /// Ends a row: appends them to it, ascending.
  void close(BlockPattern& pattern) {
    std::sort(found_.begin(), found_.end());
    pattern.column.insert(pattern.column.end(), found_.begin(), found_.end());
    pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
    found_.clear();
    ++row_;
  }

private:
  std::vector<int> last_seen_, found_;
  int row_ = 0;
};

std::span<int const> row_of(BlockPattern const& pattern, int i) {
  return std::span(pattern.column)
      .subspan(pattern.row_begin[i], pattern.row_begin[i + 1] - pattern.row_begin[i]);
}

}  // namespace

RunBegins equal_runs(int n, int length) {
  RunBegins begin;
  for (int first = 0; first < n; first += length) begin.push_back(first);
  begin.push_back(n);
  return begin;
}

RunBegins runs_of_bodies(std::span<int const> of, int length) {
  int const n = static_cast<int>(of.size());
  RunBegins begin;
  for (int first = 0, last = 0; first < n; first = last) {
    while (last < n && of[last] == of[first]) ++last;
    int const size = last - first, runs = (size + length - 1) / length;
    for (int k = 0; k < runs; ++k)
      begin.push_back(first + static_cast<int>(std::int64_t(size) * k / runs));
  }
  begin.push_back(n);
  return begin;
}

AggregationPattern aggregation_pattern(std::span<int const> row_begin, std::span<int const> column,
                                       std::span<int const> run, int runs) {
  int const n = static_cast<int>(run.size());
  AggregationPattern pattern{{{0}, {}}, {{0}, {}}, {{0}, {}}, {{0}, {}}, {}, {}};
  Collector of_p(runs), of_ap(runs), of_coarse(runs);
  for (int i = 0; i < n; ++i) {
    for (int k = row_begin[i]; k < row_begin[i + 1]; ++k) of_p.add(run[column[k]]);
    of_p.close(pattern.p);
  }
  for (int i = 0; i < n; ++i) {
    for (int k = row_begin[i]; k < row_begin[i + 1]; ++k)
      for (int const r : row_of(pattern.p, column[k])) of_ap.add(r);
    of_ap.close(pattern.ap);
  }

  pattern.by_run = sort_into_buckets(pattern.p.column, runs);
  std::vector<int> row_of_place(pattern.p.column.size());
  for (int i = 0; i < n; ++i)
    std::fill(row_of_place.begin() + pattern.p.row_begin[i],
              row_of_place.begin() + pattern.p.row_begin[i + 1], i);
  for (int const k : pattern.by_run.item) pattern.row.push_back(row_of_place[k]);

  for (int r = 0; r < runs; ++r) {
    for (int k = pattern.by_run.begin[r]; k < pattern.by_run.begin[r + 1]; ++k)
      for (int const other : row_of(pattern.ap, pattern.row[k])) of_coarse.add(other);
    of_coarse.close(pattern.coarse);
    for (int half = 0; half < 2; ++half) {
      for (int const other : row_of(pattern.coarse, r))
        for (int m = 0; m < 2; ++m) pattern.blocks.column.push_back(2 * other + m);
      pattern.blocks.row_begin.push_back(static_cast<int>(pattern.blocks.column.size()));
    }
  }
  return pattern;
}

}  // namespace taut
