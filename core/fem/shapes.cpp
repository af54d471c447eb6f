#include <taut/core/fem/lattice.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/fem/subdivision.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace taut {
namespace {

void require_size(double value, std::string_view what) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error("the {} of the shape is {} m: it must be positive and finite", what, value);
}

/// Number of cells of size h along a length, for cells as near to cubes as possible.
int cells_along(double length, double h) {
  return static_cast<int>(
      std::clamp(std::round(length / h), 1.0, static_cast<double>(max_lattice_cells) + 1));
}

/// From the square [-1, 1]^2 or cube [-1, 1]^3 onto the unit disk or ball, shell by shell.
template <std::size_t N>
std::array<double, N> onto_ball(std::array<double, N> u) {
  double shell = 0;
  for (double const c : u) shell = std::max(shell, std::abs(c));
  if (shell == 0) return u;
  double squares = 0;
  for (double& c : u) {
    c = std::tan(std::numbers::pi / 4 * (c / shell));
    squares += c * c;
  }
  for (double& c : u) c *= shell / std::sqrt(squares);
  return u;
}

TetMesh make(BoxShape const& box, int resolution) {
  for (double const s : box.size) require_size(s, "size");
  double const h = *std::max_element(box.size.begin(), box.size.end()) / resolution;
  Lattice const lattice(
      {cells_along(box.size[0], h), cells_along(box.size[1], h), cells_along(box.size[2], h)});
  return split(lattice, [&](Point const& u) {
    return Point{u[0] * box.size[0] / 2, u[1] * box.size[1] / 2, u[2] * box.size[2] / 2};
  });
}

/// The bounding box of a union of boxes.
struct Extent {
  Point low, high;

  explicit Extent(BoxUnionShape const& shape)
      : low(shape.boxes.front()[0]), high(shape.boxes.front()[1]) {
    for (auto const& [box_low, box_high] : shape.boxes)
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], box_low[a]);
        high[a] = std::max(high[a], box_high[a]);
      }
  }
  Point size() const { return {high[0] - low[0], high[1] - low[1], high[2] - low[2]}; }
  double longest() const {
    Point const edges = size();
    return *std::max_element(edges.begin(), edges.end());
  }
};

/// Whether all corners are vertices of the lattice with so many cells along the longest edge.
bool fits(BoxUnionShape const& shape, Extent const& extent, int cells) {
  double const h = extent.longest() / cells;
  for (auto const& box : shape.boxes)
    for (Point const& corner : box)
      for (std::size_t a = 0; a < 3; ++a) {
        double const steps = (corner[a] - extent.low[a]) / h;
        if (!(std::abs(steps - std::round(steps)) <= 1e-6)) return false;
      }
  return true;
}

/// The coarsest lattice that fits, or 0.
int coarsest_lattice(BoxUnionShape const& shape, Extent const& extent) {
  for (int cells = 1; cells < 1000; ++cells)
    if (fits(shape, extent, cells)) return cells;
  return 0;
}

TetMesh make(BoxUnionShape const& shape, int resolution) {
  if (shape.boxes.empty()) throw Error("the union has no boxes: give at least one");
  for (auto const& [box_low, box_high] : shape.boxes)
    for (std::size_t a = 0; a < 3; ++a)
      require_size(box_high[a] - box_low[a], "size of a box (highest minus lowest corner)");
  Extent const extent(shape);
  auto const& [low, high] = extent;
  Point const size = extent.size();
  if (!fits(shape, extent, resolution)) {
    int const other = coarsest_lattice(shape, extent);
    if (other == 0)
      throw Error(
          "the corners of the boxes lie on no common lattice: give multiples of one length");
    throw Error("the boxes' corners are off the lattice of resolution {}: use a multiple of {}",
                resolution, other);
  }

  double const h = extent.longest() / resolution;
  auto const lattice_corner = [&](Point const& corner) {
    Cell cell{};
    for (std::size_t a = 0; a < 3; ++a)
      cell[a] = static_cast<int>(std::lround((corner[a] - low[a]) / h));
    return cell;
  };
  Lattice lattice(lattice_corner(high), false);
  for (auto const& [box_low, box_high] : shape.boxes)
    lattice.fill(lattice_corner(box_low), lattice_corner(box_high));
  require_manifold(lattice);
  return split(lattice, [&](Point const& u) {
    Point p{};
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = (extent.low[a] + extent.high[a]) / 2 + u[a] * size[a] / 2;
    return p;
  });
}

