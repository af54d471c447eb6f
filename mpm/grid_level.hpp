// One level of a sparse grid: the set of its nodes on the host, and their numbers where kernels
// run.
#pragma once

#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/bits.hpp>
#include <taut/mpm/grid_nodes.hpp>
#include <taut/mpm/topology.hpp>

#include <bit>
#include <cmath>
#include <limits>

namespace taut {
namespace kernels {

template <class S>
struct FindNeighbours {
  LeafTable<S> leaves;
  typename GridNodes<S>::template PerLeaf<int* [27]> neighbours;
  KOKKOS_FUNCTION void operator()(int l) const {
    for (int t = 0; t < 27; ++t) {
      neighbours(l, t) = leaves.find(leaves.origin(l, 0) + 8 * (t / 9 - 1),
                                     leaves.origin(l, 1) + 8 * (t / 3 % 3 - 1),
                                     leaves.origin(l, 2) + 8 * (t % 3 - 1));
    }
  }
};

/// The places of the nodes of a leaf.
template <class S>
struct PlaceNodes {
  GridNodes<S> nodes;
  KOKKOS_FUNCTION void operator()(int l) const {
    int node = nodes.begin(l);
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t rest = nodes.mask(l, x); rest != 0; rest &= rest - 1, ++node) {
        int const bit = lowest_bit(rest);
        nodes.ijk(node, 0) = nodes.leaves.origin(l, 0) + x;
        nodes.ijk(node, 1) = nodes.leaves.origin(l, 1) + bit / 8;
        nodes.ijk(node, 2) = nodes.leaves.origin(l, 2) + bit % 8;
        nodes.leaf(node) = l;
      }
  }
};

}  // namespace kernels

/// A table of leaves that is made on the host.
template <class S>
class LeafIndex {
public:
  void assign(std::vector<std::array<int, 3>> const& origin) {
    std::size_t const n = origin.size(), buckets = std::bit_ceil(2 * n);
    grow(table_.origin, origin_, "leaf_origin", n);
    grow(table_.bucket, bucket_, "leaf_bucket", buckets);
    table_.count = static_cast<int>(n);
    table_.wrap = static_cast<unsigned>(buckets) - 1;
    for (std::size_t b = 0; b < buckets; ++b) bucket_(b) = -1;
    for (std::size_t l = 0; l < n; ++l) {
      for (int c = 0; c < 3; ++c) origin_(l, c) = origin[l][c];
      unsigned b = table_.hash(origin[l][0], origin[l][1], origin[l][2]) & table_.wrap;
      while (bucket_(b) >= 0) b = (b + 1) & table_.wrap;
      bucket_(b) = static_cast<int>(l);
    }
    copy_front<S>(origin_, table_.origin, n);
    copy_front<S>(bucket_, table_.bucket, buckets);
  }
  LeafTable<S> const& table() const { return table_; }

private:
  LeafTable<S> table_;
  typename decltype(LeafTable<S>::origin)::HostMirror origin_;
  typename decltype(LeafTable<S>::bucket)::HostMirror bucket_;
};

/// Makes a grid's nodes from the sets of another. Allocates only where there are more of them than
/// ever before; the tree of the topology also where it reaches a new leaf.
template <class S>
class GridLevel {
public:
  /// The nodes of a list, each leaf in it once.
  void assign(LeafList const& leaves, double dx) {
    topology_.clear();
    for (int l = 0; l < leaves.size(); ++l) topology_.add(leaves.origin[l], leaves.mask[l]);
    number(dx);
  }
  /// The nodes that kernels of `width` nodes per axis (2 to 4) reach whose lowest nodes are `from`;
  /// `dx` is the spacing, m.
  void reach(LeafList const& from, int width, double dx) {
    topology_.reach(from, width);
    number(dx);
  }
  /// The nodes that are within `radius` fine nodes of one of `fine`, at twice the spacing `dx`.
  void coarsen(LeafList const& fine, int radius, double dx) {
    topology_.coarsen(fine, radius);
    number(2 * dx);
  }

  GridNodes<S> const& nodes() const { return nodes_; }
  LeafList const& leaves() const { return list_; }

private:
  void number(double dx) {
    topology_.list(list_);
    std::size_t const n = list_.size();
    index_.assign(list_.origin);
    nodes_.leaves = index_.table();
    nodes_.dx = dx;
    grow(nodes_.begin, begin_, "leaf_begin", n + 1);
    grow(nodes_.mask, mask_, "leaf_mask", n);
    grow(nodes_.first, first_, "leaf_first", n);
    std::int64_t count = 0;
    for (std::size_t l = 0; l < n; ++l) {
      begin_(l) = static_cast<int>(count);
      for (int x = 0; x < 8; ++x) {
        mask_(l, x) = list_.mask[l][x];
        first_(l, x) = static_cast<int>(count);
        count += std::popcount(list_.mask[l][x]);
      }
      if (count > std::numeric_limits<int>::max()) {
        throw Error("sparse grid: more than 2^31 nodes of {} m: choose a larger spacing", dx);
      }
    }
    begin_(n) = static_cast<int>(count);
    nodes_.count = static_cast<int>(count);
    copy_front<S>(begin_, nodes_.begin, n + 1);
    copy_front<S>(mask_, nodes_.mask, n);
    copy_front<S>(first_, nodes_.first, n);

    grow(nodes_.neighbours, "leaf_neighbours", n);
    grow(nodes_.ijk, "node_ijk", static_cast<std::size_t>(count));
    grow(nodes_.leaf, "node_leaf", static_cast<std::size_t>(count));
    for_each<S>("leaf_neighbours", static_cast<int>(n),
                kernels::FindNeighbours<S>{nodes_.leaves, nodes_.neighbours});
    for_each<S>("place_nodes", static_cast<int>(n), kernels::PlaceNodes<S>{nodes_});
  }

  Topology topology_;
  LeafList list_;
  LeafIndex<S> index_;
  GridNodes<S> nodes_;
  typename decltype(GridNodes<S>::begin)::HostMirror begin_;
  typename decltype(GridNodes<S>::mask)::HostMirror mask_;
  typename decltype(GridNodes<S>::first)::HostMirror first_;
};

}  // namespace taut
