// The program as a user meets it: a command line, what it says and how it ends.
#pragma once

#include "scene_text.hpp"

#include <sys/wait.h>

#include <catch2/matchers/catch_matchers_string.hpp>

#include <array>
#include <cstdio>

namespace taut::test {

struct Outcome {
  int status;
  std::string text;  ///< of stdout and stderr
};

inline Outcome outcome_of(std::string const& command) {
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  REQUIRE(pipe != nullptr);
  Outcome outcome{-1, {}};
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
    outcome.text.append(buffer.data(), n);
  outcome.status = WEXITSTATUS(::pclose(pipe));
  return outcome;
}

inline Outcome taut_with(std::string const& arguments) {
  return outcome_of(program().string() + " " + arguments);
}

inline void says(std::string const& arguments, int status, std::string const& part) {
  INFO("taut " << arguments);
  Outcome const outcome = taut_with(arguments);
  CHECK(outcome.status == status);
  CHECK_THAT(outcome.text, Catch::Matchers::ContainsSubstring(part));
}

}  // namespace taut::test
