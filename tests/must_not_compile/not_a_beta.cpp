// expect: Ncg's first argument must satisfy Beta
#include <taut/integrators/ncg.hpp>

using namespace taut;

struct Wish {
  double operator()(double) const { return 0; }
};

int main() { Ncg<Wish, Jacobi> minimiser; }
