// What a method of [solver] is called.
#pragma once

#include <string_view>

namespace taut {

struct MethodTitle {
  std::string_view name;         ///< value of solver.method
  std::string_view title;        ///< for charts
  std::string_view description;  ///< one line
};

}  // namespace taut
