#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

namespace taut {
namespace {

namespace fs = std::filesystem;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string reason(int error) { return std::generic_category().message(error); }

}  // namespace

std::string read_file(fs::path const& path) {
  std::error_code ignored;
  const fs::path absolute = fs::absolute(path, ignored);
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::exists(status)) {
    throw Error("{}: there is no such file (looked for {}); correct the name or the folder.",
                path.string(), absolute.string());
  }
  if (!fs::is_regular_file(status)) {
    throw Error("{}: this is not a file but a folder or a device ({}); name the file itself.",
                path.string(), absolute.string());
  }
  const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) {
    throw Error("{}: cannot be opened ({}: {}); make it readable.", path.string(),
                absolute.string(), reason(errno));
  }
  std::string content(fs::file_size(path), '\0');
  if (std::fread(content.data(), 1, content.size(), file.get()) != content.size()) {
    throw Error("{}: cannot be read to its end ({}); copy it here again.", path.string(),
                reason(errno));
  }
  return content;
}

void sync_file(fs::path const& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  for (fs::path const& one : {path, folder}) {
    const int file = ::open(one.c_str(), O_RDONLY | O_CLOEXEC);
    const bool synced = file >= 0 && ::fsync(file) == 0;
    const int error = errno;
    if (file >= 0) ::close(file);
    // Not every file system knows how to wait for a folder.
    if (!synced && one == path) {
      throw Error("{}: cannot be written to the disk ({}); choose another output folder.",
                  path.string(), reason(error));
    }
  }
}

void make_parent_folder(fs::path const& path) {
  const fs::path folder = path.parent_path();
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw Error("{}: the folder cannot be made ({}); choose another output folder.",
                folder.string(), error.message());
  }
}

fs::path temporary_beside(fs::path const& path) {
  // Always the same name: what a killed run leaves under it, the next one overwrites.
  return path.parent_path() / fmt::format(".{}.tmp", path.filename().string());
}

void move_into_place(fs::path const& temporary, fs::path const& path) {
  std::error_code error;
  fs::rename(temporary, path, error);
  if (!error) return;
  std::error_code ignored;
  fs::remove(temporary, ignored);
  throw Error("{}: cannot be replaced ({}); make its folder writable or choose another.",
              path.string(), error.message());
}

void write_file_atomically(fs::path const& path, std::string_view content, Durability durability) {
  make_parent_folder(path);
  const fs::path temporary = temporary_beside(path);
  File file(std::fopen(temporary.c_str(), "wb"), &std::fclose);
  bool written = file != nullptr &&
                 std::fwrite(content.data(), 1, content.size(), file.get()) == content.size() &&
                 std::fflush(file.get()) == 0 &&
                 (durability == Durability::process || ::fsync(::fileno(file.get())) == 0);
  int error = errno;
  if (file && std::fclose(file.release()) != 0 && written) {
    error = errno;
    written = false;
  }
  if (!written) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw Error("{}: cannot be written ({}); free disk space or choose another folder.",
                path.string(), reason(error));
  }
  move_into_place(temporary, path);
}

void write_file_from(fs::path const& path, std::size_t offset, std::string_view content) {
  const File file(std::fopen(path.c_str(), "r+b"), &std::fclose);
  const bool written =
      file && std::fseek(file.get(), static_cast<long>(offset), SEEK_SET) == 0 &&
      std::fwrite(content.data(), 1, content.size(), file.get()) == content.size() &&
      std::fflush(file.get()) == 0;
  if (!written) {
    throw Error("{}: cannot be written ({}); free disk space or choose another folder.",
                path.string(), reason(errno));
  }
}

}  // namespace taut
