// A preconditioner of one's own: two terms of the Neumann series on top of block Jacobi,
//   P = w B (2 I - w H B),   B = inverse diagonal blocks of H,
// one product with the Hessian per application. On tets H <= 4 diag(H) element by element, so that
// w = 0.45 keeps w H B below 2 and P positive definite.
#include "bar.hpp"

#include <taut/core/exec/copy.hpp>
#include <taut/integrators/ncg.hpp>

#include <functional>

using namespace taut;

template <class P, class S>
class Neumann : public BlockJacobi<P, S> {
public:
  using Vectors = VectorField<typename P::real, S>;
  using Positions = VectorField<typename P::position, S>;
  static constexpr char const* name = "neumann";
  static constexpr double w = 0.45;

  using BlockJacobi<P, S>::BlockJacobi;
  bool pointwise() const { return false; }
  void resize(int n) {
    BlockJacobi<P, S>::resize(n);
    h_ = Vectors("neumann_product", n);
    correction_ = Vectors("neumann_correction", n);
    at_ = Positions("neumann_at", n);
  }
  template <class E>
  void update(E& e, Positions const& x) {
    BlockJacobi<P, S>::update(e, x);
    assign(at_, x);
    product_ = [&e, at = at_](Vectors const& p, Vectors const& hp) { e.product(at, p, hp); };
  }
  void apply(Vectors const& g, Vectors const& z) const {
    BlockJacobi<P, S>::apply(g, z);
    product_(z, h_);
    BlockJacobi<P, S>::apply(h_, correction_);
    for_each<S>("neumann", int(z.extent(0)), Combine{z, correction_});
  }

private:
  struct Combine {
    Vectors z, correction;
    KOKKOS_FUNCTION void operator()(int i) const {
      using Real = typename P::real;
      for (int c = 0; c < 3; ++c) z(i, c) = Real(w) * (2 * z(i, c) - Real(w) * correction(i, c));
    }
  };
  Vectors h_, correction_;
  Positions at_;
  std::function<void(Vectors const&, Vectors const&)> product_;
};

template <template <class, class> class Preconditioner>
int iterations(Bar const& bar) {
  Potential scene(bar.unknowns, Inertia(bar.unknowns), BodyForce(bar.unknowns, {0, -9.81, 0}),
                  ElasticTets<Elastic<StableNeoHookean>>(bar.rest, lame_parameters(1e7, 0.4)));
  ImplicitEuler<Ncg<DaiKou, Preconditioner>> stepper;
  State<> state = bar.state();
  int total = 0;
  for (int step = 0; step < 5; ++step) {
    MinimiserReport const report = stepper.step(scene, state, 0.01);
    if (!report.converged()) return -1;
    total += report.iterations;
  }
  return total;
}

int main() {
  Kokkos::ScopeGuard const kokkos;
  Bar const bar;
  int const own = iterations<Neumann>(bar), block_jacobi = iterations<BlockJacobi>(bar);
  std::printf("iterations in 5 steps: own %d, block Jacobi %d\n", own, block_jacobi);
  return own > 0 && own < block_jacobi ? 0 : 1;
}
