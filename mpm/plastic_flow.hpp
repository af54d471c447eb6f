// Return maps of a scene whose materials flow in different ways, chosen at run time: what a
// ParticleStepper applies after a step. A particle remembers one number, `plastic`, which is what
// its material's map makes of it:
//
//   von_mises    equivalent plastic strain        snow   Jp, the plastic volume ratio
//   sand         logarithm of the volume gained without stress (no hardening with strain)
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/materials/granular.hpp>
#include <taut/materials/von_mises.hpp>
#include <taut/mpm/transfer.hpp>

#include <cstdint>

namespace taut {

enum class FlowKind : std::uint8_t { none, von_mises, von_mises_fixed_corotated, snow, sand };

/// How one material flows; of the maps, that of `kind` counts.
struct MaterialFlow {
  FlowKind kind = FlowKind::none;
  VonMises metal = {};
  VonMisesFixedCorotated metal_of_hot = {};
  SnowClamp snow = {};
  DruckerPrager sand = {};  ///< h1 and h3 are to be 0: there is no room for the plastic strain

  /// What a particle remembers before it has ever flowed.
  double initial() const { return kind == FlowKind::snow ? 1 : 0; }

  KOKKOS_FUNCTION void operator()(Mat3<double>& F, double& plastic, double& stiffness) const {
    if (kind == FlowKind::von_mises) {
      VonMises::State<double> state{plastic};
      F = metal.map(F, state).F;
      plastic = state.strain;
    } else if (kind == FlowKind::von_mises_fixed_corotated) {
      VonMisesFixedCorotated::State<double> state;
      F = metal_of_hot.map(F, state).F;
    } else if (kind == FlowKind::snow) {
      SnowClamp::State<double> state{plastic};
      F = snow.map(F, state).F;
      plastic = state.volume;
      stiffness = snow.stiffening(state);
    } else if (kind == FlowKind::sand) {
      DruckerPrager::State<double> state{0, plastic};
      F = sand.map(F, state).F;
      plastic = state.gained;
    }
  }
};

/// A Flow (transfer.hpp): each material has its own.
template <class Space = DefaultSpace>
class FlowOfMaterials {
public:
  static constexpr char const* name = "by_material";

  FlowOfMaterials() = default;
  explicit FlowOfMaterials(std::vector<MaterialFlow> const& materials)
      : list_("material_flow", materials.size()) {
    auto const host = Kokkos::create_mirror_view(list_);
    for (std::size_t k = 0; k < materials.size(); ++k) host(k) = materials[k];
    assign(list_, host);
  }

  KOKKOS_FUNCTION void operator()(int material, Mat3<double>& F, double& plastic,
                                  double& stiffness) const {
    list_(material)(F, plastic, stiffness);
  }

private:
  Kokkos::View<MaterialFlow*, typename Space::memory> list_;
};

}  // namespace taut
