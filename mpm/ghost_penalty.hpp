// Light nodes, which particles hardly see, held to the body: a ghost penalty (Burman 2010), as
// finite elements have it where a boundary cuts cells, here over the nodes of a grid,
//
//   V(x) = Sum_l 1/2 k_l |d_l - Sum_j e_lj d_j|^2,      d = x - X,
//
// over the light nodes l, where e extrapolates linear functions from nodes j that more is seen of,
// and k_l = strength min_j k_j / e_lj^2, with k_j what resists node j: more would be a constraint
// on j as well, which single nodes are as slow to learn as they were before (measured: 2.3 times
// the iterations of `boxes`, where soft sheets hold one of metal).
//
// Without it, motions of light nodes that the few particles around them do not see are held by no
// more than their inertia, 1e-7 of what single nodes have where waves cross thousands of cells in a
// step: a Hessian that no smoother and no coarser level gets right. With it, a cycle takes as many
// iterations for stiff bodies as for soft ones. Its limit are extended B-splines (Hoellig et al.
// 2001; Yamaguchi, Moriguchi and Terada 2021 for material points), in which light nodes are no
// unknowns; but a term fits every minimiser, and matrices of 125 blocks a row: window and node lie
// within 3^3 nodes, so that what w couples, on the coarser level too, is at most two nodes apart.
//
// Affine motions cost nothing, so that where no node is fixed no momentum changes, linear or
// angular: Sum w = 0, Sum w X = 0, and the torque of the forces -k w s on x is s x s = 0. Fixed
// nodes are extrapolated from, but are no reason to hold others. A light node in a wall that slips
// or separates (slip.hpp) goes with the body more than with the wall; those further in are held
// back by it as ever. What it changes in a body is of the
// order of the error that its cut cells have already (docs/results.md). The idea of a penalty on
// single nodes, the window, and the numbers: derived and measured here.
#pragma once

#include <taut/core/exec/scan.hpp>
#include <taut/core/exec/sort.hpp>
#include <taut/core/potential/unknowns.hpp>
#include <taut/core/sparse/pattern.hpp>
#include <taut/mpm/boundary.hpp>
#include <taut/mpm/ghost_kernels.hpp>
#include <taut/mpm/particle_kernels.hpp>

#include <limits>

namespace taut {

struct GhostParams {
  double strength = 0.01;  ///< of what resists nodes that are extrapolated from, at most; 0: off
  double share = 0.03;     ///< light is a node that holds less than this of a neighbour's volume
  /// Where h^2 k / m of that neighbour, with k what resists it elastically, is as large: about the
  /// square of how many cells a wave crosses in a step. Below, inertia is enough.
  double ratio = 50;
};

/// The penalty as a term of the potential of a grid of quadratic splines or wider ones.
/// ParticleStepper tells it (`update`, `hold`) what is where.
template <Spline K = QuadraticSpline, class Precision_ = Mixed, class Space_ = DefaultSpace>
class GhostPenalty {
  static_assert(K::width >= 3,
                "taut: a ghost penalty couples nodes two apart; take quadratic splines");

public:
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;

  /// Throws Error for numbers that are out of range.
  explicit GhostPenalty(GhostParams const& params = {}) : params_(params) {
    if (!(params.strength >= 0 && params.strength <= 1) ||
        !(params.share > 0 && params.share <= 0.5) || !(params.ratio >= 0)) {
      throw Error(
          "ghost penalty: strength = {}, share = {}, ratio = {}; give 0 to 1, above 0 to 0.5, "
          "and 0 or more",
          params.strength, params.share, params.ratio);
    }
  }

