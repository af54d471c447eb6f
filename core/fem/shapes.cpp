#include <taut/core/fem/shapes.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace taut {
namespace {

constexpr std::int64_t max_cells = std::int64_t{1} << 24;

using Cell = std::array<int, 3>;

/// Cells of a lattice, filled or empty. Axis 2 may close on itself.
class Lattice {
public:
  explicit Lattice(Cell const& size, bool filled = true, bool periodic = false)
      : size_(size), periodic_(periodic) {
    std::int64_t count = 1;
    for (int const n : size) {
      count *= n;  // each factor and the product so far are below 2^31 and 2^24: no overflow
      if (count > max_cells)
        throw Error("the shape needs more than {} lattice cells: lower its resolution", max_cells);
    }
    filled_.assign(static_cast<std::size_t>(count), filled);
  }

  void fill(Cell const& low, Cell const& high) {
    for (int i = low[0]; i < high[0]; ++i)
      for (int j = low[1]; j < high[1]; ++j)
        for (int k = low[2]; k < high[2]; ++k) filled_[index({i, j, k})] = true;
  }

  bool filled(Cell cell) const {
    if (periodic_) cell[2] = (cell[2] + size_[2]) % size_[2];
    for (std::size_t a = 0; a < 3; ++a)
      if (cell[a] < 0 || cell[a] >= size_[a]) return false;
    return filled_[index(cell)];
  }

  Cell const& size() const { return size_; }
  bool periodic() const { return periodic_; }

private:
  std::size_t index(Cell const& c) const {
    return static_cast<std::size_t>((c[0] * size_[1] + c[1]) * size_[2] + c[2]);
  }

  Cell size_;
  bool periodic_;
  std::vector<bool> filled_;
};

/// Whether the cells in `mask` (bit 4x + 2y + z of a 2 x 2 x 2 block) hang together by faces.
bool face_connected(unsigned mask) {
  unsigned reached = mask & (0u - mask);
  for (unsigned last = 0; reached != last;) {
    last = reached;
    reached |= ((reached & 0xF0u) >> 4 | (reached & 0x0Fu) << 4 | (reached & 0xCCu) >> 2 |
                (reached & 0x33u) << 2 | (reached & 0xAAu) >> 1 | (reached & 0x55u) << 1) &
               mask;
  }
  return reached == mask;
}

/// The boundary of a union of cells is a manifold when around every vertex both the filled and the
/// empty cells hang together by faces (well-composed sets: Latecki 1997).
void require_manifold(Lattice const& lattice) {
  auto const [nx, ny, nz] = lattice.size();
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k) {
        unsigned mask = 0;
        for (int b = 0; b < 8; ++b) {
          bool const filled =
              lattice.filled({i - 1 + (b >> 2), j - 1 + (b >> 1 & 1), k - 1 + (b & 1)});
          mask |= static_cast<unsigned>(filled) << b;
        }
        if (!face_connected(mask) || !face_connected(~mask & 0xFFu))
          throw Error(
              "boxes of the union touch in an edge or a vertex only, at lattice vertex ({}, {}, "
              "{}): "
              "let them share a face or keep them apart",
              i, j, k);
      }
}

