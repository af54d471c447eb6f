// Elastic energy of material points, V(x) = Sum_p V_p Psi(F_p(x)), as a function of the displaced
// places of the nodes of a grid: a swept term of the potential, for any material that tets take,
// and for those whose points yield within a step by what they remember (particle_memory.hpp).
//
// A term knows some of the materials, those of one model; particles of others are another term's.
//
// The grid, and which particle sees which node, change from step to step: `update` before each.
// Copies share nothing that changes within a step but what lags, so a Potential made after `update`
// may hold one.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/report/error.hpp>
#include <taut/mpm/characteristic_force.hpp>
#include <taut/mpm/own_patches.hpp>
#include <taut/mpm/particle_assembly.hpp>
#include <taut/mpm/particle_memory.hpp>
#include <taut/mpm/particle_split.hpp>

#include <algorithm>

namespace taut {

namespace kernels {

/// Writes what sweeps read of the particles.
template <class S, class Precision, Spline K>
struct PreparePoints {
  using Real = typename Precision::real;
  BlockViews<K, S> blocks;
  Particles<Precision, S> particles;
  double per_dx;
  Kokkos::View<Real*, typename S::memory> data;

  KOKKOS_FUNCTION void operator()(int slot) const {
    int const p = blocks.particle(slot), like = blocks.like(slot);
    auto const set = [&](int k, double value) {
      data(SlotLayout<S, Real, point_numbers>::place(slot, k)) = static_cast<Real>(value);
    };
    for (int c = 0; c < 3; ++c) {
      set(c, place_in_cell<K>(double(particles.x(like, c)) * per_dx, blocks.cell(like, c)));
    }
    for (int k = 0; k < 9; ++k) set(3 + k, double(particles.F(like, k)));
    set(12, p >= 0 ? double(particles.volume(p)) * double(particles.stiffness(p)) : 0);
  }
};

/// The nodes that the particles of each cell see.
template <Spline K, class S>
struct NodesOfCells {
  GridNodes<S> grid;
  Kokkos::View<int* [3], typename S::layout, typename S::memory> base;
  Kokkos::View<int*, typename S::memory> node;
  KOKKOS_FUNCTION void operator()(int n) const {
    constexpr int width = K::width, stencil = width * width * width;
    int const cell = n / stencil, k = n % stencil;
    node(n) = grid.node(base(cell, 0) + k / (width * width), base(cell, 1) + k / width % width,
                        base(cell, 2) + k % width);
  }
};

/// Adds the rows of a node to the fields of a potential.
template <class S, class Real>
struct AddToFields {
  SweepOutput<S, Real> output;
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, Real const (&sum)[numbers]) const {
    output.template add<numbers>(node, sum);
  }
};

}  // namespace kernels

/// `packed_`: a thread per patch, which computes SIMD packs (on the host), or a team of threads
/// with a particle each (on a device). Both run on the host, which the tests use.
template <ElementMaterial Material, Spline K = QuadraticSpline, class Precision_ = Mixed,
          class Space_ = DefaultSpace, bool packed_ = Space_::on_host>
class ElasticParticles {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Kernel = K;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using MaterialParameters = typename Material::template Parameters<double>;

  /// The materials are numbers `first_material`, that plus 1, and so on of the particles.
  /// `team_size`: threads per patch where not packed; 0: one on the host, 64 on a device. Throws
  /// Error if there is no material.
  explicit ElasticParticles(std::vector<MaterialParameters> const& materials,
                            int first_material = 0, int team_size = 0)
      : materials_(to_space<Space>("materials", materials)),
        range_{first_material, first_material + static_cast<int>(materials.size())},
        team_size_(packed_ ? 1 : team_size) {
    if (materials.empty()) throw Error("ElasticParticles: no materials; give one or more");
    if (first_material < 0) {
      throw Error("ElasticParticles: materials from number {} on; give 0 or more", first_material);
    }
    if (team_size_ == 0) team_size_ = Space::on_host ? 1 : 64;
    List<double> const norms("material_norm", materials.size());
    auto const host = Kokkos::create_mirror_view(norms);
    for (std::size_t k = 0; k < materials.size(); ++k) {
      host(k) = norm_at_rest<Material>(materials[k]);
      if constexpr (RememberingMaterial<Material>) lags_ = lags_ || Material::lags(materials[k]);
    }
    assign(norms, host);
    norms_ = norms;
  }

  /// Of the particles, which are its own.
  MaterialRange const& materials() const { return range_; }
  /// Those of the last update, of other terms too.
  Particles<Precision, Space> const& particles() const { return particles_; }

