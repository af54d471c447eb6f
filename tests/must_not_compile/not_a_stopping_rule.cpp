// expect: a minimiser's stopping rule must satisfy Stopping
#include <taut/integrators/ncg.hpp>

using namespace taut;

struct Wish {
  struct Params {};
  explicit Wish(Params const&) {}
};

int main() { Ncg<DaiKou, Jacobi, SufficientDecrease, Wish> minimiser; }
