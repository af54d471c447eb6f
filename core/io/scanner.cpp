#include <algorithm>
#include <taut/core/io/scanner.hpp>

namespace taut {

bool Scanner::begin_row(char comment) {
  row_end_ = text_.size();
  for (;;) {
    skip_space();
    if (position_ == text_.size()) return false;
    if (text_[position_] != comment) break;
    finish_line();
  }
  row_end_ = std::min(text_.find('\n', position_), text_.size());
  row_end_ = std::min(text_.substr(0, row_end_).find(comment, position_), row_end_);
  return true;
}

std::string_view Scanner::word() {
  skip_space();
  while (position_ < row_end_ && !is_space(text_[position_])) ++position_;
  return text_.substr(mark_, position_ - mark_);
}

bool Scanner::skip_behind(std::string_view text) {
  const std::size_t found = text_.find(text, position_);
  if (found == std::string_view::npos) return false;
  position_ = found + text.size();
  return true;
}

std::size_t Scanner::checked_count(std::int64_t count, std::size_t bytes_each,
                                   std::string_view what) const {
  if (count < 0) fail("a negative number of {} ({}); export the mesh again.", what, count);
  if (count > std::numeric_limits<std::int32_t>::max()) {
    fail("{} {} are more than 32-bit indices can number; split the mesh.", count, what);
  }
  const auto checked = static_cast<std::size_t>(count);
  if (checked > remaining() / bytes_each) {
    fail(
        "{} {} are announced, but the {} bytes that follow cannot hold them: the file is "
        "truncated or damaged; copy or export it again.",
        count, what, remaining());
  }
  return checked;
}

std::string Scanner::place() const {
  if (binary_) return fmt::format("{}, byte {}", name_, mark_);
  // Binary formats announce themselves in text: this counts lines only where lines have a meaning.
  const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<long>(mark_), '\n');
  return fmt::format("{}:{}", name_, line);
}

void Scanner::fail_end(std::string_view what) const {
  if (row_end_ == text_.size()) {
    fail("the file ends where {} should be; it is truncated, copy or export it again.", what);
  }
  fail("the line ends where {} should be; complete it or export the mesh again.", what);
}

void Scanner::fail_number(std::string_view what) {
  constexpr std::size_t shown = 40;
  std::string found(word().substr(0, shown));
  for (char& c : found) {
    if (c < ' ' || c > '~') c = '?';
  }
  fail(
      "'{}' stands where {} should be, and is no number in range; correct it or export the mesh "
      "again.",
      found, what);
}

void Scanner::fail_not_finite(std::string_view what) const {
  fail("{} is not finite (NaN or infinite); correct it or export the mesh again.", what);
}

}  // namespace taut
