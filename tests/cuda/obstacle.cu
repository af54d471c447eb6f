// The kernels of obstacles, instantiated once (see all_kernels.cu).
#include <taut/contact/obstacle.hpp>

using namespace taut;

template class taut::Obstacle<HalfSpace>;
template class taut::Obstacle<InsideBox, Normalised<IpcBarrier>, GivenStiffness, Fp32>;
template class taut::Obstacle<InsideBall, CubicBarrier, GivenStiffness, Fp64>;
template class taut::Obstacle<InsideCylinder>;
