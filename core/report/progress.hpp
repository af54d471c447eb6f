// One line on the terminal that says how far a run is, how fast, and how long it will take. Nothing
// is printed when the stream is not a terminal.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <taut/core/report/timer.hpp>

namespace taut {

class ProgressLine {
public:
  /// For `total` items called `unit` (plural). `first` are done already, in a restarted run.
  ProgressLine(std::int64_t total, std::string unit, std::int64_t first = 0,
               std::FILE* stream = stderr);
  ~ProgressLine() { finish(); }
  ProgressLine(ProgressLine const&) = delete;
  ProgressLine& operator=(ProgressLine const&) = delete;

  /// Redraws the line, at most ten times a second: `done` of the total, then `note`.
  void update(std::int64_t done, std::string_view note = {});
  /// Ends the line; further text begins on the next one.
  void finish();

private:
  std::int64_t total_;
  std::string unit_;
  std::int64_t first_;
  std::FILE* stream_;  // null when it is no terminal
  Timer since_start_;
  double last_drawn_ = -1;
  bool open_ = false;
};

/// "12/300 frames  4%  3.4 frames/s  01:24 left  note" for `seconds` spent since item `first`.
std::string progress_line(std::int64_t done, std::int64_t total, std::int64_t first, double seconds,
                          std::string_view unit, std::string_view note);

}  // namespace taut
