// Lists in sentences: the first few of many by name.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <string>

namespace taut {

/// "4, 17, 203, ...": the first `shown` of the numbers, and whether there are more.
template <class Numbers>
std::string first_few(Numbers const& numbers, std::size_t shown) {
  auto const all = std::span(numbers);
  return fmt::format("{}{}", fmt::join(all.first(std::min(shown, all.size())), ", "),
                     all.size() > shown ? ", ..." : "");
}

}  // namespace taut
