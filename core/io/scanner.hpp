// A cursor over the content of a mesh file that knows where it is, for messages a user can act on.
// White space separates words; a row is one line without its comment. All failures throw Error.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <taut/core/report/error.hpp>
#include <type_traits>

namespace taut {

class Scanner {
public:
  /// `text` must outlive the scanner; `name` is the file as the user named it.
  Scanner(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  /// Bytes not read yet, the bound of every count the file states.
  std::size_t remaining() const { return text_.size() - position_; }

  /// Throws Error "<file>:<line>: <message>", or with the byte for a binary file.
  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> message, Args&&... args) const {
    throw Error("{}: {}", place(), fmt::format(message, std::forward<Args>(args)...));
  }

  /// From now on messages name bytes instead of lines.
  void binary_from_here() { binary_ = true; }

  /// Moves to the next line that holds more than white space and a `comment`; false at the end.
  /// Until end_row() nothing beyond that line is read.
  bool begin_row(char comment);
  void end_row() {
    position_ = row_end_;
    row_end_ = text_.size();
    // A comment may follow the row's numbers.
    while (position_ < text_.size() && text_[position_] != '\n') ++position_;
  }

  /// The next word, empty when none is left.
  std::string_view word();
  /// True when another word follows.
  bool has_word() {
    skip_space();
    return position_ < row_end_;
  }
  /// Moves behind the end of the current line.
  void finish_line() {
    const std::size_t end = text_.find('\n', position_);
    position_ = end == std::string_view::npos ? text_.size() : end + 1;
  }
  /// Moves behind the next occurrence of `text`; false when there is none.
  bool skip_behind(std::string_view text);

  /// The next number of a text, `what` naming it in messages. Floating point numbers are finite.
  template <class T>
  T number(std::string_view what);

  /// The next `T` of a binary file, as this machine stores it.
  template <class T>
  T raw(std::string_view what) {
    mark_ = position_;
    if (remaining() < sizeof(T)) fail_end(what);
    T value;
    std::memcpy(&value, text_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) fail_not_finite(what);
    }
    return value;
  }

  /// Checks a count of `what` that the file states: not negative, addressable with 32 bits, and no
  /// more than the rest of the file can hold at `bytes_each`, before memory is taken for it.
  std::size_t checked_count(std::int64_t count, std::size_t bytes_each,
                            std::string_view what) const;

private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  void skip_space() {
    while (position_ < row_end_ && is_space(text_[position_])) ++position_;
    mark_ = position_;
  }
  std::string place() const;
  [[noreturn]] void fail_end(std::string_view what) const;
  [[noreturn]] void fail_number(std::string_view what);
  [[noreturn]] void fail_not_finite(std::string_view what) const;

  std::string_view text_;
  std::string name_;
  std::size_t position_ = 0;
  std::size_t row_end_ = text_.size();
  std::size_t mark_ = 0;  // where the word or number last looked at begins
  bool binary_ = false;
};

template <class T>
T Scanner::number(std::string_view what) {
  skip_space();
  if (position_ == row_end_) fail_end(what);
  char const* const end = text_.data() + row_end_;
  char const* begin = text_.data() + position_;
  if (*begin == '+') ++begin;
  T value{};
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || (stop != end && !is_space(*stop))) fail_number(what);
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) fail_not_finite(what);
  }
  position_ = static_cast<std::size_t>(stop - text_.data());
  return value;
}

}  // namespace taut
