#include <taut/apps/bench/body.hpp>
#include <taut/apps/bench/counts.hpp>
#include <taut/apps/bench/elastic.hpp>
#include <taut/apps/bench/memory.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/report/error.hpp>

#include <cmath>

namespace taut {

BenchBody::BenchBody(int tets) {
  auto const tets_of = [](int n) { return 12 * n * n * (n + 1); };  // a box of n^3 cells
  int n = std::max(1, static_cast<int>(std::cbrt(tets / 12.0)));
  if (tets_of(n + 1) - tets < tets - tets_of(n)) ++n;
  TetMesh const mesh = make_shape(BoxShape{}, n);
  Ordering const order = locality_order(mesh);
  for (std::int32_t v : order.vertices) rest.points.push_back(mesh.points[v]);
  for (std::int32_t t : order.tets) {
    Tet tet;
    for (int a = 0; a < 4; ++a) tet[a] = order.new_vertex[mesh.tets[t][a]];
    rest.tets.push_back(tet);
  }
  mass = lumped_mass(rest, std::vector<double>(rest.tets.size(), 1000.0));
  edge = mean_edge_length(rest);
}

Point bench_position(Point const& X) {
  return {1.1 * X[0] + 0.05 * std::sin(4 * X[1]), 0.9 * X[1] + 0.06 * std::sin(5 * X[2]),
          X[2] + 0.2 * X[1] + 0.04 * std::sin(6 * X[0])};
}

Point bench_direction(Point const& X) {
  return {1e-3 * std::sin(7 * X[2]), 1e-3 * std::sin(6 * X[0]), 1e-3 * std::sin(5 * X[1])};
}

SolverOptions bench_pncg(int iterations) {
  SceneValue::Table keys;
  auto const set = [&](std::string const& key, auto value) {
    keys.push_back({key, SceneValue{"bench", std::move(value)}});
  };
  set("method", std::string("dk"));
  set("preconditioner", std::string("jacobi"));
  set("line_search", std::string("newton_armijo"));
  set("stopping", std::string("budget"));
  set("max_iterations", std::int64_t(iterations));
  SceneValue const table{"bench", keys};
  return SolverOptions(Section(table, "solver"));
}

namespace {

/// The rows of one model in one precision on one body.
template <class P>
class ElasticBench {
public:
  ElasticBench(BenchBody const& body, std::string const& model, MachineRates const& machine,
               double seconds)
      : body_(body),
        model_(model),
        machine_(machine),
        seconds_(seconds),
        counts_(count_elastic(model, P::name, body.vertices_per_tet())) {}

  void add_rows(std::vector<BenchRow>& rows) const {
    MemoryWatch const memory;
    Unknowns<P> const unknowns(body_.mass, body_.edge);
    ProgramTerms<P> const terms = bench_terms<P>(body_, model_);
    auto const x = bench_field<typename P::position>(body_, bench_position);
    rows.push_back(iteration(unknowns, terms, x, memory));

    auto const p = bench_field<typename P::real>(body_, bench_direction);
    VectorField<typename P::real, DefaultSpace> const g("g", x.extent(0)), d("d", x.extent(0));
    double const h2 = 1e-4;

    rows.push_back(row("gradient", counts_.gradient, [&] {
      terms.add_gradient(x, h2, unknowns.fixed, g, d);
      Kokkos::fence("taut: bench");
    }));
    rows.push_back(
        row("quadratic_form", counts_.quadratic_form, [&] { terms.quadratic_form(x, p, h2); }));
  }

private:
  template <class Run>
  BenchRow row(char const* kernel, SweepCounts const& counts, Run const& run) const {
    run();
    return finish(kernel, counts, best_seconds(seconds_, run));
  }

  BenchRow finish(char const* kernel, SweepCounts const& counts, double seconds) const {
    BenchRow row{model_, P::name, machine_.threads, int(body_.rest.tets.size()), kernel};
    row.ns_per_tet = 1e9 * seconds / row.tets;
    row.bytes = counts.bytes;
    row.flops = counts.flops;
    row.fraction = limit_ns(machine_, P::name, counts) / row.ns_per_tet;
    return row;
  }

  /// Between the ends of two iterations, as an observer sees them, in a step of time from a state
  /// far from its end.
  BenchRow iteration(Unknowns<P> const& unknowns, ProgramTerms<P> const& terms,
                     typename Unknowns<P>::Positions const& start,
                     MemoryWatch const& memory) const {
    constexpr int iterations = 6;
    double const h = 0.01;
    ProgramPotential<P> potential(unknowns, Inertia<P>(unknowns),
                                  BodyForce<P>(unknowns, {0, -9.81, 0}), terms, {});
    potential.begin_step(start, h * h, h, true);
    assign(potential.template term<Inertia<P>>().target(), start);
    typename Unknowns<P>::Positions const x("x", start.extent(0));
    AnyMinimiser<P> minimiser(bench_pncg(iterations));

    double best = std::numeric_limits<double>::infinity();
    long allocations = 0;
    Timer clock;
    Observer<P, DefaultSpace> const observe = [&](Iteration<P, DefaultSpace> const& i) {
      if (i.index > 0) best = std::min(best, clock.seconds());
      if (i.index == 0) allocations = MemoryWatch::allocations();
      clock.restart();
    };
    auto const run = [&] {
      assign(x, start);
      int const taken = minimiser.minimise(potential, x, observe).iterations;
      if (taken < 2) throw Error("bench: {} stops after {} iterations", model_, taken);
    };
    run();
    long const at_first = allocations, after = MemoryWatch::allocations();
    best_seconds(seconds_, run);
    BenchRow row = finish("iteration", counts_.iteration, best);
    row.held = memory.held() / row.tets;
    row.resident = memory.resident() / row.tets;
    row.allocations = static_cast<int>(after - at_first);
    return row;
  }

  BenchBody const& body_;
  std::string const& model_;
  MachineRates const& machine_;
  double seconds_;
  ElasticCounts counts_;
};

}  // namespace

std::vector<BenchRow> measure_elastic(BenchOptions const& options, MachineRates const& machine) {
  std::vector<std::string> models = options.materials;
  if (models.empty()) {
    ElasticModels::for_each([&]<class Model>() { models.push_back(Model::name); });
  }
  std::vector<BenchRow> rows;
  for (int tets : options.tets) {
    BenchBody const body(tets);
    for (std::string const& model : models) {
      for (std::string const& precision : options.precisions) {
        auto const add = [&]<class P>() {
          ElasticBench<P>(body, model, machine, options.seconds).add_rows(rows);
        };
        if (precision == "fp32") {
          add.template operator()<Fp32>();
        } else if (precision == "mixed") {
          add.template operator()<Mixed>();
        } else if (precision == "fp64") {
          add.template operator()<Fp64>();
        } else {
          throw Error("--precisions {}: choose of fp32, mixed and fp64", precision);
        }
      }
    }
  }
  measure_variants(options, machine, rows);
  return rows;
}

}  // namespace taut
