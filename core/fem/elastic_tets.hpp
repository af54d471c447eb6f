// Elastic energy of linear tetrahedra, V(x) = Sum_e W_e Psi(F_e): a swept term of the potential.
#pragma once

#include <taut/core/fem/elastic_kernels.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/core/fem/inversion_sweeps.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <limits>

namespace taut {

/// How the sweeps are cut up. The result of a sweep depends on patch_size alone.
struct SweepParams {
  int patch_size = 512;  ///< tets per patch, at most 4096
  int team_size = 0;     ///< threads per patch; 0: one on the host, 128 on a device
};

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
              std::vector<int> const& material_of_tet, SweepParams const& params = {})
      : params_(params), materials_(to_space<Space>("materials", materials)) {
    check_indices(rest, materials.size(), material_of_tet);
    Patches const host = make_patches(
        rest.tets, material_of_tet, static_cast<int>(rest.points.size()), lanes, params.patch_size);
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
    vertices_.reserve(4 * rest.tets.size());
    for (Tet const& tet : rest.tets) vertices_.insert(vertices_.end(), tet.begin(), tet.end());
    reducer_ = Reducer<Space, Sum>::of_partials(patches_.count);
    certified_ = Scratch("elastic_certified", patches_.count);
  }

  ElasticTets(TetMesh const& rest, MaterialParameters const& material, SweepParams const& p = {})
      : ElasticTets(rest, {material}, std::vector<int>(rest.tets.size(), 0), p) {}

  double value(Positions const& x, double scale) const {
    return scale * measure<kernels::Measure::energy>("elastic_energy", x, Vectors(), 0);
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * measure<kernels::Measure::change>("elastic_change", x, p, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * measure<kernels::Measure::form>("elastic_quadratic_form", x, p, 0);
  }

  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g) const {
    sweep<kernels::Curvature::none>(x, Vectors(), false, 0, scale, fixed, g, g);
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Vectors const& diagonal) const {
    sweep<kernels::Curvature::diagonal>(x, Vectors(), false, 0, scale, fixed, g, diagonal);
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Blocks const& blocks) const {
    sweep<kernels::Curvature::blocks>(x, Vectors(), false, 0, scale, fixed, g, blocks);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g) const {
    return sweep<kernels::Curvature::none>(x, p, true, alpha, scale, fixed, g, g);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Vectors const& diagonal) const {
    return sweep<kernels::Curvature::diagonal>(x, p, true, alpha, scale, fixed, g, diagonal);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Blocks const& blocks) const {
    return sweep<kernels::Curvature::blocks>(x, p, true, alpha, scale, fixed, g, blocks);
  }

  void add_product(Positions const& x, Vectors const& p, double scale,
                   FixedMask<Space> const& fixed, Vectors const& hp) const {
    using Kernel = kernels::ProductSweep<Space, Precision, Material>;
    Kernel const kernel{{patches_},          materials_, x, p, static_cast<Real>(scale),
                        output<3>(fixed, hp)};
    run("elastic_product", kernel);
    gather<3>(kernel.output);
  }

  void add_to(Matrix const& matrix, Positions const& x, double scale,
              FixedMask<Space> const& fixed) const {
    for (auto const& colour : colours_) {
      using Kernel = kernels::AssembleColour<Space, Precision, Material, Matrix>;
      for_each<Space>("elastic_assemble", static_cast<int>(colour.extent(0)),
                      Kernel{patches_, materials_, colour, x, fixed, matrix, scale});
    }
  }

  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    if constexpr (Material::allows_inversion) {
      return at_most;
    } else {
      return step_to_inversion(x, p, at_most, true);
    }
  }
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    return step_to_inversion(x, p, at_most, !Material::allows_inversion);
  }

  void elements(std::vector<Connectivity>& kinds) const { kinds.push_back({vertices_, 4}); }

