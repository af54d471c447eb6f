#include <taut/apps/bench/hot.hpp>
#include <taut/apps/bench/hot_counts.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/apps/program/particle_potential.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/sampling.hpp>
#include <taut/mpm/transfer.hpp>

#include <array>
#include <cmath>

namespace taut {
namespace {

using P = ParticlePrecision;
using S = DefaultSpace;
using K = ParticleKernel;
using Vectors = VectorField<P::real, S>;

using DefaultCycle = ParticleCyclePolicies<>;
using HotCycle = ParticleCyclePolicies<true, SymmetricGaussSeidel, SymmetricGaussSeidel,
                                       LinearEmbedding, double>;

constexpr double h = 0.01, h2 = h * h;

/// A cube of edge 1, stretched by up to a tenth and turned.
std::vector<Particle> strained_cube(int cells) {
  ParticleBody const body{.name = "cube", .solid = solid_box({1, 1, 1})};
  std::vector<Particle> particles = sample({&body, 1}, 1.0 / cells);
  for (Particle& p : particles) {
    double const wave = 0.1 * std::sin(6 * p.x[0] + 2 * p.x[1]);
    Mat3<double> stretch = identity3<double>();
    stretch(0, 0) += wave;
    stretch(1, 2) += 0.5 * wave;
    stretch(2, 2) -= 0.3 * wave;
    p.F = turn_matrix({{0, 0, 1}, 1 + p.x[0]}) * stretch;
    p.v = {std::sin(3 * p.x[1]), p.x[0], -p.x[2]};
    p.C = 0.2 * stretch;
  }
  return particles;
}

class HotBench {
public:
  HotBench(int cells, HotBenchOptions const& options, MachineRates const& machine)
      : options_(options),
        machine_(machine),
        particles_(strained_cube(cells)),
        grid_(1.0 / cells),
        potential_(make_potential()) {
    all_.threads = machine.threads;
    all_.cells = cells;
    all_.particles = particles_.count;
  }

  std::vector<HotRow> rows() {
    sweeps();
    cycle<DefaultCycle>("default", {});
    cycle<HotCycle>("hot",
                    {.cycle = {.max_levels = 3, .direct_nodes = 0, .coarse_tolerance = 0.5}});
    return rows_;
  }

private:
  ParticlePotential make_potential() {
    grid_.rebuild(particles_, 1);
    add_particle_term(terms_, "fixed_corotated", std::array{lame_parameters(1e5, 0.3)},
                      std::array{MaterialFlow()});
    terms_.update(particles_, grid_.blocks(), grid_.nodes(), grid_.rest());
    return ParticlePotential(grid_.unknowns(), Inertia<P>(grid_.unknowns()),
                             BodyForce<P>(grid_.unknowns(), {0, 0, 0}), terms_,
                             GhostPenalty<K, P>({.strength = 0}), Slip<P>());
  }

  template <class Run>
  double seconds(Run const& run) const {
    auto const fenced = [&] {
      run();
      Kokkos::fence("taut: bench");
    };
    fenced();
    return best_seconds(options_.seconds, fenced);
  }
  HotRow& add(std::string_view kernel, std::string_view per, double units, double seconds,
              SweepCounts const& counts = {}) {
    HotRow& row = rows_.emplace_back(all_);
    row.kernel = kernel;
    row.per = per;
    row.ns = 1e9 * seconds / units;
    row.bytes = counts.bytes;
    row.flops = counts.flops;
    if (counts.bytes > 0) row.fraction = limit_ns(machine_, P::name, counts) / row.ns;
    return row;
  }
  template <class Run>
  void sweep(std::string_view kernel, Run const& run) {
    double const n = particles_.count;
    add(kernel, "particle", n, seconds(run), count_particles(kernel, n / all_.nodes));
  }