  /// A new step begins: `blocks` are sorted by where `particles` are and bound to `grid`, whose
  /// nodes lie at `rest` (m).
  void update(Particles<Precision, Space> const& particles, ParticleBlocks<K, Space> const& blocks,
              GridNodes<Space> const& grid, Positions const& rest) {
    all_ = blocks.views();
    blocks_ = own_.select(all_, range_, grid.count);
    grid_ = grid;
    cells_ = blocks.cells();
    cell_count_ = blocks.cell_count();
    particles_ = particles;
    rest_ = rest;
    dx_ = grid.dx;
    ++version_;
    grow(data_, "particle_data", std::size_t(kernels::point_numbers) * blocks_.slots);
    for_each<Space>(
        "prepare_points", blocks_.slots,
        kernels::PreparePoints<Space, Precision, K>{blocks_, particles, 1 / dx_, data_});
    if (reducible_ < blocks_.patches) {
      reducible_ = blocks_.patches + blocks_.patches / 2;
      reducer_ = Reducer<Space, Sum>::of_partials(reducible_);
    }
    grow(bounds_, "particle_bounds", blocks_.patches);
    if constexpr (RememberingMaterial<Material>) {
      grow(memory_.data, "particle_memory", std::size_t(memory_.numbers) * blocks_.slots);
      using Kernel_ = kernels::Remember<Space, Precision, Material, K>;
      for_each<Space>("remember", blocks_.patches,
                      Kernel_{blocks_, particles, materials_, memory_});
      if (lags_) lag_reducer_.provide(blocks_.patches, 2);
    }
  }
  /// Takes what lags behind as it is at x (LaggedTerm): the radius at which sand yields. False if
  /// that changes by less than `lag_change` of it, rms.
  bool relag(Positions const& x) const requires RememberingMaterial<Material> {
    if (!lags_) return false;
    using Reader = kernels::PointReader<Space, Real, K>;
    using Nodes = kernels::Displacement<Space, typename Precision::position>;
    using Kernel_ = kernels::RememberAnew<Reader, Space, Precision, Material, Nodes>;
    auto const sums = lag_reducer_.template sum<2>(
        "remember_anew", blocks_.patches,
        Kernel_{{blocks_, data_}, particles_, materials_, {x, rest_}, dx_, memory_});
    return double(sums[0]) > lag_change * lag_change * double(sums[1]);
  }
  static constexpr double lag_change = 1e-2;

  double value(Positions const& x, double scale) const {
    return scale * measured<kernels::Measure::energy>("particle_energy", x, Vectors(), 0);
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * measured<kernels::Measure::change>("particle_change", x, p, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * measured<kernels::Measure::form>("particle_quadratic_form", x, p, 0);
  }
  /// Lowers `certified` to a length that inverts no particle, where the material forbids that.
  double quadratic_form(Positions const& x, Vectors const& p, double scale,
                        double& certified) const {
    double const form = quadratic_form(x, p, scale);
    if constexpr (!Material::allows_inversion) certified = smallest_bound(certified);
    return form;
  }

  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g) const {
    sweep(x, nullptr, 0, scale, {{}, fixed, g, {}, {}});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Vectors const& diagonal) const {
    sweep(x, nullptr, 0, scale, {{}, fixed, g, diagonal, {}});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Blocks const& blocks) const {
    sweep(x, nullptr, 0, scale, {{}, fixed, g, {}, blocks});
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g) const {
    return sweep(x, &p, alpha, scale, {{}, fixed, g, {}, {}});
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Vectors const& diagonal) const {
    return sweep(x, &p, alpha, scale, {{}, fixed, g, diagonal, {}});
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Blocks const& blocks) const {
    return sweep(x, &p, alpha, scale, {{}, fixed, g, {}, blocks});
  }

