// Every device kernel of the library, instantiated once: compiled where there is an nvcc, run
// nowhere.
#include <taut/core/exec/sort.hpp>
#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/integrators/chebyshev.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/schwarz.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>

using namespace taut;

// Scans, sorts, and sums in any order.
template class taut::StableSort<DefaultSpace, std::uint32_t>;
template class taut::StableSort<DefaultSpace, std::uint64_t>;
template class taut::BucketSort<DefaultSpace>;

using Values = Kokkos::View<double*, DefaultSpace::memory>;
struct AddTerm {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    sums[0] += value(i);
    sums[1] += 1;
  }
};
struct CountPositive {
  Values value;
  KOKKOS_FUNCTION std::int64_t operator()(int i) const { return value(i) > 0 ? 1 : 0; }
};
struct LowerTo {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, double& smallest) const {
    smallest = Kokkos::min(smallest, value(i));
  }
};

double all_reductions(Values const& value,
                      Kokkos::View<std::int64_t*, DefaultSpace::memory> const& begin) {
  double const sums = FreeReducer<DefaultSpace>().sum<2>("free", 10, AddTerm{value})[0] +
                      Reducer<DefaultSpace>(10).sum<2>("fixed", 10, AddTerm{value})[1];
  exclusive_scan<DefaultSpace, std::int64_t>("scan", 10, CountPositive{value}, begin);
  return sums + minimum<DefaultSpace>("minimum", 10, 0.0, LowerTo{value});
}

// Block matrices, for the tests and for terms of one's own.
double all_matrix_operations(BlockCsr<DefaultSpace> const& a,
                             VectorField<float, DefaultSpace> const& x,
                             BlockField<float, DefaultSpace> const& blocks) {
  product(a, x, x);
  diagonal_blocks(a, blocks);
  return asymmetry(a);
}

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
