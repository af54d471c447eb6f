// Damaged results and checkpoints: read, or refused with a sentence; nothing else. HDF5 itself
// crashes on some damage, so a checkpoint is verified before HDF5 sees it.
#include <sys/wait.h>
#include <unistd.h>

#include <core/io/io_samples.hpp>
#include <random>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/vtkhdf.hpp>

using namespace taut;
using namespace taut::test;

namespace {

/// One to three changed bits, bytes or words, or a cut end.
std::string damaged(std::string bytes, std::mt19937_64& random) {
  const auto below = [&](std::size_t end) { return static_cast<std::size_t>(random() % end); };
  for (std::size_t n = 1 + below(3); n > 0 && bytes.size() > 8; --n) {
    const std::size_t at = below(bytes.size() - 8);
    switch (below(4)) {
      case 0:
        bytes[at] ^= static_cast<char>(1 << below(8));
        break;
      case 1:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 2:
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), 8, below(2) ? '\xff' : '\x7f');
        break;
      default:
        if (below(10) == 0) bytes.resize(at);
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("a damaged checkpoint is refused, whatever the damage") {
  const Folder folder;
  const auto path = folder / "checkpoint.h5";
  Checkpoint state;
  state.set("x", std::vector<double>(30, 1.5));
  state.set("steps", std::vector<std::int32_t>{7});
  state.texts["note"] = "two words";
  write_checkpoint(path, state);
  const std::string good = read_file(path);
  std::mt19937_64 random(20240607);
  for (int i = 0; i < 3000; ++i) {
    const std::string bad = damaged(good, random);
    if (bad == good) continue;
    write_file_atomically(path, bad);
    try {
      read_checkpoint(path);
      FAIL("mutation " << i << " was read");
    } catch (Error const&) {
    }
  }
  write_file_atomically(path, good);
  CHECK(read_checkpoint(path).get<double>("x") == std::vector<double>(30, 1.5));
}

TEST_CASE("sizes in a damaged result are bounded by the file") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  {
    ResultMesh const mesh{two_tets(),
                          {0, 1, 2},
                          {"left", "right", "floor"},
                          {{1, 3, 4}},
                          {ObjectKind::body, ObjectKind::body, ObjectKind::drawn_only}};
    auto writer = ResultWriter::create(path, mesh, 3, ResultWriter::IfExists::refuse);
    for (int k = 0; k < 3; ++k) writer.append(k, mesh.mesh.points, mesh.mesh.points);
  }
  const std::string good = read_file(path);
  CHECK(in_own_process([&] {
          std::mt19937_64 random(20240607);
          int refused = 0;
          int read = 0;
          for (int i = 0; i < 1000; ++i) {
            write_file_atomically(path, damaged(good, random));
            try {
              const ResultReader reader(path);
              for (std::int64_t k = 0; k < reader.frames(); ++k) reader.positions(k);
              ++read;
            } catch (Error const&) {
              ++refused;
            } catch (...) {
              return 2;
            }
          }
          return refused > 0 && read > 0 ? 0 : 1;
        }) == 0);
}
