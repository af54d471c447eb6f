// A run that is killed, or whose disk is full, leaves every finished frame and the last checkpoint.
#include <fcntl.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <core/io/io_samples.hpp>
#include <csignal>
#include <cstdint>
#include <functional>
#include <random>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <thread>

using namespace taut;
using namespace taut::test;

namespace {

constexpr std::size_t n_points = 300;

ResultMesh sample_mesh() {
  ResultMesh mesh;
  mesh.mesh.points.resize(n_points);
  for (std::int32_t i = 0; i + 3 < std::int32_t(n_points); ++i) {
    mesh.mesh.tets.push_back({i, i + 1, i + 2, i + 3});
  }
  mesh.object.assign(mesh.mesh.tets.size(), 0);
  mesh.object_names = {"body"};
  return mesh;
}

std::vector<Point> frame(std::int64_t k, double scale) {
  std::vector<Point> points(n_points);
  for (std::size_t i = 0; i < n_points; ++i) {
    points[i] = {scale * static_cast<double>(k), static_cast<double>(i), scale};
  }
  return points;
}

void append(ResultWriter& writer, std::int64_t k) {
  writer.append(static_cast<double>(k), frame(k, 1), frame(k, -2));
}

/// Checks all frames of the result and returns their number.
std::int64_t checked_frames(std::filesystem::path const& path) {
  const ResultReader reader(path);
  for (std::int64_t k = 0; k < reader.frames(); ++k) {
    REQUIRE(reader.times()[static_cast<std::size_t>(k)] == static_cast<double>(k));
    REQUIRE(reader.positions(k) == frame(k, 1));
    REQUIRE(reader.velocities(k) == frame(k, -2));
  }
  return reader.frames();
}

/// Runs `action` in a process of its own, which can send words through the pipe's writing end.
struct Child {
  explicit Child(std::function<void(int)> const& action) {
    std::array<int, 2> ends{};
    REQUIRE(::pipe(ends.data()) == 0);
    id = ::fork();
    REQUIRE(id >= 0);
    if (id == 0) {
      ::close(ends[0]);
      action(ends[1]);
      ::_exit(0);  // not the tests' own end
    }
    ::close(ends[1]);
    pipe = ends[0];
  }
  ~Child() { ::close(pipe); }
  void wait() const {
    int status = 0;
    CHECK(::waitpid(id, &status, 0) == id);
  }
  /// All that the child has sent; returns when it has ended.
  std::string said() const {
    std::string text;
    std::array<char, 4096> buffer{};
    for (;;) {
      const ssize_t n = ::read(pipe, buffer.data(), buffer.size());
      if (n <= 0) return text;
      text.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
  pid_t id = 0;
  int pipe = -1;
};

void say(int pipe, std::string const& text) {
  if (::write(pipe, text.data(), text.size()) < 0) ::_exit(1);
}

/// The sentence of the taut::Error that `action` throws, or what happened instead.
std::string outcome(std::function<void()> const& action) {
  try {
    action();
    return "no error";
  } catch (Error const& error) {
    return error.what();
  } catch (std::exception const& other) {
    return std::string("another exception: ") + other.what();
  }
}

/// From here on this process cannot write beyond `bytes` in any file, as if the disk were full
/// there.
void limit_file_size(rlim_t bytes) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{bytes, RLIM_INFINITY};
  if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(1);
}

}  // namespace

TEST_CASE("a run killed at any moment leaves every finished frame") {
  const Folder folder;
  std::mt19937 random(7);
  std::int64_t most = 0;
  for (int round = 0; round < 50; ++round) {
    CAPTURE(round);
    const auto path = folder / fmt::format("{}.vtkhdf", round);
    // Half of the runs outgrow their layout again and again, so that copies are interrupted too.
    const std::int64_t capacity = round % 2 == 0 ? 3000 : 2;
    const Child run([&](int pipe) {
      auto writer =
          ResultWriter::create(path, sample_mesh(), capacity, ResultWriter::IfExists::refuse);
      for (std::int64_t k = 0; k < 3000; ++k) {
        say(pipe, ".");  // k frames are finished
        append(writer, k);
      }
    });
    std::array<char, 1> first{};
    REQUIRE(::read(run.pipe, first.data(), 1) == 1);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 15000));
    ::kill(run.id, SIGKILL);
    const auto finished = static_cast<std::int64_t>(run.said().size());
    run.wait();

