// expect: Newton's first argument must satisfy LinearSolver
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/newton.hpp>

using namespace taut;

template <class, class>
struct Wish {
  struct Params {};
  explicit Wish(Params const&) {}
};

int main() {
  Unknowns<> const unknowns;
  Potential potential(unknowns, Inertia(unknowns));
  Newton<Wish>().minimise(potential, {});
}