TetMesh make(LetterEShape const& letter, int resolution) {
  require_size(letter.height, "height");
  require_size(letter.depth, "depth");
  if (resolution % 9 != 0)
    throw Error(
        "the letter E has resolution {}: its arms and gaps are ninths of the height, so use a "
        "multiple of 9",
        resolution);
  int const unit = resolution / 9;
  int const deep = cells_along(letter.depth, letter.height / resolution);
  Lattice lattice({8 * unit, 9 * unit, deep}, false);
  lattice.fill({0, 0, 0}, {2 * unit, 9 * unit, deep});
  for (int const arm : {0, 4, 8})
    lattice.fill({2 * unit, arm * unit, 0}, {8 * unit, (arm + 1) * unit, deep});
  return split(lattice, [&](Point const& u) {
    return Point{u[0] * letter.height * 4 / 9, u[1] * letter.height / 2, u[2] * letter.depth / 2};
  });
}

TetMesh make(CylinderShape const& cylinder, int resolution) {
  require_size(cylinder.radius, "radius");
  require_size(cylinder.length, "length");
  if (cylinder.axis < 0 || cylinder.axis > 2)
    throw Error("the axis of the cylinder is {}: it must be 0, 1 or 2", cylinder.axis);
  std::size_t const a = static_cast<std::size_t>(cylinder.axis), b = (a + 1) % 3, c = (a + 2) % 3;
  Cell cells{resolution, resolution, resolution};
  cells[a] = cells_along(cylinder.length, 2 * cylinder.radius / resolution);
  return split(Lattice(cells), [&](Point const& u) {
    auto const disk = onto_ball<2>({u[b], u[c]});
    Point p{};
    p[a] = u[a] * cylinder.length / 2, p[b] = cylinder.radius * disk[0];
    p[c] = cylinder.radius * disk[1];
    return p;
  });
}

TetMesh make(SphereShape const& sphere, int resolution) {
  require_size(sphere.radius, "radius");
  return split(Lattice({resolution, resolution, resolution}), [&](Point const& u) {
    Point p = onto_ball<3>(u);
    for (double& c : p) c *= sphere.radius;
    return p;
  });
}

TetMesh make(TorusShape const& torus, int resolution) {
  require_size(torus.radius, "radius");
  require_size(torus.tube_radius, "tube_radius");
  if (torus.tube_radius >= torus.radius)
    throw Error("the torus has tube_radius {} m and radius {} m: the tube must be the smaller one",
                torus.tube_radius, torus.radius);
  int const around = std::max(
      4, cells_along(2 * std::numbers::pi * torus.radius, 2 * torus.tube_radius / resolution));
  return split(Lattice({resolution, resolution, around}, true, true), [&](Point const& u) {
    auto const disk = onto_ball<2>({u[0], u[1]});
    double const distance = torus.radius + torus.tube_radius * disk[0];
    double const angle = std::numbers::pi * u[2];
    return Point{distance * std::cos(angle), torus.tube_radius * disk[1],
                 distance * std::sin(angle)};
  });
}

/// The widest angle of a cell in a curved wall, rad: the line between the middles of two neighbours
/// passes through the face between them, and leaves a half of it on either side.
double widest_cell(double radius, double thickness) {
  return 2 * std::acos(1 - thickness / (4 * (radius + thickness)));
}

TetMesh make(BowlShape const& bowl, int resolution) {
  require_size(bowl.radius, "radius");
  require_size(bowl.thickness, "thickness");
  require_size(bowl.height, "height");
  if (bowl.height > 1.8 * bowl.radius)
    throw Error("the bowl has height {} m and radius {} m: it is closed above 1.8 radii",
                bowl.height, bowl.radius);
  double const rim = std::acos(1 - bowl.height / bowl.radius);
  double const coarsest = widest_cell(bowl.radius, bowl.thickness);
  int const across = std::max(resolution, cells_along(2 * rim, coarsest));
  int const layers = cells_along(bowl.thickness, 2 * rim * bowl.radius / across);
  return split(Lattice({across, layers, across}), [&](Point const& u) {
    auto const disk = onto_ball<2>({u[0], u[2]});
    double const shell = std::hypot(disk[0], disk[1]);
    double const distance = bowl.radius + bowl.thickness * (1 - u[1]) / 2;
    double const out = shell > 0 ? distance * std::sin(rim * shell) / shell : 0;
    return Point{out * disk[0], -distance * std::cos(rim * shell), out * disk[1]};
  });
}

