// expect: all terms of a Potential must live in the same Space
#include <taut/core/potential/potential.hpp>

using namespace taut;
using Elsewhere = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;

int main() {
  Unknowns<Fp64> const unknowns;
  Unknowns<Fp64, Elsewhere> const others;
  Potential<Inertia<Fp64>, BodyForce<Fp64, Elsewhere>> potential(
      unknowns, Inertia<Fp64>(unknowns), BodyForce<Fp64, Elsewhere>(others));
}