/// Splits the filled cells into tets. `map` takes lattice coordinates u in [-1, 1]^3, exactly
/// antisymmetric about the middle, to a point.
template <class Map>
TetMesh split(Lattice const& lattice, Map const& map) {
  // Vertices sit on the lattice refined by two: corners at even coordinates, centres of cells at
  // odd.
  Cell const& n = lattice.size();
  Cell const doubled{2 * n[0] + 1, 2 * n[1] + 1, lattice.periodic() ? 2 * n[2] : 2 * n[2] + 1};
  auto const vertex = [&](Cell const& c) {
    int const z = lattice.periodic() ? (c[2] + doubled[2]) % doubled[2] : c[2];
    return static_cast<std::int32_t>((c[0] * doubled[1] + c[1]) * doubled[2] + z);
  };

  TetMesh mesh;
  for (std::size_t a = 0; a < 3; ++a) {
    std::size_t const b = (a + 1) % 3, c = (a + 2) % 3;
    bool const closed = a == 2 && lattice.periodic();
    for (int i = 0; i <= n[a] - closed; ++i)
      for (int j = 0; j < n[b]; ++j)
        for (int k = 0; k < n[c]; ++k) {
          auto const at = [&](int along, int across, int up) {
            Cell r{};
            r[a] = along, r[b] = across, r[c] = up;
            return r;
          };
          bool const below = lattice.filled(at(i - 1, j, k)), above = lattice.filled(at(i, j, k));
          if (!below && !above) continue;
          std::int32_t const low = vertex(at(below ? 2 * i - 1 : 2 * i, 2 * j + 1, 2 * k + 1));
          std::int32_t const high = vertex(at(above ? 2 * i + 1 : 2 * i, 2 * j + 1, 2 * k + 1));
          std::array<std::int32_t, 4> const ring{
              vertex(at(2 * i, 2 * j, 2 * k)), vertex(at(2 * i, 2 * j + 2, 2 * k)),
              vertex(at(2 * i, 2 * j + 2, 2 * k + 2)), vertex(at(2 * i, 2 * j, 2 * k + 2))};
          for (std::size_t m = 0; m < 4; ++m)
            mesh.tets.push_back({low, ring[m], ring[(m + 1) % 4], high});
        }
  }

  std::vector<std::int32_t> number(static_cast<std::size_t>(doubled[0]) *
                                       static_cast<std::size_t>(doubled[1]) *
                                       static_cast<std::size_t>(doubled[2]),
                                   -1);
  for (Tet const& tet : mesh.tets)
    for (std::int32_t const v : tet) number[static_cast<std::size_t>(v)] = 0;
  auto const coordinate = [](int i, int cells) { return static_cast<double>(i - cells) / cells; };
  std::size_t next = 0;
  for (int i = 0; i < doubled[0]; ++i)
    for (int j = 0; j < doubled[1]; ++j)
      for (int k = 0; k < doubled[2]; ++k, ++next) {
        if (number[next] < 0) continue;
        number[next] = static_cast<std::int32_t>(mesh.points.size());
        mesh.points.push_back(
            map(Point{coordinate(i, n[0]), coordinate(j, n[1]), coordinate(k, n[2])}));
      }
  for (Tet& tet : mesh.tets)
    for (std::int32_t& v : tet) v = number[static_cast<std::size_t>(v)];
  return mesh;
}

void require_size(double value, std::string_view what) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error("the {} of the shape is {} m: it must be positive and finite", what, value);
}

/// Number of cells of size h along a length, for cells as near to cubes as possible.
int cells_along(double length, double h) {
  return static_cast<int>(
      std::clamp(std::round(length / h), 1.0, static_cast<double>(max_cells) + 1));
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

TetMesh make(BoxUnionShape const& shape, int resolution) {
  if (shape.boxes.empty()) throw Error("the union has no boxes: give at least one");
  Point low = shape.boxes.front()[0], high = shape.boxes.front()[1];
  for (auto const& [box_low, box_high] : shape.boxes)
    for (std::size_t a = 0; a < 3; ++a) {
      require_size(box_high[a] - box_low[a], "size of a box (highest minus lowest corner)");
      low[a] = std::min(low[a], box_low[a]);
      high[a] = std::max(high[a], box_high[a]);
    }
  Point const size{high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  double const longest = *std::max_element(size.begin(), size.end());

  auto const fits = [&](int cells) {
    double const h = longest / cells;
    for (auto const& box : shape.boxes)
      for (Point const& corner : box)
        for (std::size_t a = 0; a < 3; ++a) {
          double const steps = (corner[a] - low[a]) / h;
          if (std::abs(steps - std::round(steps)) > 1e-6) return false;
        }
    return true;
  };
  if (!fits(resolution)) {
    int other = 1;
    while (other < 1000 && !fits(other)) ++other;
    if (other == 1000)
      throw Error(
          "the corners of the boxes lie on no common lattice: give multiples of one length");
    throw Error("the boxes' corners are off the lattice of resolution {}: use a multiple of {}",
                resolution, other);
  }

  double const h = longest / resolution;
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
    for (std::size_t a = 0; a < 3; ++a) p[a] = (low[a] + high[a]) / 2 + u[a] * size[a] / 2;
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

}  // namespace

TetMesh make_shape(Shape const& shape, int resolution) {
  if (resolution < 1) throw Error("the resolution is {}: it must be at least 1", resolution);
  return std::visit([&](auto const& s) { return make(s, resolution); }, shape);
}

}  // namespace taut
