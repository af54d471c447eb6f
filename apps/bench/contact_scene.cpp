#include <taut/apps/bench/contact_scene.hpp>
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/fem/shapes.hpp>

#include <cmath>
#include <numbers>

namespace taut {
namespace {

constexpr double contacts_per_cell = 35;  ///< measured

}  // namespace

ContactScene::ContactScene(int contacts)
    : cells(std::max(3, static_cast<int>(std::lround(std::sqrt(contacts / contacts_per_cell))))) {
  double const edge = 1.0 / cells;
  TetMesh const sheet = make_shape(BoxShape{{1, edge, 1}}, cells);
  // Edges of length one and half the root of two, one to two: their mean is 0.8 of a cell.
  double const about = 0.3 * 0.8 * edge;
  double const wave = 3 * std::numbers::pi, turn = 0.1 * std::numbers::pi;
  // The chords of a mesh cut a wave of this height short by less than a tenth of the gap.
  double const height = std::min(0.04, 0.05 * cells / (wave * wave));
  TetMesh both;
  std::vector<int> body;
  for (int b = 0; b < 2; ++b) {
    int const first = static_cast<int>(both.points.size());
    double const c = b == 0 ? 1 : std::cos(turn), s = b == 0 ? 0 : std::sin(turn);
    for (Point const& X : sheet.points) {
      double const x = c * X[0] + s * X[2], z = c * X[2] - s * X[0];
      double const level = height * std::sin(wave * x) * std::sin(wave * z);
      double const gap = about * (0.8 + 0.6 * std::sin(5 * x + 1) * std::sin(4 * z));
      both.points.push_back({x, level + X[1] + b * (edge + gap), z});
      body.push_back(b);
    }
    for (Tet t : sheet.tets) {
      for (std::int32_t& v : t) v += first;
      both.tets.push_back(t);
    }
  }
  Ordering const order = locality_order(both);
  for (std::int32_t v : order.vertices) {
    Point const& X = both.points[v];
    rest.points.push_back(X);
    object.push_back(body[v]);
    double const down = body[v] == 0 ? 0 : -0.02 * about;
    direction.push_back({0.3 * down * std::sin(7 * X[2]), down * (0.7 + 0.3 * std::sin(6 * X[0])),
                         0.3 * down * std::sin(5 * X[0])});
  }
  for (std::int32_t t : order.tets) {
    Tet tet;
    for (int a = 0; a < 4; ++a) tet[a] = order.new_vertex[both.tets[t][a]];
    rest.tets.push_back(tet);
  }
  surface = make_surface(boundary_faces(rest.tets), object);
  dhat = 0.3 * edge_lengths(surface, rest.points).mean;
  mass = lumped_mass(rest, std::vector<double>(rest.tets.size(), 1000.0));
}

}  // namespace taut
