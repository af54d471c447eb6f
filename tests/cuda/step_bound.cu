// The kernels of contact step bounds, instantiated once (see all_kernels.cu).
#include <taut/contact/step_bound_sweep.hpp>

using namespace taut;

namespace {

template <class Precision, PairKind kind>
double all_step_bounds(PairList<DefaultSpace> const& pairs,
                       VectorField<typename Precision::position, DefaultSpace> const& x,
                       VectorField<typename Precision::real, DefaultSpace> const& p,
                       Array<typename Precision::position, DefaultSpace> const& alpha) {
  Clearance const clearance;
  double sum =
      bound_step<Precision, DefaultSpace, kind>(AdditiveCcd{}, clearance, pairs, 10, x, p, 1.0)
          .alpha;
  sum +=
      bound_step<Precision, DefaultSpace, kind>(PairwiseClosing{}, clearance, pairs, 10, x, p, 1.0)
          .alpha;
  sum +=
      bound_step<Precision, DefaultSpace, kind>(HalfDhatClamp{1}, clearance, pairs, 10, x, p, 1.0)
          .alpha;
  sum += bound_vertices<Precision, DefaultSpace, kind>(PlanarScaling{}, clearance, pairs, 10, x, p,
                                                       1.0, alpha)
             .alpha;
  sum += bound_vertices<Precision, DefaultSpace, kind>(IsotropicPerVertex{}, clearance, pairs, 10,
                                                       x, p, 1.0, alpha)
             .alpha;
  return sum + covered_step<Precision, DefaultSpace>(x, 1, 0, x, p, 1.0);
}

}  // namespace

template <class Precision>
double contact_step_bounds(PairList<DefaultSpace> const& pairs,
                           VectorField<typename Precision::position, DefaultSpace> const& x,
                           VectorField<typename Precision::real, DefaultSpace> const& p,
                           Array<typename Precision::position, DefaultSpace> const& alpha) {
  return all_step_bounds<Precision, PairKind::point_triangle>(pairs, x, p, alpha) +
         all_step_bounds<Precision, PairKind::edge_edge>(pairs, x, p, alpha);
}

template double contact_step_bounds<Fp64>(PairList<DefaultSpace> const&,
                                          VectorField<double, DefaultSpace> const&,
                                          VectorField<double, DefaultSpace> const&,
                                          Array<double, DefaultSpace> const&);
template double contact_step_bounds<Mixed>(PairList<DefaultSpace> const&,
                                           VectorField<double, DefaultSpace> const&,
                                           VectorField<float, DefaultSpace> const&,
                                           Array<double, DefaultSpace> const&);
template double contact_step_bounds<Fp32>(PairList<DefaultSpace> const&,
                                          VectorField<float, DefaultSpace> const&,
                                          VectorField<float, DefaultSpace> const&,
                                          Array<float, DefaultSpace> const&);
