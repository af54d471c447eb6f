// Elastic energy of linear tetrahedra, V(x) = Sum_e W_e Psi(F_e): a swept term of the potential.
#pragma once

#include <taut/core/exec/buckets.hpp>
#include <taut/core/fem/elastic_kernels.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/core/fem/inversion_sweeps.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <limits>
#include <optional>

namespace taut {

/// How the sweeps are cut up. The result of a sweep depends on patch_size alone.
struct SweepParams {
  std::optional<int> patch_size;  ///< tets per patch, at most 4096; none: default_patch_size
  int team_size = 0;              ///< threads per patch; 0: one on the host, 128 on a device
};

/// On a device, so many that the fast memory of a team holds what the usual sweeps need.
template <class Space, class Real>
constexpr int default_patch_size() {
  return Space::on_host ? 512
                        : kernels::device_patch_size(PatchViews<Space, Real>::lanes, sizeof(Real));
}

template <ElementMaterial Material, class Precision_ = Mixed, class Space_ = DefaultSpace>
class ElasticTets {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using MaterialParameters = typename Material::template Parameters<double>;
  static constexpr int lanes = PatchViews<Space, Real>::lanes;

  /// `rest`: the mesh at rest, tets and vertices in the solver's order (see ordering.hpp), all or
  /// some tets of a scene. `material_of_tet[t]` indexes `materials`. Throws Error if an index is
  /// out of range.
  ElasticTets(TetMesh const& rest, std::vector<MaterialParameters> const& materials,
              std::vector<int> const& material_of_tet, SweepParams const& params = {});

  ElasticTets(TetMesh const& rest, MaterialParameters const& material, SweepParams const& p = {})
      : ElasticTets(rest, {material}, std::vector<int>(rest.tets.size(), 0), p) {}

  double value(Positions const& x, double scale) const {
    return scale * measure(kernels::Measure::energy, x, Vectors(), 0);
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * measure(kernels::Measure::change, x, p, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * measure(kernels::Measure::form, x, p, 0);
  }
  /// Lowers `certified` to a length that inverts no element, where the material forbids that.
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
                   FixedMask<Space> const& fixed, Vectors const& hp) const;
  void add_to(Matrix const& matrix, Positions const& x, double scale,
              FixedMask<Space> const& fixed) const;

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

  void elements(std::vector<Connectivity>& kinds) const { kinds.push_back({vertices_, 4}); }

  void add_form_shares(Positions const& x, Vectors const& p, double scale, FixedMask<Space> const&,
                       Array<double, Space> const& shares) const;
  /// A patch belongs to one body: it is idle if its first vertex is.
  void set_idle(IdleMask<Space> const& idle) const;

private:
  using Sum = typename Precision::sum;
  using Scratch = Kokkos::View<Real*, typename Space::memory>;
  using Bounds = Kokkos::View<double*, typename Space::memory>;
  using Output = kernels::SweepOutput<Space, Real>;

  // What runs kernels is defined below, and not inline: where a preset is compiled in the library
  // (presets/), no kernel is compiled for its users.
  double measure(kernels::Measure what, Positions const& x, Vectors const& p, double alpha) const;
  /// Gradient and the curvature that `to` has a field for; if there is a `p`, after a step along
  /// it, of which it returns the change of energy.
  double sweep(Positions const& x, Vectors const* p, double alpha, double scale, Output to) const;
  double step_to_inversion(Positions const& x, Vectors const& p, double at_most, bool strict) const;
  /// Of the patches, as the last sweep has left them; `ceiling` if that is less.
  double smallest_bound(double ceiling) const;

  template <kernels::Measure what>
  double measured(char const* name, Positions const& x, Vectors const& p, double alpha) const {
    measure_patches<what>(name, x, p, alpha);
    return reducer_.template finish<1>(name, patches_.count)[0];
  }
  /// Leaves the sum of each patch in reducer_.partials().
  template <kernels::Measure what>
  void measure_patches(char const* name, Positions const& x, Vectors const& p, double alpha) const {
    using Kernel = kernels::MeasureSweep<Space, Precision, Material, what>;
    run(name,
        Kernel{
            {patches_}, materials_, x, p, static_cast<Real>(alpha), reducer_.partials(), bounds_});
  }

  template <class Kernel>
  void run(char const* name, Kernel const& kernel) const {
    int const team = params_.team_size > 0 ? params_.team_size : (Space::on_host ? 1 : 128);
    for_each_team<Space>(name, patches_.count, team, kernel.scratch_bytes(), kernel);
  }

