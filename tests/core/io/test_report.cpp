// report.jsonl, summary.json and the progress line.
#include <cmath>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <limits>
#include <support/data.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/progress.hpp>
#include <taut/core/report/report_log.hpp>

using namespace taut;
using namespace taut::test;

TEST_CASE("a record keeps order and types; numbers survive, NaN becomes null") {
  Record inner;
  inner.set("x", 1);
  Record record;
  record.set("frame", 3)
      .set("gap", 0.1)
      .set("bad", std::numeric_limits<double>::quiet_NaN())
      .set("converged", true)
      .set("why", "energy \"drop\"")
      .set("large", std::size_t{1} << 40)
      .set("values", std::vector<double>{1.5, std::numeric_limits<double>::infinity()})
      .set("names", std::vector<std::string>{"a"})
      .set("objects", std::vector<Record>{inner, inner})
      .set("nested", inner);
  CHECK(to_json(record) ==
        R"({"frame":3,"gap":0.1,"bad":null,"converged":true,"why":"energy \"drop\"",)"
        R"("large":1099511627776,"values":[1.5,null],"names":["a"],"objects":[{"x":1},{"x":1}],)"
        R"("nested":{"x":1}})");
  Record foreign;
  foreign.set("file", "gr\xf6sser");  // Latin-1, not UTF-8
  CHECK(parse_json(to_json(foreign)).is_object());
}

TEST_CASE("lines are in the file as soon as they are written") {
  const Folder folder;
  const auto path = folder / "out/report.jsonl";
  JsonLines lines(path);
  for (int k = 0; k < 3; ++k) {
    Record record;
    lines.write(record.set("frame", k));
    CHECK(read_file(path).size() == 12U * (static_cast<std::size_t>(k) + 1));
  }
}

TEST_CASE("a restarted report keeps the lines before the frame it goes on with") {
  const Folder folder;
  const auto path = folder / "report.jsonl";
  const std::string lines = "{\"frame\":0,\"step\":0}\n{\"frame\":0,\"step\":1}\n{\"frame\":1}\n";
  write_file_atomically(path, lines + "{\"frame\":2}\n{\"frame\":3,\"ga");  // cut by a kill
  {
    JsonLines log(path, 2);
    Record record;
    log.write(record.set("frame", 2).set("again", true));
  }
  CHECK(read_file(path) == lines + "{\"frame\":2,\"again\":true}\n");
  write_file_atomically(path, lines + "{\"frame\":2,\"ga");
  JsonLines(path, 9);
  CHECK(read_file(path) == lines);
  JsonLines(path, 0);
  CHECK(read_file(path).empty());
}

TEST_CASE("a report that cannot be written is an error") {
  const Folder folder;
  write_file_atomically(folder / "file", "");
  check_says(sentence([&] { JsonLines(folder / "file/report.jsonl"); }), {"folder", "file"});
}

TEST_CASE("the summary is one object") {
  const Folder folder;
  Record record;
  record.set("frames", 10).set("seconds", 1.25);
  write_summary(folder / "summary.json", record);
  const auto json = read_json(folder / "summary.json");
  CHECK(json.at("frames") == 10);
  CHECK(json.at("seconds") == 1.25);
}

TEST_CASE("progress states share, rate and time left; a file gets none of it") {
  CHECK(progress_line(0, 300, 0, 0, "frames", "") == "0/300 frames  0%");
  CHECK(progress_line(60, 300, 0, 20, "frames", "12 iterations") ==
        "60/300 frames  20%  3 frames/s  01:20 left  12 iterations");
  // After a restart at frame 50 only the new frames count for the rate.
  CHECK(progress_line(60, 300, 50, 40, "frames", "") == "60/300 frames  20%  4 s each  16:00 left");
  CHECK(progress_line(1, 2000, 0, 3.6, "frames", "") ==
        "1/2000 frames  0%  3.6 s each  1:59:57 left");

  const Folder folder;
  std::FILE* const file = std::fopen((folder / "log").c_str(), "w");
  {
    ProgressLine progress(10, "frames", 0, file);
    progress.update(5);
  }
  std::fclose(file);
  CHECK(read_file(folder / "log").empty());
}