TetMesh make(FunnelShape const& funnel, int resolution) {
  require_size(funnel.radius, "radius");
  require_size(funnel.throat, "throat");
  require_size(funnel.height, "height");
  require_size(funnel.spout, "spout");
  require_size(funnel.thickness, "thickness");
  if (funnel.throat >= funnel.radius)
    throw Error("the funnel has throat {} m and radius {} m: the throat must be the smaller one",
                funnel.throat, funnel.radius);
  if (funnel.thickness >= funnel.spout)
    throw Error("the funnel has thickness {} m and spout {} m: the spout must be the longer one",
                funnel.thickness, funnel.spout);
  double const wider = funnel.radius - funnel.throat, slant = std::hypot(wider, funnel.height);
  // Where the wall bends, cells so short that the line between the middles of two stays within it.
  double const half_turn = std::atan2(wider, funnel.height) / 2;
  double const h =
      std::min((funnel.spout + slant) / resolution, funnel.thickness / (2 * std::sin(half_turn)));
  int const below = cells_along(funnel.spout, h), above = cells_along(slant, h);
  int const thick = cells_along(funnel.thickness, h);
  double const turn = std::numbers::pi * (funnel.radius + funnel.throat);
  double const coarsest = widest_cell(funnel.radius, funnel.thickness / thick);
  int const around =
      std::max({8, cells_along(turn, h), cells_along(2 * std::numbers::pi, coarsest)});
  // The outside is a mitre joint of two offset lines; (distance from the axis, height) of its ends.
  using Corner = std::array<double, 2>;
  double const across = funnel.thickness * funnel.height / slant;
  double const down = funnel.thickness * wider / slant;
  double const mitre = funnel.thickness * wider / (slant + funnel.height);
  std::array<Corner, 3> const inside{
      {{funnel.throat, -funnel.spout}, {funnel.throat, 0}, {funnel.radius, funnel.height}}};
  std::array<Corner, 3> const outside{{{funnel.throat + funnel.thickness, -funnel.spout},
                                       {funnel.throat + funnel.thickness, -mitre},
                                       {funnel.radius + across, funnel.height - down}}};
  int const along = below + above;
  return split(Lattice({thick, along, around}, true, true), [&](Point const& u) {
    double const cells = (u[1] + 1) / 2 * along;  // from the lower end
    bool const in_cone = cells > below;
    double const s = in_cone ? (cells - below) / above : cells / below, out = (u[0] + 1) / 2;
    std::size_t const first = in_cone ? 1 : 0;
    auto const at = [&](std::size_t c) {
      auto const on = [&](std::array<Corner, 3> const& line) {
        return (1 - s) * line[first][c] + s * line[first + 1][c];
      };
      return (1 - out) * on(inside) + out * on(outside);
    };
    double const angle = std::numbers::pi * u[2];
    return Point{at(0) * std::cos(angle), at(1), at(0) * std::sin(angle)};
  });
}

TetMesh make(TetsShape const& tets, int resolution) { return split_edges(tets.mesh, resolution); }

struct ResolutionUnit {
  int operator()(LetterEShape const&) const { return 9; }
  int operator()(BoxUnionShape const& shape) const {
    return shape.boxes.empty() ? 1 : std::max(1, coarsest_lattice(shape, Extent(shape)));
  }
  template <class Other>
  int operator()(Other const&) const {
    return 1;
  }
};

}  // namespace

int resolution_unit(Shape const& shape) { return std::visit(ResolutionUnit{}, shape); }

TetMesh make_shape(Shape const& shape, int resolution) {
  if (resolution < 1) throw Error("the resolution is {}: it must be at least 1", resolution);
  return std::visit([&](auto const& s) { return make(s, resolution); }, shape);
}

}  // namespace taut
