// How terms made of stencils of up to four vertices are added up without atomics: a sweep over the
// stencils leaves what stencil k adds to its vertex a in slot 4 k + a, then each vertex adds up its
// slots in their order. So sums do not depend on the number of threads.
#pragma once

#include <taut/contact/surface.hpp>
#include <taut/core/potential/term.hpp>

namespace taut::kernels {

/// Which slots belong to which vertex.
template <class S>
struct SlotsOfVertices {
  Kokkos::View<int*, typename S::memory> begin, slot;
};

/// Adds the slots of entry i of `vertex`, and `numbers` of curvature, times `scale`. `Slots` says
/// of a stencil whether it `acts(k)`, and has component c of `vector(slot, c)` and
/// `curvature(slot, c)`.
template <class Precision, class S, class Slots, class CurvatureField, int numbers>
struct GatherSlots {
  using Real = typename Precision::real;
  typename SurfaceViews<S>::Indices vertex;
  SlotsOfVertices<S> of;
  Slots from;
  FixedMask<S> fixed;
  double scale;
  VectorField<Real, S> g;
  CurvatureField curvature;

  KOKKOS_FUNCTION void operator()(int i) const { add(vertex(i)); }
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int v) const {
    if (fixed(v)) return;
    Vec3<double> sum{};
    double h[6] = {};
    for (int j = of.begin(v); j < of.begin(v + 1); ++j) {
      int const slot = of.slot(j);
      if (!from.acts(slot / 4)) continue;
      for (int c = 0; c < 3; ++c) sum[c] += double(from.vector(slot, c));
      for (int c = 0; c < numbers; ++c) h[c] += double(from.curvature(slot, c));
    }
    for (int c = 0; c < 3; ++c) g(v, c) += static_cast<Real>(scale * sum[c]);
    if constexpr (numbers > 0) {
      for (int c = 0; c < numbers; ++c) curvature(v, c) += static_cast<Real>(scale * h[c]);
    }
  }
};

}  // namespace taut::kernels
