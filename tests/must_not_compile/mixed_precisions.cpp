// expect: all terms of a Potential must have the same Precision
#include <taut/core/potential/potential.hpp>

using namespace taut;

int main() {
  Unknowns<Fp64> const unknowns;
  Unknowns<Mixed> const others;
  Potential<Inertia<Fp64>, BodyForce<Mixed>> potential(unknowns, Inertia<Fp64>(unknowns),
                                                       BodyForce<Mixed>(others));
}
