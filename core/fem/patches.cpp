#include <taut/core/exec/buckets.hpp>
#include <taut/core/fem/connected.hpp>
#include <taut/core/fem/patches.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <utility>

namespace taut {

namespace {

// Greedy colouring: patches of one colour share no vertex.
std::vector<std::vector<int>> colour(Patches const& p) {
  int const count = p.count();
  std::vector<int> colour_of(count, -1);
  std::vector<int> owner(p.vertex.size());
  for (int q = 0; q < count; ++q) {
    std::fill(owner.begin() + p.local_begin[q], owner.begin() + p.local_begin[q + 1], q);
  }
  std::vector<std::vector<int>> colours;
  std::vector<int> taken;  // taken[c] == q: colour c is used by a neighbour of q
  for (int q = 0; q < count; ++q) {
    for (int l = p.local_begin[q]; l < p.local_begin[q + 1]; ++l) {
      int const v = p.vertex[l];
      for (int k = p.occurrence_begin[v]; k < p.occurrence_begin[v + 1]; ++k) {
        int const neighbour = owner[p.occurrence[k]];
        if (colour_of[neighbour] >= 0) taken[colour_of[neighbour]] = q;
      }
    }
    int c = 0;
    while (c < static_cast<int>(colours.size()) && taken[c] == q) ++c;
    if (c == static_cast<int>(colours.size())) {
      colours.emplace_back();
      taken.push_back(-1);
    }
    colour_of[q] = c;
    colours[c].push_back(q);
  }
  return colours;
}

}  // namespace

Patches make_patches(std::span<Tet const> tets, std::span<int const> material, int vertices,
                     int lanes, int patch_size) {
  // Corners are stored as 4 x local vertex in 16 bits, and a tet has at most four vertices.
  constexpr int most = 4096;
  if (patch_size < 1 || patch_size > most)
    throw Error("a patch of {} tets: choose patch_size from 1 to {}", patch_size, most);
  Patches p;
  p.lanes = lanes;
  p.pack_begin = {0};
  p.local_begin = {0};
  p.incidence_begin = {0};
  std::vector<int> local_of(vertices, -1);  // local index of a vertex in the patch being built
  int const count = static_cast<int>(tets.size());
  std::vector<std::int32_t> const body = smallest_connected<4>(vertices, tets);
  for (int first = 0; first < count;) {
    int last = first;
    auto const fits = [&](int t) {
      return t - first < patch_size && material[t] == material[first] &&
             body[tets[t][0]] == body[tets[first][0]];
    };
    while (last < count && fits(last)) ++last;
    int const packs = (last - first + lanes - 1) / lanes;
    int const pack0 = p.pack_begin.back(), local0 = p.local_begin.back();
    p.corner.resize(std::size_t(pack0 + packs) * 4 * lanes);
    std::vector<int> slot_vertex(std::size_t(packs) * 4 * lanes, -1);
    for (int e = 0; e < packs * lanes; ++e) {
      // Lanes of a pack come from places far apart in the patch: neighbours share vertices, and
      // adding to a vertex twice in a row waits for the first sum.
      int const at = first + e % lanes * packs + e / lanes;
      int const t = std::min(at, last - 1);
      bool const padding = at >= last;
      p.tet.push_back(t);
      p.padding.push_back(padding);
      for (int a = 0; a < 4; ++a) {
        int const v = tets[t][(a + 1) % 4];
        if (local_of[v] < 0) {
          local_of[v] = static_cast<int>(p.vertex.size()) - local0;
          p.vertex.push_back(v);
        }
        int const slot = (e / lanes * 4 + a) * lanes + e % lanes;
        p.corner[std::size_t(pack0) * 4 * lanes + slot] =
            static_cast<std::uint16_t>(4 * local_of[v]);
        if (!padding) slot_vertex[slot] = local_of[v];
      }
    }
    int const locals = static_cast<int>(p.vertex.size()) - local0;
    // Incidence in the order of the slots, so that a sum over it equals a serial scatter.
    std::vector<std::vector<std::uint16_t>> slots(locals);
    for (std::size_t slot = 0; slot < slot_vertex.size(); ++slot) {
      if (slot_vertex[slot] >= 0) {
        slots[slot_vertex[slot]].push_back(static_cast<std::uint16_t>(slot));
      }
    }
    for (auto const& s : slots) {
      p.incidence.insert(p.incidence.end(), s.begin(), s.end());
      p.incidence_begin.push_back(static_cast<int>(p.incidence.size()));
    }
    for (std::size_t l = local0; l < p.vertex.size(); ++l) local_of[p.vertex[l]] = -1;
    p.pack_begin.push_back(pack0 + packs);
    p.local_begin.push_back(static_cast<int>(p.vertex.size()));
    p.material.push_back(material[first]);
    p.body.push_back(body[tets[first][0]]);
    p.max_packs = std::max(p.max_packs, packs);
    p.max_locals = std::max(p.max_locals, locals);
    first = last;
  }
  Buckets occurrences = sort_into_buckets(p.vertex, vertices);
  p.occurrence_begin = std::move(occurrences.begin);
  p.occurrence = std::move(occurrences.item);
  // The rows of a vertex lie together: a late store to a row far away delays nobody, a late load
  // does.
  p.row.assign(p.vertex.size(), -1);
  p.shared_begin = {0};
  int rows = 0;
  for (int v = 0; v < vertices; ++v) {
    int const begin = p.occurrence_begin[v], end = p.occurrence_begin[v + 1];
    if (end - begin < 2) continue;
    for (int k = begin; k < end; ++k) p.row[p.occurrence[k]] = rows++;
    p.shared.push_back(v);
    p.shared_begin.push_back(rows);
  }
  p.colours = colour(p);
  return p;
}

}  // namespace taut
