// Checkpoints come back bitwise, or not at all.
#include <bit>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <limits>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>

using namespace taut;
using namespace taut::test;

namespace {

Checkpoint sample_checkpoint() {
  Checkpoint state;
  const double nan = std::bit_cast<double>(0x7ff8000000abcdefULL);  // a NaN with a payload
  state.set("positions", std::vector<double>{0.1, -0.0, 1e-320, nan, 1e300});
  state.set("direction", std::vector<float>{0.1F, -0.0F, 1e-44F});
  state.set("order", std::vector<std::int32_t>{3, -1, std::numeric_limits<std::int32_t>::min()});
  state.set("step", std::vector<std::int64_t>{std::numeric_limits<std::int64_t>::max()});
  state.set("nothing", std::vector<double>{});
  state.texts["method"] = "pncg\nwith two lines";
  state.texts["empty"] = "";
  return state;
}

template <class T>
std::string bytes(std::vector<T> const& values) {
  return {reinterpret_cast<char const*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace

TEST_CASE("a checkpoint is read back bitwise") {
  const Folder folder;
  const auto path = folder / "new/checkpoint.h5";
  const Checkpoint written = sample_checkpoint();
  write_checkpoint(path, written);
  write_checkpoint(path, written);  // replaces
  const Checkpoint read = read_checkpoint(path);
  CHECK(read.texts == written.texts);
  REQUIRE(read.arrays.size() == 5);
  CHECK(bytes(read.get<double>("positions")) == bytes(written.get<double>("positions")));
  CHECK(bytes(read.get<float>("direction")) == bytes(written.get<float>("direction")));
  CHECK(read.get<std::int32_t>("order") == written.get<std::int32_t>("order"));
  CHECK(read.number<std::int64_t>("step") == std::numeric_limits<std::int64_t>::max());
  CHECK(read.get<double>("nothing").empty());
}

TEST_CASE("asking a checkpoint for what it lacks is an error") {
  const Checkpoint state = sample_checkpoint();
  check_says(sentence([&] { state.get<double>("momentum"); }), {"'momentum'"});
  check_says(sentence([&] { state.get<float>("positions"); }), {"'positions'", "precision"});
  check_says(sentence([&] { state.number<double>("positions"); }), {"not one number"});
}

TEST_CASE("a missing, foreign or damaged checkpoint is refused with a sentence") {
  const Folder folder;
  const auto path = folder / "checkpoint.h5";
  check_says(sentence([&] { read_checkpoint(path); }), {path.string(), "looked for"});
  write_file_atomically(path, "text");
  check_says(sentence([&] { read_checkpoint(path); }), {path.string(), "no checkpoint"});

  write_checkpoint(path, sample_checkpoint());
  const std::string good = read_file(path);
  for (std::size_t length : {good.size() - 1, good.size() / 2, std::size_t{100}}) {
    write_file_atomically(path, good.substr(0, length));
    check_says(sentence([&] { read_checkpoint(path); }), {path.string(), "no checkpoint"});
  }
  // One bit of one value, which HDF5 would not notice.
  std::string bad = good;
  const std::string value = bytes(std::vector<double>{1e300});
  const std::size_t at = bad.find(value);
  REQUIRE(at != std::string::npos);
  bad[at] ^= 1;
  write_file_atomically(path, bad);
  check_says(sentence([&] { read_checkpoint(path); }), {"not those that were written"});
}
