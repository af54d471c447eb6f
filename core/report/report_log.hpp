// The written reports of a run: report.jsonl, one JSON object per line and step, and summary.json.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <taut/core/report/record.hpp>

namespace taut {

/// The record as JSON: in one line, or indented.
std::string to_json(Record const& record, bool indented = false);
/// A list of records, one per line.
std::string to_json(std::vector<Record> const& records);

/// Appends lines to a file; each is handed to the operating system at once, so that a kill loses
/// none.
class JsonLines {
public:
  /// Keeps the leading lines of an existing file whose "frame" is below `first_frame` and drops the
  /// rest; 0 starts anew. Missing folders are made. Throws Error if the file cannot be written.
  explicit JsonLines(std::filesystem::path const& path, std::int64_t first_frame = 0);

  /// Throws Error if the line cannot be written.
  void write(Record const& record);

private:
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// Writes `record` to `path` in one step. Throws Error if that fails.
void write_summary(std::filesystem::path const& path, Record const& record);

}  // namespace taut
