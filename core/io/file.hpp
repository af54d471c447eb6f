// Whole files in and out: the two operations every reader and every small writer is built on.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace taut {

/// The bytes of a file. Throws Error naming the file and the absolute path it was looked for under.
std::string read_file(std::filesystem::path const& path);

/// Whether a write waits for the disk, which takes milliseconds and survives a failing machine.
enum class Durability { process, machine };

/// Replaces `path` by `content` in one step: a reader, or a kill, sees the old file or the new one.
/// Missing folders are made. Throws Error when it cannot be written; the old file is then intact.
void write_file_atomically(std::filesystem::path const& path, std::string_view content,
                           Durability durability = Durability::process);

/// Overwrites an existing file from byte `offset` on. Throws Error when it cannot be written.
void write_file_from(std::filesystem::path const& path, std::size_t offset,
                     std::string_view content);

/// Waits until a file and its name are on the disk. Throws Error when that cannot be.
void sync_file(std::filesystem::path const& path);

/// Makes the folders above `path`. Throws Error naming the folder.
void make_parent_folder(std::filesystem::path const& path);

/// The name beside `path` under which its successor is prepared.
std::filesystem::path temporary_beside(std::filesystem::path const& path);

/// Renames `temporary` to `path`, replacing it. Throws Error and removes `temporary` on failure.
void move_into_place(std::filesystem::path const& temporary, std::filesystem::path const& path);

}  // namespace taut
