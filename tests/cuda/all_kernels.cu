// Every device kernel of the library, instantiated once: compiled where there is an nvcc, run
// nowhere.
#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/integrators/chebyshev.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/schwarz.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>

using namespace taut;

// The sweeps: every model in one precision, every filter and every precision once.
template class taut::ElasticTets<Elastic<Arap>, Mixed, DefaultSpace>;
template class taut::ElasticTets<Elastic<FixedCorotated, LimitLambda>, Mixed, DefaultSpace>;
template class taut::ElasticTets<Elastic<NeoHookean>, Mixed, DefaultSpace>;
template class taut::ElasticTets<Elastic<StableNeoHookean>, Mixed, DefaultSpace>;
template class taut::ElasticTets<Elastic<StableNeoHookean2018, FullProjection>, Fp64, DefaultSpace>;
template class taut::ElasticTets<Elastic<StableNeoHookean>, Fp32, DefaultSpace>;

/// Pulls two unknowns together.
struct Spring {
  static constexpr int vertices = 2;
  KOKKOS_FUNCTION double value(int, Vec3<double> const (&x)[2]) const {
    return dot(x[1] - x[0], x[1] - x[0]);
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int, Vec3<double> const (&x)[2], int a) const {
    return (a == 0 ? -2.0 : 2.0) * (x[1] - x[0]);
  }
  KOKKOS_FUNCTION Mat3<double> curvature(int, Vec3<double> const (&)[2], int a, int b) const {
    return (a == b ? 2.0 : -2.0) * identity3<double>();
  }
};
template class taut::StencilTerm<Spring, Mixed, DefaultSpace>;

// The minimisers with their vertex kernels, on one potential.
using Scene = Potential<Inertia<>, BodyForce<>, ElasticTets<Elastic<StableNeoHookean>>>;

template <class Minimiser>
void step(Scene& scene, State<>& state) {
  ImplicitEuler<Minimiser>().step(scene, state, 0.01);
}

void all_minimisers(Scene& scene, State<>& state) {
  step<Ncg<DaiKou, Identity>>(scene, state);
  step<Ncg<DaiKou, Jacobi>>(scene, state);
  step<Ncg<DaiKou, BlockJacobi>>(scene, state);
  step<Ncg<DaiKou, Schwarz>>(scene, state);
  step<Lbfgs<BlockJacobi>>(scene, state);
  step<Chebyshev<Jacobi>>(scene, state);
  step<Newton<AssembledPcg>>(scene, state);
  step<Newton<MatrixFreePcg>>(scene, state);
  Bdf2<Ncg<DaiKou, Jacobi>>().step(scene, state, 0.01);
  QuasiStatic<Ncg<DaiKou, Jacobi>>().step(scene, state, 0.01);
}
