#include <fmt/format.h>

#include <taut/core/io/file.hpp>
#include <taut/core/io/xdmf.hpp>

namespace taut {
namespace {

constexpr char const* closing_tags = "</Grid>\n</Domain></Xdmf>\n";

std::string escaped(std::string const& text) {
  std::string xml;
  for (const char c : text) {
    switch (c) {
      case '&':
        xml += "&amp;";
        break;
      case '<':
        xml += "&lt;";
        break;
      case '>':
        xml += "&gt;";
        break;
      default:
        xml += c;
    }
  }
  return xml;
}

}  // namespace

XdmfSidecar::XdmfSidecar(std::filesystem::path const& path, ResultShape const& shape)
    : path_(std::filesystem::path(path).replace_extension(".xdmf")),
      result_(escaped(path.filename().string())),
      shape_(shape) {}

void XdmfSidecar::restart(std::span<double const> times, std::span<std::size_t const> particles) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"2.0\"><Domain>\n"
      "<Grid Name=\"result\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  frames_ = 0;
  for (const double time : times) {
    const std::size_t count =
        particles.empty() ? shape_.particles : particles[static_cast<std::size_t>(frames_)];
    text += grid(frames_++, time, count);
  }
  end_ = text.size();
  write_file_atomically(path_, text + closing_tags);
}

void XdmfSidecar::append(double time, std::size_t particles) {
  const std::string text = grid(frames_, time, particles);
  write_file_from(path_, end_, text + closing_tags);
  end_ += text.size();
  ++frames_;
}

std::string XdmfSidecar::grid(std::int64_t frame, double time, std::size_t particles) const {
  const auto capacity = static_cast<std::size_t>(shape_.capacity);
  const auto number = static_cast<std::size_t>(frame);
  const std::size_t count = shape_.points - shape_.particles + particles;  // points of the frame
  // VTK's reader takes the first thing inside a DataItem for the name under which it caches the
  // geometry: the comment gives each frame its own.
  const auto rows = [&](std::string_view dataset) {
    return fmt::format(
        "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{0} 3\"><!--frame {5}-->"
        "<DataItem Dimensions=\"3 2\" NumberType=\"Int\" Format=\"XML\">{1} 0 1 1 {0} 3</DataItem>"
        "<DataItem Dimensions=\"{2} 3\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">"
        "{3}:/VTKHDF/{4}</DataItem></DataItem>",
        count, number * shape_.points, capacity * shape_.points, result_, dataset, frame);
  };
  const auto numbers_of = [&](std::string_view dataset) {
    return fmt::format(
        "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{0}\"><!--frame {5}-->"
        "<DataItem Dimensions=\"3 1\" NumberType=\"Int\" Format=\"XML\">{1} 1 {0}</DataItem>"
        "<DataItem Dimensions=\"{2}\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">"
        "{3}:/VTKHDF/{4}</DataItem></DataItem>",
        count, number * shape_.points, capacity * shape_.points, result_, dataset, frame);
  };
  // The first `some` of `all` whole numbers, of the frame's own ones if the result grows.
  const auto first = [&](std::string_view dataset, std::size_t some, std::size_t all, int bytes) {
    const std::size_t stored = shape_.growing ? capacity * all : all;
    const std::string numbers = fmt::format(
        "<DataItem Dimensions=\"{}\" NumberType=\"Int\" Precision=\"{}\" Format=\"HDF\">"
        "{}:/VTKHDF/{}</DataItem>",
        stored, bytes, result_, dataset);
    if (some == stored) return numbers;
    return fmt::format(
        "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{0}\">"
        "<DataItem Dimensions=\"3 1\" NumberType=\"Int\" Format=\"XML\">{2} 1 {0}</DataItem>"
        "{1}</DataItem>",
        some, numbers, shape_.growing ? number * all : 0);
  };
  const bool points = shape_.particles > 0;
  const std::size_t shown = points ? particles : shape_.tets;
  std::string xml = fmt::format(
      "<Grid Name=\"frame {0}\"><Time Value=\"{1}\"/>\n"
      "<Topology TopologyType=\"{2}\" NumberOfElements=\"{3}\"{4}>{5}</Topology>\n"
      "<Geometry GeometryType=\"XYZ\">{6}</Geometry>\n"
      "<Attribute Name=\"object\" Center=\"Cell\">{7}</Attribute>\n",
      frame, time, points ? "Polyvertex" : "Tetrahedron", shown,
      points ? " NodesPerElement=\"1\"" : "",
      first("Connectivity", points ? shown : 4 * shown, shape_.corners(), 8), rows("Points"),
      first("CellData/object", shown, shape_.cells(), 4));
  if (shape_.velocities) {
    xml += fmt::format(
        "<Attribute Name=\"velocity\" AttributeType=\"Vector\" Center=\"Node\">{}</Attribute>\n",
        rows("PointData/velocity"));
  }
  for (std::string const& name : shape_.scalars) {
    xml += fmt::format("<Attribute Name=\"{0}\" Center=\"Node\">{1}</Attribute>\n", name,
                       numbers_of("PointData/" + name));
  }
  return xml + "</Grid>\n";
}

}  // namespace taut
