// The coarser levels of geometric (particle) multigrid, the baseline that HOT is compared with
// (Wang et al. 2020, section 5; "--baseline" in their code): level l is a grid of spacing 2^l dx of
// its own, made around the particles as the fine one is, with the quadratic kernels of that
// spacing:
//
//   A_l = sum_p m_p w^l_p + sum_p G^l_p' K_p G^l_p,
//
// with the numbers K_p of particle_operator_kernels.hpp, which know no grid but through the
// spacing: K_p goes with 1 / dx^2. (Nor do they know of a ghost penalty, which is in A_0.) Levels
// hang together by linear embedding, but A_l is not the P'AP of the finer one, so a cycle is
// symmetric, and not always smaller than the inverse: it may even be indefinite, which minimisers
// meet as a direction that does not descend.
//
// Boundaries are not known here: a coarse node is fixed where the finer level is at its place
// (where that has no node, where the nearest ones are). What else acts on single nodes
// (slip) is handed down, weight by weight.
#pragma once

#include <taut/mpm/material_range.hpp>
#include <taut/mpm/multigrid.hpp>
#include <taut/mpm/particle_operator.hpp>
#include <taut/mpm/sparse_grid.hpp>
#include <taut/mpm/transfer.hpp>

#include <deque>

namespace taut {

namespace kernels {

/// Where the particles are among the slots of the fine level.
template <Spline K, class S>
struct SlotOfParticle {
  BlockViews<K, S> blocks;
  Kokkos::View<int*, typename S::memory> slot;
  KOKKOS_FUNCTION void operator()(int s) const {
    int const p = blocks.particle(s);
    if (p >= 0) slot(p) = s;
  }
};

/// The numbers of the particles on a grid of spacing dx: those of the fine one, in other slots.
template <Spline K, class Precision, class S>
struct NumbersOfLevel {
  using Real = typename Precision::real;
  BlockViews<K, S> blocks;
  VectorField<typename Precision::position, S> x;
  Kokkos::View<int const*, typename S::memory> fine_slot;
  Kokkos::View<Real const*, typename S::memory> fine;
  double per_dx;
  Real factor;  ///< (dx_fine / dx)^2
  Kokkos::View<Real*, typename S::memory> to;

  KOKKOS_FUNCTION void operator()(int slot) const {
    using Layout = OperatorLayout<S, Real>;
    int const p = blocks.particle(slot), like = blocks.like(slot);
    for (int c = 0; c < 3; ++c) {
      double const at = double(x(like, c)) * per_dx;
      to(Layout::place(slot, c)) = Real(place_in_cell<K>(at, blocks.cell(like, c)));
    }
    for (int k = 3; k < operator_numbers; ++k) {
      to(Layout::place(slot, k)) = p >= 0 ? factor * fine(Layout::place(fine_slot(p), k)) : Real(0);
    }
  }
};

/// What acts on fine nodes besides their mass.
template <class S, class T, class Mass>
struct TakeMassOff {
  BlockField<T, S> local;
  Mass mass;
  BlockField<T, S> rest;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int k = 0; k < 6; ++k) rest(i, k) = local(i, k) - (k < 3 ? T(mass(i)) : T(0));
  }
};

/// Of a coarse node: whether it is fixed, what acts on it besides its mass, and both together.
template <class S, class T, class Mass>
struct CoarseNode {
  GridNodes<S> fine, coarse;
  FixedNodes<S> fine_fixed;
  BlockField<T, S> fine_rest;
  Mass mass;
  Kokkos::View<std::uint8_t*, typename S::memory> fixed;
  BlockField<T, S> rest, local;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const at[3] = {2 * coarse.ijk(i, 0), 2 * coarse.ijk(i, 1), 2 * coarse.ijk(i, 2)};
    fixed(i) = is_held(at);
    T sum[6] = {};
    for (int k = 0; k < 27; ++k) {
      int const d[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
      int const f = fine.node(at[0] + d[0], at[1] + d[1], at[2] + d[2]);
      if (f < 0 || is_fixed<S>(fine_fixed, f)) continue;
      double const w = LinearEmbedding::weight(d[0]) * LinearEmbedding::weight(d[1]) *
                       LinearEmbedding::weight(d[2]);
      for (int m = 0; m < 6; ++m) sum[m] += T(w) * fine_rest(f, m);
    }
    for (int m = 0; m < 6; ++m) {
      rest(i, m) = sum[m];
      local(i, m) = sum[m] + (m < 3 ? T(mass(i)) : T(0));
    }
  }
  /// Kernels of three fine cells reach the coarse node. It goes by the nearest nodes there.
  KOKKOS_FUNCTION bool is_held(int const (&at)[3]) const {
    constexpr int reach = 3;
    int nearest = 3 * reach * reach + 1;
    bool held = false;
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y)
        for (int z = -reach; z <= reach; ++z) {
          int const square = x * x + y * y + z * z;
          if (square > nearest) continue;
          int const f = fine.node(at[0] + x, at[1] + y, at[2] + z);
          if (f < 0) continue;
          bool const own = is_fixed<S>(fine_fixed, f);
          held = square < nearest ? own : held && own;
          nearest = square;
        }
    return held;
  }
};

}  // namespace kernels

