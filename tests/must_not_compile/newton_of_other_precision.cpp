// expect: a minimiser and its objective must have the same Precision and Space
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/newton.hpp>

using namespace taut;

int main() {
  Unknowns<Fp64> const unknowns;
  Potential potential(unknowns, Inertia(unknowns));
  Newton<>().minimise(potential, {});
}