  /// A grid is made around particles.
  void update(Particles<Precision, Space> const& particles, ParticleBlocks<K, Space> const& blocks,
              GridNodes<Space> const& nodes, Positions const& rest) {
    particles_ = particles;
    blocks_ = blocks.views();
    rest_ = rest;
    rows_.nodes = nodes;
    rows_.count = 0;
    ++version_;
  }
  /// These nodes are fixed in the step.
  void hold(Positions const&, Unknowns<Precision, Space> const& unknowns,
            BoundaryList<Space> const&, double) {
    unknowns_ = unknowns;
  }
  bool empty() const { return params_.strength == 0; }
  /// Finds the light nodes, where the step is long for what is stiff.
  void begin_step(StepStart<Precision, Space> const& start) const {
    ++version_;
    rows_.count = 0;
    int const n = unknowns_.size();
    kernels::NodeStiffness<Space, Precision> const stiff{
        start.stiffness, unknowns_.mass, start.time_step * start.time_step, start.has_inertia};
    if (empty() || maximum<Space>("stiffest_node", n, 0.0, stiff) < params_.ratio) return;
    find_volumes();
    grow(rows_.row, "ghost_row", std::size_t(n));
    kernels::IsLight<Space, Precision> const is_light{rows_.nodes, volume_,       unknowns_.fixed,
                                                      stiff,       params_.share, params_.ratio};
    rows_.count = exclusive_scan<Space, int>("ghost_rows", n, is_light, rows_.row);
    if (rows_.count == 0) return;
    if (rows_.count > most_rows) {
      throw Error("ghost penalty: {} light nodes are more than {}; take a coarser grid",
                  rows_.count, most_rows);
    }
    std::size_t const rows = static_cast<std::size_t>(rows_.count);
    grow(rows_.middle, "ghost_middle", rows);
    grow(rows_.node, "ghost_node", rows);
    grow(rows_.weight, "ghost_weight", rows);
    grow(rows_.stiffness, "ghost_stiffness", rows);
    grow(rows_.force, "ghost_force", rows);
    for_each<Space>("ghost_rows", n, kernels::WriteGhostRow<Space, Precision>{is_light, rows_});
    for_each<Space>(
        "ghost_stiffness", rows_.count,
        kernels::StiffenGhosts<Space, Precision>{rows_, unknowns_.fixed, stiff, params_.strength});
    sort_entries(n);
    reducer_.provide(rows_.count, 1);
  }
  /// Light nodes that are held to others.
  int light_nodes() const { return rows_.count; }
  GhostRows<Space> const& rows() const { return rows_; }

  double value(Positions const& x, double scale) const {
    return scale * sum(x, {}, 0, kernels::GhostSumOf::value);
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * sum(x, p, alpha, kernels::GhostSumOf::change);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * sum(x, p, 0, kernels::GhostSumOf::form);
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g) const {
    add(displacement(x), scale, fixed, g, {}, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Vectors const& diagonal) const {
    add(displacement(x), scale, fixed, g, diagonal, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Blocks const& blocks) const {
    add(displacement(x), scale, fixed, g, {}, blocks);
  }
  template <class... Curvature>
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Curvature const&... curvature) const {
    add_gradient(x, scale, fixed, g, curvature...);
    return -change(x, p, -alpha, scale);
  }
  void add_product(Positions const&, Vectors const& p, double scale, FixedMask<Space> const& fixed,
                   Vectors const& hp) const {
    add(p, scale, fixed, hp, {}, {});
  }
  void add_to(Matrix const& matrix, Positions const&, double scale,
              FixedMask<Space> const& fixed) const {
    if (rows_.count == 0) return;
    for_each<Space>("ghost_assemble", unknowns_.size(),
                    kernels::AssembleGhosts<Space, Matrix>{rows_, fixed, scale, matrix});
  }
  template <class Operator>
  void linearise(Positions const&, double scale, Operator& to) const {
    to.set_ghosts(rows_, scale);
  }
  double max_step(Positions const&, Vectors const&, double at_most) const { return at_most; }
  double max_prescribed_step(Positions const&, Vectors const&, double at_most) const {
    return at_most;
  }
  /// What has no part in a row stands as another node of it.
  void elements(std::vector<Connectivity>& kinds) const {
    constexpr int entries = GhostRows<Space>::entries;
    auto const node = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), rows_.node);
    elements_.clear();
    for (int r = 0; r < rows_.count; ++r) {
      int some = -1;
      for (int k = 0; k < entries; ++k) some = std::max(some, node(r, k));
      if (some < 0) continue;  // nothing to extrapolate from
      for (int k = 0; k < entries; ++k) elements_.push_back(node(r, k) < 0 ? some : node(r, k));
    }
    kinds.push_back({elements_, entries});
  }
  std::int64_t pattern_version(Positions const&) const { return version_; }

private:
  /// Entries are counted by int, with room for some more.
  static constexpr int most_rows =
      std::numeric_limits<int>::max() / (2 * GhostRows<Space>::entries);