  void add_product(Positions const& x, Vectors const& p, double scale,
                   FixedMask<Space> const& fixed, Vectors const& hp) const {
    provide_partial(fixed, 3);
    using Kernel_ = kernels::ParticleProduct<Space, Precision, Material, K, packed_>;
    run("particle_product", Kernel_{frame(x), p, static_cast<Real>(scale), partial_});
    gather<3>({{}, fixed, hp, {}, {}});
  }
  /// The Hessian at x as the numbers of a ParticleOperator, of Real or rounded.
  template <class Operator>
  void linearise(Positions const& x, double scale, Operator& to) const {
    to.resize(all_, grid_, team_size_);
    using To = typename Operator::T;
    using Kernel_ = kernels::LineariseParticles<Space, Precision, Material, K, packed_, To>;
    run("particle_linearise", Kernel_{frame(x), static_cast<Real>(scale), {to.numbers()}});
  }
  /// A splitting begins at x (particle_split.hpp), with `stiffness` times |d2Psi/dF2 (I)| / 3 of
  /// each material, which is near Young's modulus, between F and what stands for it: `state` is
  /// made, and `to` the Hessian of the split function.
  template <class Operator>
  void start_split(Positions const& x, double stiffness, double scale,
                   SplitParticleState<Real, Space>& state, Operator& to) const {
    to.resize(all_, grid_, team_size_);
    grow(state.numbers, "split_numbers",
         data_.extent(0) / kernels::point_numbers * std::size_t(kernels::split_numbers));
    grow(state.stiffness, "split_stiffness", std::max(all_.materials, range_.end));
    for_each<Space>("split_stiffness", static_cast<int>(norms_.extent(0)),
                    kernels::ScaleNorms<Space>{norms_, own_of(state), stiffness / 3});
    using Kernel_ =
        kernels::LineariseSplit<Space, Precision, Material, K, packed_, typename Operator::T>;
    run("split_linearise",
        Kernel_{frame(x), own_of(state), static_cast<Real>(scale), {to.numbers()}});
  }
  /// Brings `state` up to x, and takes the gradient g of the potential to that of the split
  /// function.
  void split(Positions const& x, double scale, double relaxation, bool first,
             FixedMask<Space> const& fixed, SplitParticleState<Real, Space> const& state,
             Vectors const& g) const {
    provide_partial(fixed, 3);
    using Kernel_ = kernels::SplitParticles<Space, Precision, Material, K, packed_>;
    run("particle_split", Kernel_{frame(x), own_of(state), static_cast<Real>(scale),
                                  static_cast<Real>(relaxation), first, state.numbers, partial_});
    gather<3>({{}, fixed, g, {}, {}});
  }
  /// Block by block and colour after colour; a block matrix of 125 (343) columns a row.
  void add_to(Matrix const& matrix, Positions const& x, double scale,
              FixedMask<Space> const& fixed) const;

  /// See characteristic_force.hpp.
  void add_characteristic_force(Array<double, Space> const& force,
                                Array<double, Space> const& mass) const {
    List<double> const partial("characteristic_sums",
                               std::size_t(2) * BlockViews<K, Space>::nodes * blocks_.patches);
    using Sums_ = kernels::CharacteristicSums<Space, Precision, K>;
    for_each<Space>("characteristic_sums", blocks_.patches,
                    Sums_{{blocks_, data_}, particles_, norms_, partial});
    using Add = kernels::AddCharacteristicForce<Space>;
    for_each<Space>("characteristic_force", grid_.count,
                    kernels::GatherRows<Space, double, K, 2, Add>{
                        blocks_, partial, {force, mass, 24 * dx_ * dx_}});
  }

  static constexpr double margin = kernels::inversion_margin;

  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    if constexpr (Material::allows_inversion) {
      return at_most;
    } else {
      return step_to_inversion(x, p, at_most, true);
    }
  }
  double max_step(Positions const& x, Vectors const& p, double at_most, double certified) const {
    return at_most <= margin * certified ? at_most : max_step(x, p, at_most);
  }
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    return step_to_inversion(x, p, at_most, !Material::allows_inversion);
  }

  /// The nodes of one cell are one element.
  void elements(std::vector<Connectivity>& kinds) const;
  std::int64_t pattern_version(Positions const&) const { return version_; }

