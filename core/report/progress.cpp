#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <taut/core/report/progress.hpp>
#include <utility>

namespace taut {
namespace {

constexpr double redraw_interval = 0.1;  // s

std::string clock_time(double seconds) {
  const auto whole = static_cast<std::int64_t>(std::ceil(seconds));
  if (whole < 3600) return fmt::format("{:02}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

std::string progress_line(std::int64_t done, std::int64_t total, std::int64_t first, double seconds,
                          std::string_view unit, std::string_view note) {
  std::string line = fmt::format("{}/{} {}", done, total, unit);
  if (total > 0) line += fmt::format("  {}%", 100 * done / total);
  if (done > first && seconds > 0) {
    const double rate = static_cast<double>(done - first) / seconds;
    // Below one a second, the time that one takes is the readable number.
    line += rate < 1 ? fmt::format("  {:.3g} s each", 1 / rate)
                     : fmt::format("  {:.3g} {}/s", rate, unit);
    line += fmt::format("  {} left", clock_time(static_cast<double>(total - done) / rate));
  }
  if (!note.empty()) line += fmt::format("  {}", note);
  return line;
}

ProgressLine::ProgressLine(std::int64_t total, std::string unit, std::int64_t first,
                           std::FILE* stream)
    : total_(total),
      unit_(std::move(unit)),
      first_(first),
      stream_(::isatty(::fileno(stream)) ? stream : nullptr) {}

void ProgressLine::update(std::int64_t done, std::string_view note) {
  const double now = since_start_.seconds();
  if (!stream_ || (open_ && done < total_ && now - last_drawn_ < redraw_interval)) return;
  last_drawn_ = now;
  open_ = true;
  // Back to the first column, the line, and the rest of an older longer line erased.
  fmt::print(stream_, "\r{}\x1b[K", progress_line(done, total_, first_, now, unit_, note));
  std::fflush(stream_);
}

void ProgressLine::finish() {
  if (!open_) return;
  open_ = false;
  std::fputc('\n', stream_);
  std::fflush(stream_);
}

}  // namespace taut