  /// Rows of `numbers` for the vertices that patches share; grow when first asked for, then stay.
  void provide_partial(Output& to, int numbers) const;
  template <int numbers>
  void gather(Output const& to) const {
    for_each<Space>("elastic_gather", patches_.shared.extent_int(0),
                    kernels::GatherShared<Space, Real, numbers>{patches_, to});
  }

  SweepParams params_;
  PatchViews<Space, Real> patches_;
  Kokkos::View<MaterialParameters const*, typename Space::memory,
               Kokkos::MemoryTraits<Kokkos::RandomAccess>>
      materials_;
  using Indices =
      Kokkos::View<int const*, typename Space::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>>;
  std::vector<Indices> colours_;
  Indices body_begin_, body_patch_, body_vertex_;  ///< see ShareByBody
  std::vector<int> vertices_;
  Reducer<Space, Sum> reducer_;
  mutable Scratch partial_;
  Bounds bounds_;  ///< what the sweep of the moment says of each patch
};

template <ElementMaterial Material, class Precision, class Space>
ElasticTets<Material, Precision, Space>::ElasticTets(
    TetMesh const& rest, std::vector<MaterialParameters> const& materials,
    std::vector<int> const& material_of_tet, SweepParams const& params)
    : params_(params), materials_(to_space<Space>("materials", materials)) {
  if (material_of_tet.size() != rest.tets.size())
    throw Error("ElasticTets: {} tets but {} entries in material_of_tet", rest.tets.size(),
                material_of_tet.size());
  for (std::size_t t = 0; t < rest.tets.size(); ++t) {
    int const m = material_of_tet[t];
    if (m < 0 || std::size_t(m) >= materials.size())
      throw Error("ElasticTets: tet {} has material {} of {}", t, m, materials.size());
    for (int v : rest.tets[t]) {
      if (v < 0 || std::size_t(v) >= rest.points.size())
        throw Error("ElasticTets: tet {} has vertex {} of {}", t, v, rest.points.size());
    }
  }
  Patches const host =
      make_patches(rest.tets, material_of_tet, static_cast<int>(rest.points.size()), lanes,
                   params.patch_size.value_or(default_patch_size<Space, Real>()));
  std::vector<double> shapes(10 * host.tet.size());
  for (std::size_t e = 0; e < host.tet.size(); ++e) {
    RestShape const shape = rest_shape(rest.points, rest.tets[host.tet[e]]);
    for (int k = 0; k < 9; ++k) shapes[10 * e + k] = shape.B.a[k];
    shapes[10 * e + 9] = host.padding[e] ? 0 : shape.W;
  }
  patches_ = copy_patches<Space, Real>(host, shapes);
  for (auto const& colour : host.colours) {
    colours_.push_back(to_space<Space>("patch_colour", colour));
  }
  std::vector<int> body_vertex(host.body);
  std::sort(body_vertex.begin(), body_vertex.end());
  body_vertex.erase(std::unique(body_vertex.begin(), body_vertex.end()), body_vertex.end());
  std::vector<int> body_of_patch;
  for (int v : host.body) {
    auto const at = std::lower_bound(body_vertex.begin(), body_vertex.end(), v);
    body_of_patch.push_back(static_cast<int>(at - body_vertex.begin()));
  }
  Buckets const by_body = sort_into_buckets(body_of_patch, static_cast<int>(body_vertex.size()));
  body_begin_ = to_space<Space>("body_patches_begin", by_body.begin);
  body_patch_ = to_space<Space>("body_patches", by_body.item);
  body_vertex_ = to_space<Space>("body_vertex", body_vertex);
  vertices_.reserve(4 * rest.tets.size());
  for (Tet const& tet : rest.tets) vertices_.insert(vertices_.end(), tet.begin(), tet.end());
  reducer_ = Reducer<Space, Sum>::of_partials(patches_.count);
  bounds_ = Bounds("elastic_bounds", patches_.count);
}

template <ElementMaterial Material, class Precision, class Space>
double ElasticTets<Material, Precision, Space>::measure(kernels::Measure what, Positions const& x,
                                                        Vectors const& p, double alpha) const {
  using kernels::Measure;
  if (what == Measure::energy) return measured<Measure::energy>("elastic_energy", x, p, alpha);
  if (what == Measure::change) return measured<Measure::change>("elastic_change", x, p, alpha);
  return measured<Measure::form>("elastic_quadratic_form", x, p, alpha);
}

template <ElementMaterial Material, class Precision, class Space>
void ElasticTets<Material, Precision, Space>::add_form_shares(
    Positions const& x, Vectors const& p, double scale, FixedMask<Space> const&,
    Array<double, Space> const& shares) const {
  measure_patches<kernels::Measure::form>("elastic_quadratic_form", x, p, 0);
  for_each<Space>("elastic_shares", body_vertex_.extent_int(0),
                  kernels::ShareByBody<Space, Sum>{body_begin_, body_patch_, body_vertex_,
                                                   reducer_.partials(), scale, shares});
}

template <ElementMaterial Material, class Precision, class Space>
void ElasticTets<Material, Precision, Space>::set_idle(IdleMask<Space> const& idle) const {
  for_each<Space>("elastic_idle", patches_.count,
                  kernels::MarkPatches<Space, Real>{patches_, idle});
}

template <ElementMaterial Material, class Precision, class Space>
double ElasticTets<Material, Precision, Space>::sweep(Positions const& x, Vectors const* p,
                                                      double alpha, double scale, Output to) const {
  using kernels::Curvature;
  Curvature const curvature = to.blocks.extent(0) > 0     ? Curvature::blocks
                              : to.diagonal.extent(0) > 0 ? Curvature::diagonal
                                                          : Curvature::none;
  provide_partial(to, 3 + static_cast<int>(curvature));
  using Kernel = kernels::GradientSweep<Space, Precision, Material>;
  run("elastic_gradient", Kernel{{patches_},
                                 materials_,
                                 curvature,
                                 p != nullptr,
                                 x,
                                 p ? *p : Vectors(),
                                 static_cast<Real>(alpha),
                                 static_cast<Real>(scale),
                                 to,
                                 reducer_.partials()});
  if (curvature == Curvature::none) gather<3>(to);
  if (curvature == Curvature::diagonal) gather<6>(to);
  if (curvature == Curvature::blocks) gather<9>(to);
  if (!p) return 0;
  return reducer_.template finish<1>("elastic_change", patches_.count)[0];
}

template <ElementMaterial Material, class Precision, class Space>
void ElasticTets<Material, Precision, Space>::add_product(Positions const& x, Vectors const& p,
                                                          double scale,
                                                          FixedMask<Space> const& fixed,
                                                          Vectors const& hp) const {
  Output to{{}, fixed, hp, {}, {}};
  provide_partial(to, 3);
  using Kernel = kernels::ProductSweep<Space, Precision, Material>;
  run("elastic_product", Kernel{{patches_}, materials_, x, p, static_cast<Real>(scale), to});
  gather<3>(to);
}

template <ElementMaterial Material, class Precision, class Space>
void ElasticTets<Material, Precision, Space>::add_to(Matrix const& matrix, Positions const& x,
                                                     double scale,
                                                     FixedMask<Space> const& fixed) const {
  for (auto const& colour : colours_) {
    using Kernel = kernels::AssembleColour<Space, Precision, Material, Matrix>;
    for_each<Space>("elastic_assemble", static_cast<int>(colour.extent(0)),
                    Kernel{patches_, materials_, colour, x, fixed, matrix, scale});
  }
}

template <ElementMaterial Material, class Precision, class Space>
double ElasticTets<Material, Precision, Space>::step_to_inversion(Positions const& x,
                                                                  Vectors const& p, double at_most,
                                                                  bool strict) const {
  using Kernel = kernels::InversionSweep<Space, Precision>;
  return kernels::step_with_margin(at_most, [&](double length) {
    run("elastic_max_step", Kernel{{patches_}, x, p, length, strict, bounds_});
    return smallest_bound(length);
  });
}

template <ElementMaterial Material, class Precision, class Space>
double ElasticTets<Material, Precision, Space>::smallest_bound(double ceiling) const {
  return minimum<Space>("elastic_bound", patches_.count, ceiling,
                        kernels::SmallestOf<Space>{bounds_});
}

template <ElementMaterial Material, class Precision, class Space>
void ElasticTets<Material, Precision, Space>::provide_partial(Output& to, int numbers) const {
  if (to.fixed.extent_int(0) != patches_.vertices)
    throw Error("ElasticTets: the mesh has {} vertices, the potential {} unknowns",
                patches_.vertices, to.fixed.extent(0));
  std::size_t const needed = std::size_t(kernels::padded(numbers)) * patches_.shared_rows;
  if (partial_.extent(0) < needed) {
    // Zeros: rows of idle patches are read, if for nothing, before they are first written.
    partial_ = Scratch("elastic_partial", needed);
  }
  to.partial = partial_;
}

}  // namespace taut
