#include <taut/apps/chart/measure.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/isotropic.hpp>
#include <taut/materials/models.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut {
namespace {

double energy_scale(Scene const& scene, int step) {
  if (scene.scheme == TimeScheme::quasi_static) return 1;
  double const h2 = scene.step * scene.step;
  bool const bdf2 = scene.scheme == TimeScheme::bdf2 && step > 1;
  return bdf2 ? h2 * Bdf2Rule::coefficients(1).scale : h2;
}

}  // namespace

double largest_distance(std::vector<Point> const& x, std::vector<Point> const& y) {
  double largest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    double square = 0;
    for (int c = 0; c < 3; ++c) square += (x[i][c] - y[i][c]) * (x[i][c] - y[i][c]);
    if (std::isnan(square)) return square;
    largest = std::max(largest, square);
  }
  return std::sqrt(largest);
}

std::vector<double> distances(std::vector<Point> const& x, std::vector<Point> const& y) {
  std::vector<double> all(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    all[i] = std::hypot(x[i][0] - y[i][0], x[i][1] - y[i][1], x[i][2] - y[i][2]);
  return all;
}

double StepMeasure::residual(std::vector<Point> const& x) const {
  std::vector<double> const all = residuals(x);
  if (all.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (double one : all) sum += one * one;
  return std::sqrt(sum / static_cast<double>(all.size()));
}

MeshMeasure::MeshMeasure(Scene const& scene, SceneGeometry const& geometry, int step,
                         std::vector<Point> const& before, std::vector<Point> solution,
                         std::optional<double> length)
    : geometry_(geometry),
      solution_(std::move(solution)),
      scale_(energy_scale(scene, step)),
      contact_(scene.contact.has_value()) {
  TetMesh const& mesh = geometry.mesh;
  std::vector<double> density;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    MaterialParameters const& material = geometry.materials[geometry.material_of_tet[t]];
    density.push_back(material.density);
    shapes_.push_back(rest_shape(mesh.points, mesh.tets[t]));
    auto part = std::find_if(parts_.begin(), parts_.end(),
                             [&](Part const& p) { return p.model == material.model; });
    if (part == parts_.end()) part = parts_.insert(parts_.end(), Part{material.model, {}});
    part->tets.push_back(static_cast<std::int32_t>(t));
  }
  mass_ = lumped_mass(mesh, density);
  if (scene.scheme == TimeScheme::quasi_static) std::fill(mass_.begin(), mass_.end(), 0.0);

  length_ = length ? *length : largest_distance(before, solution_);
  if (!(length_ > 0)) {
    throw Error("nothing moves in step {}: compare another one with --frame", step);
  }
  unit_energy_ = energy_above(before);
}

double MeshMeasure::position_error(std::vector<Point> const& x) const {
  return largest_distance(x, solution_) / length_;
}

std::vector<double> MeshMeasure::errors(std::vector<Point> const& x) const {
  std::vector<double> all = distances(x, solution_);
  for (double& one : all) one /= length_;
  return all;
}

double MeshMeasure::energy_gap(std::vector<Point> const& x) const {
  return contact_ ? std::numeric_limits<double>::quiet_NaN() : energy_above(x) / unit_energy_;
}

Mat3<double> MeshMeasure::gradient(std::int32_t tet, std::vector<Point> const& x) const {
  Tet const& v = geometry_.mesh.tets[tet];
  Mat3<double> edges;
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c) edges(c, a) = x[v[a + 1]][c] - x[v[0]][c];
  return edges * shapes_[tet].B;
}

template <class Model>
double MeshMeasure::strain_energy_above(Part const& part, std::vector<Point> const& x) const {
  double sum = 0;
  for (std::int32_t t : part.tets) {
    MaterialParameters const& material = geometry_.materials[geometry_.material_of_tet[t]];
    Lame<double> const lame = lame_parameters(material.young, material.poisson);
    Mat3<double> const at_solution = gradient(t, solution_), F = gradient(t, x);
    Mat3<double> const dF = F - at_solution;
    double const change = energy_change<Model>(lame, evaluate<Model>(lame, F), dF);
    double const linear = contract(stress<Model>(evaluate<Model>(lame, at_solution)), dF);
    sum += shapes_[t].W * (change - linear);
  }
  return sum;
}

double MeshMeasure::energy_above(std::vector<Point> const& x) const {
  double strain = 0, inertia = 0;
  for (Part const& part : parts_) {
    strain += ElasticModels::with(
        part.model, [&]<class Model>() { return strain_energy_above<Model>(part, x); });
  }
  for (std::size_t i = 0; i < mass_.size(); ++i)  // behind these, obstacles
    for (int c = 0; c < 3; ++c)
      inertia += 0.5 * mass_[i] * (x[i][c] - solution_[i][c]) * (x[i][c] - solution_[i][c]);
  return inertia + scale_ * strain;
}

}  // namespace taut
