// What a point of a material that yields remembers from step to step, as a step takes it.
#pragma once

namespace taut {

template <class T>
struct YieldMemory {
  T limit;   ///< size of the deviator of logarithmic strain at which it yields
  T gained;  ///< logarithm of the volume gained without stress (DruckerPrager)
};

}  // namespace taut
