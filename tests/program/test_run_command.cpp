// `taut run` as a process: one that was interrupted or killed goes on with --restart as if nothing
// had happened, bit by bit.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <core/io/io_samples.hpp>
#include <csignal>
#include <fstream>
#include <iterator>
#include <taut/core/io/vtkhdf.hpp>
#include <thread>

#include "scene_text.hpp"

using namespace taut;
using namespace taut::test;

namespace {

/// A process that runs `taut run` on the small drag scene.
class TautRun {
public:
  TautRun(std::filesystem::path const& out, int frames, std::vector<std::string> const& more = {}) {
    std::vector<std::string> words{program().string(),
                                   "run",
                                   "drag",
                                   "--small",
                                   "--out",
                                   out.string(),
                                   "--frames",
                                   std::to_string(frames),
                                   "--set",
                                   "time.integrator=bdf2"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (int stream : {1, 2}) {
      posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
    }
    REQUIRE(posix_spawn(&id_, words[0].c_str(), &actions, nullptr, arguments.data(), environ) == 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  TautRun(TautRun const&) = delete;
  TautRun& operator=(TautRun const&) = delete;
  ~TautRun() {
    if (id_ == 0) return;
    ::kill(id_, SIGKILL);
    wait();
  }

  /// As waitpid tells it.
  int wait() {
    int status = 0;
    REQUIRE(::waitpid(id_, &status, 0) == id_);
    id_ = 0;
    return status;
  }
  int exit_status() {
    int const status = wait();
    REQUIRE(WIFEXITED(status));
    return WEXITSTATUS(status);
  }
  void signal(int number) const { REQUIRE(::kill(id_, number) == 0); }
  /// Returns when the report has so many lines. Fails if the process has ended before.
  void wait_for_lines(std::filesystem::path const& report, int lines) {
    while (count_lines(report) < lines) {
      int status = 0;
      bool const running = ::waitpid(id_, &status, WNOHANG) == 0;
      if (!running) id_ = 0;
      REQUIRE(running);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  static int count_lines(std::filesystem::path const& path) {
    std::ifstream file(path);
    return static_cast<int>(std::count(std::istreambuf_iterator<char>(file), {}, '\n'));
  }

private:
  pid_t id_ = 0;
};

std::int64_t frames(std::filesystem::path const& out) {
  return ResultReader(out / "result.vtkhdf").frames();
}

void check_same(std::filesystem::path const& a, std::filesystem::path const& b, int steps) {
  ResultReader const one(a / "result.vtkhdf"), other(b / "result.vtkhdf");
  REQUIRE(one.frames() == steps + 1);
  REQUIRE(other.frames() == steps + 1);
  CHECK(one.times() == other.times());
  bool same = true;
  for (int k = 0; k <= steps; ++k) {
    same =
        same && one.positions(k) == other.positions(k) && one.velocities(k) == other.velocities(k);
  }
  CHECK(same);
  CHECK(TautRun::count_lines(a / "report.jsonl") == steps);
  CHECK(TautRun::count_lines(b / "report.jsonl") == steps);
}

constexpr int many = 3000;  // frames: no run ends before it is told to

}  // namespace

TEST_CASE("a run that is interrupted goes on bitwise") {
  Folder const folder;
  auto const out = folder / "interrupted", whole = folder / "whole";
  TautRun run(out, many);
  run.wait_for_lines(out / "report.jsonl", 3);
  run.signal(SIGINT);
  CHECK(run.exit_status() == 128 + SIGINT);
  int const steps = TautRun::count_lines(out / "report.jsonl");
  CHECK(steps < many);
  CHECK(TautRun(out, steps + 4, {"--restart"}).exit_status() == 0);
  CHECK(TautRun(whole, steps + 4).exit_status() == 0);
  check_same(out, whole, steps + 4);
}

TEST_CASE("a run that is killed goes on from its last checkpoint, bitwise") {
  Folder const folder;
  auto const out = folder / "killed", whole = folder / "whole";
  CHECK(TautRun(out, 4).exit_status() == 0);  // leaves a checkpoint
  TautRun run(out, many, {"--restart"});
  run.wait_for_lines(out / "report.jsonl", 7);
  run.signal(SIGKILL);
  CHECK(WIFSIGNALED(run.wait()));
  CHECK(frames(out) > 6);  // more than the checkpoint knows of: they are computed again
  CHECK(TautRun(out, 12, {"--restart"}).exit_status() == 0);
  CHECK(TautRun(whole, 12).exit_status() == 0);
  check_same(out, whole, 12);
}

TEST_CASE("a result is not overwritten, and not continued with another scene") {
  Folder const folder;
  auto const out = folder / "result";
  CHECK(TautRun(out, 1).exit_status() == 0);
  CHECK(TautRun(out, 1).exit_status() == 1);
  CHECK(TautRun(out, 2, {"--restart", "--set", "time.step=0.02"}).exit_status() == 1);
  CHECK(frames(out) == 2);
  CHECK(TautRun(out, 2, {"--force"}).exit_status() == 0);
}
