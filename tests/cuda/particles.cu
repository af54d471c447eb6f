// The kernels of material points, instantiated once (see all_kernels.cu).
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/hencky.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/ghost_penalty.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/particle_stepper.hpp>
#include <taut/mpm/slip.hpp>

using namespace taut;

using Points = ElasticParticles<Elastic<StableNeoHookean>>;
template class taut::ElasticParticles<Elastic<StableNeoHookean>>;
template class taut::ElasticParticles<Elastic<NeoHookean>, CubicSpline, Fp64>;
template class taut::ElasticParticles<Hencky>;
template class taut::GhostPenalty<>;
template class taut::Slip<>;

using Stepper = ParticleStepper<ImplicitEuler<Ncg<DaiKou, BlockJacobi>>>;
template auto Stepper::step(Potential<Inertia<>, Points>&, Stepper::Grid&, Particles<Mixed> const&,
                            double);

using Projected = ElasticParticles<Elastic<FixedCorotated, FullProjection>>;
template class taut::ParticleMultigrid<>;
template void ParticleMultigrid<>::update(Potential<Inertia<>, Projected, GhostPenalty<>, Slip<>>&,
                                          VectorField<double, DefaultSpace> const&);
