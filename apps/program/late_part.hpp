// What `taut` leaves to `taut_whole`. The first scene of a fresh clone should not wait for every
// precision, policy and chart to be compiled, so the program exists twice: `taut` is built first
// and holds the defaults; `taut_whole` holds apps/variants and apps/chart too, and is built when a
// scene or a command asks for one of them. A function of theirs is declared as a LatePart where the
// program calls it, and filled in by a source of theirs.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace taut {

/// A scene asked for what only the whole program holds. No Error, which a command may catch and
/// report: the program hands over to that one.
class LeftToTheWhole : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

template <class Signature>
class LatePart {
public:
  /// The result tells nothing: it is there so that a variable can be initialised with the call,
  /// which happens before main.
  bool fill(Signature* function) {
    function_ = function;
    return true;
  }
  /// Throws LeftToTheWhole where it was not filled in: ahead of work that would be in vain.
  void require(std::string const& what) const {
    if (!function_) throw LeftToTheWhole(what);
  }
  /// Calls the function. Throws LeftToTheWhole, naming `what` the scene asks for, where it was not
  /// filled in.
  template <class... Arguments>
  decltype(auto) operator()(std::string const& what, Arguments&&... arguments) const {
    require(what);
    return function_(std::forward<Arguments>(arguments)...);
  }

private:
  Signature* function_ = nullptr;
};

}  // namespace taut
