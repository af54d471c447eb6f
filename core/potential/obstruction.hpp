// What stands in the way of a motion, and the error that says so.
#pragma once

#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>

#include <string>
#include <vector>

namespace taut {

/// What a step bound stopped at.
struct Obstruction {
  std::string what;           ///< "a point and a triangle that touch"
  std::vector<int> unknowns;  ///< what it consists of, in the solver's order
};

/// A prescribed motion cannot go on.
class HeldUp : public Error {
public:
  explicit HeldUp(Obstruction by)
      : Error(
            "the prescribed motion is held up by {}{}: reduce the motion per step, give it more "
            "room, or release what is prescribed",
            by.what, list(by.unknowns)),
        by_(std::move(by)) {}

  Obstruction const& by() const { return by_; }

private:
  static std::string list(std::vector<int> const& unknowns) {
    return unknowns.empty() ? "" : fmt::format(" (unknowns {})", fmt::join(unknowns, ", "));
  }
  Obstruction by_;
};

}  // namespace taut