private:
  using Sum = typename Precision::sum;
  using Output = kernels::SweepOutput<Space, Real>;
  template <class T>
  using List = Kokkos::View<T*, typename Space::memory>;
  static constexpr int stencil = K::width * K::width * K::width;

  kernels::ParticleSweep<Space, Precision, Material, K, packed_> frame(Positions const& x) const {
    return {{blocks_}, data_, materials_, {x, rest_}, static_cast<Real>(dx_), memory_};
  }
  template <class Kernel_>
  void run(char const* name, Kernel_ const& kernel) const {
    for_each_team<Space>(name, blocks_.patches, team_size_, kernel.scratch_bytes(), kernel);
  }
  template <kernels::Measure what>
  double measured(char const* name, Positions const& x, Vectors const& p, double alpha) const {
    using Kernel_ = kernels::ParticleMeasure<Space, Precision, Material, K, packed_, what>;
    run(name, Kernel_{frame(x), p, static_cast<Real>(alpha), reducer_.partials(), bounds_});
    return reducer_.template finish<1>(name, blocks_.patches)[0];
  }
  double sweep(Positions const& x, Vectors const* p, double alpha, double scale,
               Output const& to) const;
  double step_to_inversion(Positions const& x, Vectors const& p, double at_most,
                           bool strict) const {
    using Kernel_ = kernels::ParticleInversion<Space, Precision, Material, K, packed_>;
    return kernels::step_with_margin(at_most, [&](double length) {
      run("particle_max_step", Kernel_{frame(x), p, length, strict, bounds_});
      return smallest_bound(length);
    });
  }
  double smallest_bound(double ceiling) const {
    return minimum<Space>("particle_bound", blocks_.patches, ceiling,
                          kernels::SmallestOf<Space>{bounds_});
  }
  void provide_partial(FixedMask<Space> const& fixed, int numbers) const {
    if (fixed.extent_int(0) != grid_.count)
      throw Error("ElasticParticles: the grid has {} nodes, the potential {} unknowns", grid_.count,
                  fixed.extent(0));
    grow(partial_, "particle_partial",
         std::size_t(numbers) * BlockViews<K, Space>::nodes * blocks_.patches);
  }
  template <int numbers>
  void gather(Output const& to) const {
    using Add = kernels::AddToFields<Space, Real>;
    for_each<Space>("particle_gather", grid_.count,
                    kernels::GatherRows<Space, Real, K, numbers, Add>{blocks_, partial_, {to}});
  }

  /// Of the materials, those of this term.
  List<double> own_of(SplitParticleState<Real, Space> const& state) const {
    return Kokkos::subview(state.stiffness, Kokkos::make_pair(range_.first, range_.end));
  }

  List<MaterialParameters const> materials_;
  List<double const> norms_;  ///< per material
  MaterialRange range_;
  int team_size_;
  Particles<Precision, Space> particles_;
  BlockViews<K, Space> all_, blocks_;  ///< of all particles, and its own
  OwnPatches<K, Space> own_;
  GridNodes<Space> grid_;
  typename ParticleBlocks<K, Space>::Cells cells_;
  int cell_count_ = 0, reducible_ = 0;
  Positions rest_;
  double dx_ = 1;
  std::int64_t version_ = 0;
  List<Real> data_;
  kernels::PointMemory<Space, Real> memory_;  ///< of a material that remembers
  bool lags_ = false;
  Reducer<Space, Sum> reducer_, lag_reducer_;
  mutable List<Real> partial_;
  List<double> bounds_;  ///< what the sweep of the moment says of each patch
  mutable std::vector<int> cell_nodes_;
};

template <ElementMaterial Material, Spline K, class Precision, class Space, bool packed>
double ElasticParticles<Material, K, Precision, Space, packed>::sweep(Positions const& x,
                                                                      Vectors const* p,
                                                                      double alpha, double scale,
                                                                      Output const& to) const {
  using kernels::Curvature;
  Curvature const curvature = to.blocks.extent(0) > 0     ? Curvature::blocks
                              : to.diagonal.extent(0) > 0 ? Curvature::diagonal
                                                          : Curvature::none;
  provide_partial(to.fixed, 3 + static_cast<int>(curvature));
  using Kernel_ = kernels::ParticleGradient<Space, Precision, Material, K, packed>;
  run("particle_gradient",
      Kernel_{frame(x), curvature, p != nullptr, p ? *p : Vectors(), static_cast<Real>(alpha),
              static_cast<Real>(scale), partial_, reducer_.partials()});
  if (curvature == Curvature::none) gather<3>(to);
  if (curvature == Curvature::diagonal) gather<6>(to);
  if (curvature == Curvature::blocks) gather<9>(to);
  if (!p) return 0;
  return reducer_.template finish<1>("particle_change", blocks_.patches)[0];
}

template <ElementMaterial Material, Spline K, class Precision, class Space, bool packed>
void ElasticParticles<Material, K, Precision, Space, packed>::add_to(
    Matrix const& matrix, Positions const& x, double scale, FixedMask<Space> const& fixed) const {
  BlockColours<K, Space> const colours(blocks_);
  for (int c = 0; c < colours.colours; ++c) {
    using Kernel_ = kernels::AssembleBlocks<Space, Precision, Material, K, Matrix>;
    for_each<Space>("particle_assemble", colours.size(c),
                    Kernel_{{blocks_, data_},
                            materials_,
                            colours.order(),
                            colours.begin(c),
                            {x, rest_},
                            fixed,
                            matrix,
                            dx_,
                            scale,
                            memory_});
  }
}

template <ElementMaterial Material, Spline K, class Precision, class Space, bool packed>
void ElasticParticles<Material, K, Precision, Space, packed>::elements(
    std::vector<Connectivity>& kinds) const {
  int const n = stencil * cell_count_;
  List<int> const node("cell_nodes", n);
  for_each<Space>("cell_nodes", n, kernels::NodesOfCells<K, Space>{grid_, cells_, node});
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), node);
  cell_nodes_.assign(host.data(), host.data() + n);
  kinds.push_back({cell_nodes_, stencil});
}

}  // namespace taut