/// Over the particles of P with kernel K. `T` is Precision::real.
template <Spline K, class P, class S>
class GeometricLevels final : public LevelSource<S, typename P::real, K::width - 1> {
public:
  using T = typename P::real;
  using Operator = ParticleOperator<K, T, S>;
  using Level = MatrixLevel<S, T, K::width - 1>;

  /// A hierarchy above a fine level is to be made, from its operator, what acts on its nodes alone,
  /// and the potential of which it is. Throws Error if no term of it shows its particles.
  template <class E>
  void start(Operator const& fine, BlockField<T, S> const& local, E& e) {
    bool found = false;
    e.for_each_term([&](auto& term) {
      if constexpr (requires { term.particles(); }) {
        particles_ = term.particles();
        found = true;
      }
    });
    if (!found) throw Error("geometric multigrid: no term of this potential shows its particles");
    fine_ = &fine;
    BlockViews<K, S> const& blocks = fine.blocks();
    grow(slot_, "fine_slot", particles_.count);
    for_each<S>("slot_of_particle", blocks.slots, kernels::SlotOfParticle<K, S>{blocks, slot_});
    if (material_.extent_int(0) < particles_.count) {
      material_ = decltype(material_)("level_material", particles_.count);
    }
    grow(rest_, "level_rest", fine.nodes().count);
    using Mass = std::decay_t<decltype(e.mass())>;
    for_each<S>("take_mass_off", fine.nodes().count,
                kernels::TakeMassOff<S, T, Mass>{local, e.mass(), rest_});
  }

  void make(int l, Level& level) override {
    if (static_cast<std::size_t>(l) == grids_.size()) grids_.emplace_back();
    Grid& own = grids_[l];
    GridNodes<S> const& finer = l == 0 ? fine_->nodes() : grids_[l - 1].nodes.nodes();
    FixedNodes<S> const held = l == 0 ? fine_->fixed() : FixedNodes<S>(grids_[l - 1].fixed);
    double const dx = 2 * finer.dx;
    own.blocks.sort(particles_.x, material_, particles_.count, 1, dx);
    own.nodes.rebuild(own.blocks.cells(), own.blocks.cell_count(), K::width, dx);
    GridNodes<S> const& nodes = own.nodes.nodes();
    own.blocks.bind(nodes);
    own.transfer.to_grid(particles_, own.blocks, nodes.count, dx);

    grow(own.fixed, "level_fixed", nodes.count);
    grow(own.rest, "level_rest", nodes.count);
    grow(own.local, "level_local", nodes.count);
    auto const& mass = own.transfer.mass();
    using Mass = std::decay_t<decltype(mass)>;
    for_each<S>(
        "coarse_node", nodes.count,
        kernels::CoarseNode<S, T, Mass>{finer, nodes, held, l == 0 ? rest_ : grids_[l - 1].rest,
                                        mass, own.fixed, own.rest, own.local});

    BlockViews<K, S> const& blocks = own.blocks.views();
    own.hessian.resize(blocks, nodes, fine_->team_size());
    double const ratio = fine_->nodes().dx / dx;
    for_each<S>("numbers_of_level", blocks.slots,
                kernels::NumbersOfLevel<K, P, S>{blocks, particles_.x, slot_, fine_->numbers(),
                                                 1 / dx, T(ratio * ratio), own.hessian.numbers()});
    own.hessian.set_local(own.local, own.fixed);
    level.resize(nodes, own.fixed);
    own.hessian.matrix(level.matrix());
  }

private:
  struct Grid {
    ParticleBlocks<K, S> blocks;
    SparseGrid<S> nodes;
    GridTransfer<K, P, S> transfer;
    Operator hessian;
    Kokkos::View<std::uint8_t*, typename S::memory> fixed;
    BlockField<T, S> rest, local;
  };

  Particles<P, S> particles_;
  Operator const* fine_ = nullptr;
  Kokkos::View<int*, typename S::memory> slot_;
  Kokkos::View<int*, typename S::memory> material_;  ///< all one
  BlockField<T, S> rest_;
  std::deque<Grid> grids_;
};

}  // namespace taut
