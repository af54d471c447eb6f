// The one exception of the library: bad input or a state that cannot be continued from. Its text is
// a single sentence for the user: where (file and line, key, element), what is wrong, how to mend
// it.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace taut {

class Error : public std::runtime_error {
public:
  explicit Error(std::string const& sentence) : std::runtime_error(sentence) {}

  template <class... Args>
  requires(sizeof...(Args) > 0) explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

}  // namespace taut
