// expect: each term of a Potential must satisfy LocalTerm or SweptTerm
#include <taut/core/potential/potential.hpp>

using namespace taut;

struct Wish {
  using Space = DefaultSpace;
  using Precision = Mixed;
};

int main() {
  Unknowns<> const unknowns;
  Potential<Inertia<>, Wish> potential(unknowns, Inertia<>(unknowns), Wish());
}