private:
  using Sum = typename Precision::sum;
  using Scratch = Kokkos::View<Real*, typename Space::memory>;

  static void check_indices(TetMesh const& rest, std::size_t materials,
                            std::vector<int> const& material_of_tet) {
    if (material_of_tet.size() != rest.tets.size())
      throw Error("ElasticTets: {} tets but {} entries in material_of_tet", rest.tets.size(),
                  material_of_tet.size());
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      int const m = material_of_tet[t];
      if (m < 0 || std::size_t(m) >= materials)
        throw Error("ElasticTets: tet {} has material {} of {}", t, m, materials);
      for (int v : rest.tets[t]) {
        if (v < 0 || std::size_t(v) >= rest.points.size())
          throw Error("ElasticTets: tet {} has vertex {} of {}", t, v, rest.points.size());
      }
    }
  }

  typename Space::team_policy policy(std::size_t scratch_bytes) const {
    int const team = params_.team_size > 0 ? params_.team_size : (Space::on_host ? 1 : 128);
    typename Space::team_policy p(Space::instance(), patches_.count, team);
    if (scratch_bytes > 0) p.set_scratch_size(0, Kokkos::PerTeam(static_cast<int>(scratch_bytes)));
    return p;
  }

  template <class Kernel>
  void run(char const* name, Kernel const& kernel) const {
    if (patches_.count == 0) return;
    Kokkos::parallel_for(label(name), policy(kernel.scratch_bytes()), kernel);
  }

  /// Rows of `numbers` for the vertices that patches share; grow when first asked for, then stay.
  template <int numbers>
  kernels::SweepOutput<Space, Real> output(FixedMask<Space> const& fixed, Vectors const& g) const {
    if (fixed.extent_int(0) != patches_.vertices)
      throw Error("ElasticTets: the mesh has {} vertices, the potential {} unknowns",
                  patches_.vertices, fixed.extent(0));
    std::size_t const needed = std::size_t(numbers) * patches_.shared_rows;
    if (partial_.extent(0) < needed) {
      partial_ = Scratch(
          Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string("elastic_partial")), needed);
    }
    return {partial_, fixed, g, {}, {}};
  }

  /// The cheap sweep clears nearly all patches; the exact one looks at those that it cannot.
  double step_to_inversion(Positions const& x, Vectors const& p, double at_most,
                           bool strict) const {
    if (patches_.count == 0) return at_most;
    using Certificate = kernels::CertificateSweep<Space, Precision>;
    Certificate const certificate{{patches_}, x, p, certified_};
    if (reduce<Space, Kokkos::Min, double>(
            "elastic_certificate", policy(certificate.scratch_bytes()), certificate) >= at_most) {
      return at_most;
    }
    using Inversion = kernels::InversionSweep<Space, Precision>;
    double const smallest = reduce<Space, Kokkos::Min, double>(
        "elastic_max_step", policy(0), Inversion{patches_, x, p, certified_, at_most, strict});
    // Kokkos' identity of the minimum is the largest finite number.
    return smallest < std::numeric_limits<double>::max() ? std::min(smallest, at_most) : at_most;
  }

  template <kernels::Measure what>
  double measure(char const* name, Positions const& x, Vectors const& p, double alpha) const {
    using Kernel = kernels::MeasureSweep<Space, Precision, Material, what>;
    run(name, Kernel{{patches_}, materials_, x, p, static_cast<Real>(alpha), reducer_.partials()});
    return reducer_.template finish<1>(name, patches_.count)[0];
  }

  template <kernels::Curvature curvature, class CurvatureField>
  double sweep(Positions const& x, Vectors const& p, bool after_step, double alpha, double scale,
               FixedMask<Space> const& fixed, Vectors const& g, CurvatureField const& c) const {
    constexpr int numbers = 3 + static_cast<int>(curvature);
    auto to = output<numbers>(fixed, g);
    if constexpr (curvature == kernels::Curvature::diagonal) to.diagonal = c;
    if constexpr (curvature == kernels::Curvature::blocks) to.blocks = c;
    kernels::GradientSweep<Space, Precision, Material> const kernel{{patches_},
                                                                    materials_,
                                                                    curvature,
                                                                    after_step,
                                                                    x,
                                                                    p,
                                                                    static_cast<Real>(alpha),
                                                                    static_cast<Real>(scale),
                                                                    to,
                                                                    reducer_.partials()};
    run("elastic_gradient", kernel);
    gather<numbers>(to);
    if (!after_step) return 0;
    return reducer_.template finish<1>("elastic_change", patches_.count)[0];
  }

  template <int numbers>
  void gather(kernels::SweepOutput<Space, Real> const& to) const {
    for_each<Space>("elastic_gather", patches_.shared.extent_int(0),
                    kernels::GatherShared<Space, Real, numbers>{patches_, to});
  }

  SweepParams params_;
  PatchViews<Space, Real> patches_;
  Kokkos::View<MaterialParameters const*, typename Space::memory,
               Kokkos::MemoryTraits<Kokkos::RandomAccess>>
      materials_;
  std::vector<
      Kokkos::View<int const*, typename Space::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>>>
      colours_;
  std::vector<int> vertices_;
  Reducer<Space, Sum> reducer_;
  mutable Scratch partial_;
  Scratch certified_;  ///< per patch, see CertificateSweep
};

}  // namespace taut
