#include <taut/core/fem/subdivision.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <map>
#include <utility>

namespace taut {
namespace {

constexpr double max_tets = 1 << 27;

/// A point of the subdivision: which vertices it is the mean of, with whole weights that sum to n.
/// Zero weights are left out, so that all tets around an edge or face mean the same point.
using Mean = std::vector<std::pair<std::int32_t, int>>;

class EdgeSplitter {
public:
  EdgeSplitter(TetMesh const& mesh, int n) : mesh_(mesh), n_(n) { result_.points = mesh.points; }

  void split(Tet corners) {
    bool const even = sort(corners);
    constexpr std::array<std::array<std::size_t, 3>, 6> orders{
        {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};  // the even ones first
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j <= i; ++j)
        for (int k = 0; k <= j; ++k)
          for (std::size_t order = 0; order < 6; ++order) {
            std::array<int, 3> at{i, j, k};
            Tet child{point(corners, at)};
            bool inside = true;
            for (std::size_t step = 0; step < 3; ++step) {
              ++at[orders[order][step]];
              inside = inside && at[0] >= at[1] && at[1] >= at[2];
              if (inside) child[step + 1] = point(corners, at);
            }
            if (!inside) continue;
            if (even != (order < 3)) std::swap(child[2], child[3]);
            result_.tets.push_back(child);
          }
  }

  TetMesh take() { return std::move(result_); }

private:
  /// Whether the sorting permutation is even.
  static bool sort(Tet& tet) {
    bool even = true;
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = a + 1; b < 4; ++b)
        if (tet[b] < tet[a]) {
          std::swap(tet[a], tet[b]);
          even = !even;
        }
    return even;
  }

  std::int32_t point(Tet const& corners, std::array<int, 3> const& at) {
    std::array<int, 4> const weights{n_ - at[0], at[0] - at[1], at[1] - at[2], at[2]};
    Mean mean;
    for (std::size_t a = 0; a < 4; ++a)
      if (weights[a] > 0) mean.emplace_back(corners[a], weights[a]);
    if (mean.size() == 1) return mean.front().first;
    auto const [entry, is_new] =
        number_.try_emplace(mean, static_cast<std::int32_t>(result_.points.size()));
    if (is_new) {
      Point x{};
      for (auto const& [vertex, weight] : mean)
        for (std::size_t c = 0; c < 3; ++c)
          x[c] += weight * mesh_.points[static_cast<std::size_t>(vertex)][c] / n_;
      result_.points.push_back(x);
    }
    return entry->second;
  }

  TetMesh const& mesh_;
  int n_;
  TetMesh result_;
  std::map<Mean, std::int32_t> number_;
};

}  // namespace

TetMesh split_edges(TetMesh const& mesh, int n) {
  if (n < 1) throw Error("the resolution is {}: it must be at least 1", n);
  double const pieces = static_cast<double>(n) * n * n;
  if (static_cast<double>(mesh.tets.size()) * pieces > max_tets)
    throw Error("the shape needs more than {:.3g} tets: lower its resolution", max_tets);
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (std::int32_t const v : mesh.tets[t])
      if (v < 0 || v >= std::ssize(mesh.points))
        throw Error("tet {} names vertex {}, but there are {}: count vertices from 0", t, v,
                    mesh.points.size());
  EdgeSplitter splitter(mesh, n);
  for (Tet const& tet : mesh.tets) splitter.split(tet);
  return splitter.take();
}

}  // namespace taut
