// Iteration by iteration against the recorded runs of Algorithm 1 of the PNCG paper (contact-free
// ones): DK, Jacobi, one Newton step, no safeguard.
#include "../support/data.hpp"
#include "problem.hpp"

#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("Algorithm 1 reproduces the recorded traces", "[truth]") {
  int checked = 0;
  for (auto const& trace : test::vectors("solver_traces")) {
    if (!trace["ground"].is_null() || !trace["pairs"].empty()) continue;  // contact: another module
    INFO(trace["name"]);
    ++checked;
    TetMesh rest;
    for (auto const& p : trace["X"]) rest.points.push_back({p[0], p[1], p[2]});
    for (auto const& t : trace["tets"]) rest.tets.push_back({t[0], t[1], t[2], t[3]});
    double const density = trace["density"], h = trace["dt"];
    auto const mass = lumped_mass(rest, std::vector<double>(rest.tets.size(), density));
    for (std::size_t i = 0; i < mass.size(); ++i) {
      CHECK_THAT(mass[i], WithinRel(double(trace["masses"][i]), 1e-12));
    }

    Unknowns<Fp64> const unknowns(mass, 1);
    ProgramTerms<Fp64> terms;
    ElasticPart const part{
        rest, {lame_parameters(trace["E"], trace["nu"])}, std::vector<int>(rest.tets.size(), 0)};
    std::string const model = trace["material"];
    if (model == "SNH") add_elastic_term<StableNeoHookean, Fp64>(terms, part, "clamp");
    if (model == "NH") add_elastic_term<NeoHookean, Fp64>(terms, part, "clamp");
    if (model == "FCR") add_elastic_term<FixedCorotated, Fp64>(terms, part, "clamp");
    if (model == "ARAP") add_elastic_term<Arap, Fp64>(terms, part, "clamp");
    // The recorded x~ holds gravity already.
    ProgramPotential<Fp64> potential(unknowns, Inertia<Fp64>(unknowns), BodyForce<Fp64>(unknowns),
                                     terms, {});
    auto const target = potential.term<Inertia<Fp64>>().target();
    VectorField<double, DefaultSpace> const x("x", mass.size());
    for (std::size_t i = 0; i < mass.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        target(i, c) = trace["x_tilde"][i][c];
        x(i, c) = trace["x0"][i][c];
      }
    potential.begin_step(x, h * h, h, true);
    auto const& steps = trace["steps"];
    CHECK_THAT(potential.value(x), WithinRel(double(steps[0]["E_before"]), 1e-10));

    AnyMinimiser<Fp64> pncg(solver({"precision=fp64", "method=dk", "preconditioner=jacobi",
                                    "line_search=newton", "stopping=budget", "safeguard=false",
                                    fmt::format("max_iterations={}", steps.size())}));
    int k = 0;
    pncg.minimise(potential, x, [&](Iteration<Fp64, DefaultSpace> const& i) {
      auto const& s = steps[k++];
      INFO("iteration " << i.index);
      CHECK(i.index == int(s["k"]));
      CHECK_THAT(i.beta, WithinAbs(double(s["beta"]), 1e-7 * (1 + std::abs(double(s["beta"])))));
      CHECK_THAT(i.slope, WithinRel(double(s["gTp"]), 1e-7));
      CHECK_THAT(i.curvature, WithinRel(double(s["pHp"]), 1e-7));
      CHECK_THAT(i.length, WithinRel(double(s["alpha"]), 1e-7));
      CHECK_THAT(-i.energy_change, WithinRel(double(s["dE_pred"]), 1e-7));
      CHECK_THAT(potential.value(i.x), WithinRel(double(s["E_after"]), 1e-9));
    });
    CHECK(k == int(steps.size()));
    for (std::size_t i = 0; i < mass.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        CHECK_THAT(x(i, c), WithinAbs(double(trace["x_final"][i][c]), 1e-8));
      }
  }
  CHECK(checked == 4);
}