  void find_volumes() const {
    int const n = rows_.nodes.count;
    grow(partial_, "ghost_volumes", std::size_t(BlockViews<K, Space>::nodes) * blocks_.patches);
    grow(volume_, "ghost_volume", std::size_t(n));
    for_each<Space>("ghost_volumes", blocks_.patches,
                    kernels::VolumeOfPatch<Space, Precision, K>{
                        blocks_, {particles_, rows_.nodes.dx, blocks_.cell}, partial_});
    using Write = kernels::WriteVolume<Space>;
    for_each<Space>("ghost_volumes", n,
                    kernels::GatherRows<Space, double, K, 1, Write>{blocks_, partial_, {volume_}});
  }
  /// Which entries are a node's.
  void sort_entries(int n) const {
    int const entries = GhostRows<Space>::entries * rows_.count;
    grow(bucket_, "ghost_bucket", std::size_t(entries));
    grow(rows_.entry, "ghost_entry", std::size_t(entries));
    grow(rows_.begin, "ghost_begin", std::size_t(n) + 2);
    for_each<Space>("ghost_entries", entries, kernels::NodeOfEntry<Space>{rows_, bucket_, n});
    if (sort_capacity_ < entries) {
      sort_capacity_ = entries + entries / 4;
      sort_ = BucketSort<Space>(sort_capacity_);
    }
    sort_.sort(entries, bucket_, n + 1, rows_.begin, rows_.entry);
  }

  using Displacement = kernels::Displacement<Space, typename Precision::position>;
  Displacement displacement(Positions const& x) const { return {x, rest_}; }

  double sum(Positions const& x, Vectors const& p, double alpha, kernels::GhostSumOf what) const {
    if (rows_.count == 0) return 0;
    using Kernel = kernels::GhostSum<Space, Displacement, Vectors>;
    return double(reducer_.template sum<1>("ghost_energy", rows_.count,
                                           Kernel{rows_, displacement(x), p, alpha, what})[0]);
  }
  template <class Field>
  void add(Field const& field, double scale, FixedMask<Space> const& fixed, Vectors const& g,
           Vectors const& diagonal, Blocks const& blocks) const {
    if (rows_.count == 0) return;
    for_each<Space>("ghost_force", rows_.count,
                    kernels::GhostForce<Space, Field>{rows_, field, scale});
    for_each<Space>("ghost_gradient", unknowns_.size(),
                    kernels::SpreadGhosts<Space, Real>{rows_, fixed, scale, g, diagonal, blocks});
  }

  GhostParams params_;
  Unknowns<Precision, Space> unknowns_;
  Particles<Precision, Space> particles_;
  BlockViews<K, Space> blocks_;
  Positions rest_;
  // Of the step that has begun.
  mutable GhostRows<Space> rows_;
  mutable std::int64_t version_ = 0;
  mutable Kokkos::View<double*, typename Space::memory> partial_, volume_;
  mutable typename GhostRows<Space>::Indices bucket_;
  mutable BucketSort<Space> sort_;
  mutable int sort_capacity_ = 0;
  mutable Reducer<Space, double> reducer_;
  mutable std::vector<int> elements_;
};

}  // namespace taut
