#include <taut/apps/program/simulation_impl.hpp>
#include <taut/core/report/first_few.hpp>

namespace taut {

std::vector<std::int32_t> inverted_tets(TetMesh const& rest, std::vector<Point> const& x) {
  std::vector<std::int32_t> inverted;
  for (std::size_t t = 0; t < rest.tets.size(); ++t) {
    Mat3<double> D;
    Tet const& tet = rest.tets[t];
    for (int a = 0; a < 3; ++a)
      for (int c = 0; c < 3; ++c) D(c, a) = x[tet[a + 1]][c] - x[tet[0]][c];
    // Rest tets are positively oriented. NaN counts as inverted.
    if (!(determinant(D) > 0)) inverted.push_back(static_cast<std::int32_t>(t));
  }
  return inverted;
}

std::string first_tets(std::vector<std::int32_t> const& tets) { return first_few(tets, 5); }

std::unique_ptr<Simulation> Simulation::create(Scene const& scene, SceneGeometry const& geometry) {
  std::string const& precision = scene.solver.text("precision");
  if (precision == "fp32") return simulation_in_fp32("precision = fp32", scene, geometry);
  if (precision == "mixed") return simulation_in_mixed("precision = mixed", scene, geometry);
  return make_simulation<Fp64>(scene, geometry);
}

}  // namespace taut
