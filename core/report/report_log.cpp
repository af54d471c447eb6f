#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/report_log.hpp>

namespace taut {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(Record const& record);

template <class T>
Json json_of(T const& value) {
  return value;
}

Json json_of(std::vector<Record> const& records) {
  Json list = Json::array();
  for (Record const& record : records) list.push_back(json_of(record));
  return list;
}

Json json_of(Record const& record) {
  Json object = Json::object();
  for (auto const& [name, value] : record.entries) {
    object[name] = std::visit([](auto const& held) { return json_of(held); },
                              static_cast<ValueBase const&>(value));
  }
  return object;
}

/// The length of the leading lines of `text` that hold a "frame" below `first_frame`.
std::size_t kept_length(std::string const& text, std::int64_t first_frame) {
  std::size_t kept = 0;
  for (;;) {
    const std::size_t end = text.find('\n', kept);
    if (end == std::string::npos) return kept;  // also drops a line that a kill cut short
    const Json line = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(kept),
                                  text.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
    if (!line.is_object() || !line.contains("frame") || !line["frame"].is_number_integer() ||
        line["frame"].get<std::int64_t>() >= first_frame) {
      return kept;
    }
    kept = end + 1;
  }
}

}  // namespace

std::string to_json(Record const& record, bool indented) {
  // Text that is not UTF-8, such as an old file name, must not stop a run.
  return json_of(record).dump(indented ? 2 : -1, ' ', false, Json::error_handler_t::replace);
}

std::string to_json(std::vector<Record> const& records) {
  std::string list;
  for (Record const& record : records) list += (list.empty() ? "[" : ",\n ") + to_json(record);
  return list.empty() ? "[]" : list + "]";
}

JsonLines::JsonLines(std::filesystem::path const& path, std::int64_t first_frame)
    : path_(path), file_(nullptr, &std::fclose) {
  make_parent_folder(path);
  std::string kept;
  if (first_frame > 0 && std::filesystem::exists(path)) {
    kept = read_file(path);
    kept.resize(kept_length(kept, first_frame));
  }
  write_file_atomically(path, kept);
  file_.reset(std::fopen(path.c_str(), "ab"));
  if (!file_) {
    throw Error("{}: cannot be opened for writing ({}); choose another output folder.",
                path.string(), std::generic_category().message(errno));
  }
}

void JsonLines::write(Record const& record) {
  const std::string line = to_json(record) + '\n';
  if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size() ||
      std::fflush(file_.get()) != 0) {
    throw Error("{}: a line cannot be written ({}); free disk space and restart.", path_.string(),
                std::generic_category().message(errno));
  }
}

void write_summary(std::filesystem::path const& path, Record const& record) {
  write_file_atomically(path, to_json(record, true) + '\n');
}

}  // namespace taut
