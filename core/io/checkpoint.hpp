// The state of a run between two steps, from which it goes on bitwise: named arrays of numbers and
// named texts in one HDF5 file. The file is replaced in one step after its bytes have reached the
// disk, so a kill, a full disk or a failing machine leaves the previous checkpoint or the new one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <taut/core/report/error.hpp>
#include <variant>
#include <vector>

namespace taut {

class Checkpoint {
public:
  using Array = std::variant<std::vector<double>, std::vector<float>, std::vector<std::int32_t>,
                             std::vector<std::int64_t>>;

  /// `name` may not contain '/'. A number is an array of one.
  void set(std::string const& name, Array values) { arrays[name] = std::move(values); }

  /// The array stored under `name`. Throws Error if there is none or its numbers are not T.
  template <class T>
  std::vector<T> const& get(std::string const& name) const {
    const auto found = arrays.find(name);
    auto const* const values =
        found == arrays.end() ? nullptr : std::get_if<std::vector<T>>(&found->second);
    if (!values) {
      throw Error("the checkpoint has no array '{}' of this precision; start the run again.", name);
    }
    return *values;
  }

  /// The number stored under `name`. Throws Error if there is no array of one T.
  template <class T>
  T number(std::string const& name) const {
    std::vector<T> const& values = get<T>(name);
    if (values.size() != 1) {
      throw Error("the checkpoint's '{}' is not one number; start the run again.", name);
    }
    return values[0];
  }

  std::map<std::string, Array> arrays;
  std::map<std::string, std::string> texts;
};

/// Throws Error if it cannot be written.
void write_checkpoint(std::filesystem::path const& path, Checkpoint const& checkpoint);

/// Reads a checkpoint back bitwise. Throws Error if there is none, if it is damaged or of another
/// format version.
Checkpoint read_checkpoint(std::filesystem::path const& path);

}  // namespace taut
