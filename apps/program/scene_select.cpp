#include <taut/apps/program/scene_motion.hpp>
#include <taut/apps/program/scene_select.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace taut {
namespace {

struct BoundingBox {
  Point low, high;
  double diagonal;
};

BoundingBox bounding_box(std::span<Point const> points) {
  if (points.empty()) return {};
  BoundingBox box{points[0], points[0], 0};
  for (Point const& x : points)
    for (std::size_t a = 0; a < 3; ++a) {
      box.low[a] = std::min(box.low[a], x[a]);
      box.high[a] = std::max(box.high[a], x[a]);
    }
  box.diagonal = norm(box.high - box.low);
  return box;
}

/// Marks what one selector selects.
struct Mark {
  std::span<Point const> points;
  BoundingBox box;
  std::vector<bool>& marks;

  double slack() const { return 1e-9 * box.diagonal; }
  double reach(std::optional<double> within) const {
    return within.value_or(1e-6 * box.diagonal) + slack();
  }
  template <class Predicate>
  void where(Predicate const& inside) const {
    for (std::size_t i = 0; i < points.size(); ++i)
      if (inside(points[i])) marks[i] = true;
  }

  void operator()(SelectAll const&) const {
    where([](Point const&) { return true; });
  }
  void operator()(SelectBox const& s) const {
    where([&](Point const& x) {
      for (std::size_t a = 0; a < 3; ++a)
        if (x[a] < s.low[a] - slack() || x[a] > s.high[a] + slack()) return false;
      return true;
    });
  }
  void operator()(SelectPlane const& s) const {
    double const bound = reach(s.within);
    where([&](Point const& x) { return std::abs(dot(x - s.point, s.normal)) <= bound; });
  }
  void operator()(SelectSphere const& s) const {
    where([&](Point const& x) { return norm(x - s.centre) <= s.radius + slack(); });
  }
  void operator()(SelectSide const& s) const {
    double const side = s.high ? box.high[s.axis] : box.low[s.axis];
    double const bound = reach(s.within);
    where([&](Point const& x) { return std::abs(x[s.axis] - side) <= bound; });
  }
  void operator()(SelectMask const& s) const {
    std::vector<bool> const mask = read_mask(s.file);
    if (mask.size() != points.size())
      throw Error(
          "{}: the mask has {} entries, but there are {} to select from: use the mask made "
          "for this mesh",
          s.file.string(), mask.size(), points.size());
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (mask[i]) marks[i] = true;
  }
};

}  // namespace

std::vector<std::int32_t> selected(Selection const& selection, std::span<Point const> points) {
  std::vector<bool> marks(points.size(), false);
  Mark const mark{points, bounding_box(points), marks};
  for (Selector const& selector : selection) std::visit(mark, selector);
  std::vector<std::int32_t> indices;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i]) indices.push_back(static_cast<std::int32_t>(i));
  return indices;
}

std::vector<bool> read_mask(std::filesystem::path const& file) {
  // NPY format: "\x93NUMPY", major, minor, little-endian header length (2 bytes, from version 2 on
  // 4), a header {'descr': '<i4', 'fortran_order': False, 'shape': (13230,), }, then the raw
  // entries.
  auto const refuse = [&](std::string_view what) -> Error {
    return Error("{}: {}: save a one-dimensional array of int32 or bool with numpy.save",
                 file.string(), what);
  };
  std::string const bytes = read_file(file);
  if (bytes.size() < 12 || bytes.compare(0, 6, "\x93NUMPY") != 0)
    throw refuse("this is no .npy file");
  std::size_t const length_bytes = bytes[6] == 1 ? 2 : 4;
  std::size_t length = 0;
  for (std::size_t i = 0; i < length_bytes; ++i)
    length |= static_cast<std::size_t>(static_cast<unsigned char>(bytes[8 + i])) << (8 * i);
  std::size_t const data = 8 + length_bytes + length;
  if (data > bytes.size()) throw refuse("the header is cut off");

  std::string_view const header(bytes.data() + 8 + length_bytes, length);
  bool const int32 = header.find("'<i4'") != header.npos;
  if (!int32 && header.find("'|b1'") == header.npos)
    throw refuse("the entries are not int32 or bool");
  std::size_t const shape = header.find("'shape': (");
  if (shape == header.npos) throw refuse("the header has no shape");
  std::size_t count = 0;
  auto const [end, error] =
      std::from_chars(header.data() + shape + 10, header.data() + header.size(), count);
  if (error != std::errc() ||
      header.compare(static_cast<std::size_t>(end - header.data()), 2, ",)"))
    throw refuse("the array is not one-dimensional");
  std::size_t const width = int32 ? 4 : 1;
  if ((bytes.size() - data) / width < count) throw refuse("the file is cut off");

  std::vector<bool> mask(count);
  for (std::size_t i = 0; i < count; ++i)
    mask[i] = bytes.compare(data + i * width, width, std::string_view("\0\0\0\0", width)) != 0;
  return mask;
}

}  // namespace taut