    const std::int64_t found = checked_frames(path);
    CHECK(found >= finished);
    CHECK(found <= finished + 1);
    // As a stranger opens it.
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    CHECK(file >= 0);
    H5Fclose(file);
    {
      auto writer = ResultWriter::resume(path, sample_mesh(), found, capacity);
      append(writer, found);
    }
    CHECK(checked_frames(path) == found + 1);
    most = std::max(most, found);
  }
  CHECK(most > 3);  // or the kills hit nothing
}

TEST_CASE("a full disk is an error of the frame that did not fit") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  const Child run([&](int pipe) {
    {
      auto writer = ResultWriter::create(path, sample_mesh(), 100, ResultWriter::IfExists::refuse);
      for (std::int64_t k = 0; k < 3; ++k) append(writer, k);
    }
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t velocity = H5Dopen2(file, "VTKHDF/PointData/velocity", H5P_DEFAULT);
    const haddr_t start = H5Dget_offset(velocity);
    H5Dclose(velocity);
    H5Fclose(file);
    auto writer = ResultWriter::resume(path, sample_mesh(), 3, 100);
    // Half of the fourth frame's velocities fit.
    limit_file_size(start + n_points * sizeof(Point) * 7 / 2);
    say(pipe, outcome([&] { append(writer, 3); }));
    say(pipe, fmt::format("|{}", writer.frames()));
  });
  const std::string said = run.said();
  run.wait();
  check_says(
      said, {path.string(), "frame 3 cannot be written", "the velocities", "File too large", "|3"});
  CHECK(checked_frames(path) == 3);
  auto writer = ResultWriter::resume(path, sample_mesh(), 3, 100);
  append(writer, 3);
  CHECK(checked_frames(path) == 4);
}

TEST_CASE("a result that cannot be begun leaves nothing, and an older one untouched") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  {
    auto writer = ResultWriter::create(path, sample_mesh(), 5, ResultWriter::IfExists::refuse);
    append(writer, 0);
  }
  for (char const* const name : {"new.vtkhdf", "result.vtkhdf"}) {
    const Child run([&](int pipe) {
      limit_file_size(6000);
      say(pipe, outcome([&] {
            ResultWriter::create(folder / name, sample_mesh(), 5, ResultWriter::IfExists::replace);
          }));
    });
    const std::string said = run.said();
    run.wait();
    check_says(said, {name, "cannot be begun", "File too large"});
  }
  CHECK(checked_frames(path) == 1);
  const auto entries = std::filesystem::directory_iterator(folder.path());
  CHECK(std::distance(begin(entries), end(entries)) == 2);  // result and sidecar
}

TEST_CASE("a checkpoint that does not fit leaves the previous one") {
  const Folder folder;
  const auto path = folder / "checkpoint.h5";
  Checkpoint state;
  state.set("x", std::vector<double>(1000, 1.5));
  write_checkpoint(path, state);
  const Child run([&](int pipe) {
    limit_file_size(6000);
    state.set("x", std::vector<double>(1000, 2.5));
    say(pipe, outcome([&] { write_checkpoint(path, state); }));
    say(pipe, outcome([&] { write_file_atomically(folder / "text", std::string(9000, 'x')); }));
  });
  const std::string said = run.said();
  run.wait();
  check_says(said, {path.string(), "cannot be written", "File too large",
                    (folder / "text").string() + ": cannot be written"});
  CHECK(read_checkpoint(path).get<double>("x") == std::vector<double>(1000, 1.5));
  const auto entries = std::filesystem::directory_iterator(folder.path());
  CHECK(std::distance(begin(entries), end(entries)) == 1);
}