  void sweeps() {
    int const n = grid_.size();
    all_.nodes = n;
    auto const& blocks = grid_.blocks();
    sweep("rebuild", [&] { grid_.rebuild(particles_, 1); });
    potential_.resize(grid_.unknowns());
    terms_.update(particles_, blocks, grid_.nodes(), grid_.rest());
    GridTransfer<K, P, S> transfer;
    sweep("to_grid", [&] { transfer.to_grid(particles_, blocks, n, grid_.dx()); });
    // From nodes that stand: whatever is done often leaves the particles where they are.
    sweep("to_particles", [&] {
      grid_.to_particles(particles_, grid_.rest(), grid_.velocity(), h, Apic{}, NoFlow{});
    });

    x_ = Positions("bench_x", n);
    p_ = Vectors("bench_direction", n);
    g_ = Vectors("bench_gradient", n);
    BlockField<P::real, S> const curvature("bench_curvature", n);
    assign(x_, grid_.rest());
    assign(p_, grid_.velocity());
    auto const& fixed = grid_.unknowns().fixed;
    sweep("change", [&] { terms_.change(x_, p_, 1e-3, h2); });
    sweep("gradient", [&] { terms_.add_gradient(x_, h2, fixed, g_); });
    sweep("gradient_blocks", [&] { terms_.add_gradient(x_, h2, fixed, g_, curvature); });
    sweep("quadratic_form", [&] { terms_.quadratic_form(x_, p_, h2); });
    ParticleTerms::Operator hessian;
    sweep("linearise", [&] { terms_.linearise(x_, h2, hessian); });
    hessian.set_local(curvature, fixed);
    sweep("product", [&] { hessian.product(p_, g_); });
    ParticleTerms::Rounded rounded;
    sweep("linearise_fp32", [&] { terms_.linearise(x_, h2, rounded); });
    BlockField<float, S> const rounded_curvature("bench_rounded_curvature", n);
    VectorField<float, S> const p("bench_rounded_direction", n), hp("bench_rounded_product", n);
    for_each<S>("bench_round", n, kernels::ConvertVectors<S, P::real, float>{p_, p});
    rounded.set_local(rounded_curvature, fixed);
    sweep("product_fp32", [&] { rounded.product(p, hp); });
    MatrixLevel<S, P::real, K::width - 1> fine;
    fine.resize(hessian.nodes(), hessian.fixed());
    sweep("assembly", [&] { hessian.matrix(fine.matrix()); });
  }

  /// 3x3 blocks of the fine matrix: pairs of nodes that are at most two cells apart.
  double fine_blocks() const {
    auto const place = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_.nodes().ijk);
    int const edge = all_.cells + 12, shift = all_.cells / 2 + 6, n = grid_.size();
    auto const at = [&](int x, int y, int z) {
      return (std::size_t(x + shift) * edge + std::size_t(y + shift)) * edge +
             std::size_t(z + shift);
    };
    std::vector<char> there(std::size_t(edge) * edge * edge);
    for (int i = 0; i < n; ++i) there[at(place(i, 0), place(i, 1), place(i, 2))] = 1;
    long count = 0;
    for (int i = 0; i < n; ++i)
      for (int x = -2; x <= 2; ++x)
        for (int y = -2; y <= 2; ++y)
          for (int z = -2; z <= 2; ++z)
            count += there[at(place(i, 0) + x, place(i, 1) + y, place(i, 2) + z)];
    return double(count);
  }

  template <class A, class Smoother>
  void smoother(Smoother policy, A const& level, int number) {
    using T = typename A::Scalar;
    LevelVectors<T, S> v;
    v.resize(level.size());
    policy.setup(level, v);
    assign(v.b, 1);
    double const time = seconds([&] {
      policy.first(level, v);
      policy.second(level, v);
    });
    HotRow& row = add("smoother", "node", level.size(), time);
    row.level = number;
    row.nodes = level.size();
  }

  template <class Policies>
  void cycle(std::string const& name,
             typename ParticleMultigrid<P, S, Policies>::Params const& params) {
    all_.cycle = name;
    int const n = grid_.size();
    ParticleMultigrid<P, S, Policies> multigrid(params);
    multigrid.resize(n);
    potential_.begin_step(x_, h2, h, true);
    double const built = seconds([&] { multigrid.update(potential_, x_); });
    auto const& report = multigrid.report();
    double const held = double(multigrid.memory()) / n;
    add("hierarchy", "node", n, built).held = held;
    smoother(typename Policies::FineSmoother(params.cycle.fine), multigrid.fine(), 0);
    for (int l = 1; l < static_cast<int>(report.nodes.size()); ++l) {
      if (l + 1 == static_cast<int>(report.nodes.size()) && report.direct) break;
      smoother(typename Policies::Smoother(params.cycle.smoother), multigrid.cycle().level(l - 1),
               l);
    }
    double const time = seconds([&] { multigrid.apply(p_, g_); });
    // All of the hierarchy is read before the coarser level and after it.
    add("cycle", "node", n, time, {2 * held, 0});
    if (Policies::assembled) add("cycle", "block", fine_blocks(), time);
    all_.cycle.clear();
  }

  using Positions = VectorField<P::position, S>;

  HotBenchOptions const& options_;
  MachineRates const& machine_;
  Particles<P, S> particles_;
  ProgramGrid grid_;
  ParticleTerms terms_;
  ParticlePotential potential_;
  Positions x_;
  Vectors p_, g_;
  HotRow all_;
  std::vector<HotRow> rows_;
};

}  // namespace

std::vector<HotRow> measure_hot(HotBenchOptions const& options, MachineRates const& machine) {
  std::vector<HotRow> rows;
  for (int cells : options.cells) {
    std::vector<HotRow> const measured = HotBench(cells, options, machine).rows();
    rows.insert(rows.end(), measured.begin(), measured.end());
  }
  return rows;
}

}  // namespace taut
