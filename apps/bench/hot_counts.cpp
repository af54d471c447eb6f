#include <taut/apps/bench/hot_counts.hpp>

namespace taut {

SweepCounts count_particles(std::string_view kernel, double particles) {
  constexpr double real = 8;
  // Of a particle: its place in the cell, F, the product of volume and stiffness; the 45 numbers of
  // its Hessian.
  constexpr double point = 13 * real, numbers = 45 * real;
  constexpr double weights = 24, seen = 558, gradient = 486;
  // F = (I + grad u) F0, and the same from grad p.
  constexpr double deformation = 45 + 3, direction = 45;
  MaterialCounts const m = count_material("fixed_corotated");
  double const vector = 3 * real / particles;  // of a field over the nodes

  if (kernel == "to_grid") {
    return {16 * real + 4 * real / particles, weights + seen + 27};
  }
  if (kernel == "to_particles") {
    // x and F change, v and C are new; u and the change of v come from the nodes.
    return {(6 + 18 + 3 + 9) * real + 2 * vector, weights + 2 * seen + deformation + 3};
  }
  if (kernel == "change") {
    return {point + 2 * vector, weights + 2 * (gradient + deformation) + m.state + m.change + 2};
  }
  if (kernel == "gradient") {
    return {point + 3 * vector,
            weights + gradient + deformation + m.state + m.stress + direction + 9 + gradient};
  }
  if (kernel == "quadratic_form") {
    return {point + 2 * vector,
            weights + 2 * gradient + deformation + direction + m.state + m.form + 2};
  }
  if (kernel == "linearise") return {point + numbers + vector, 0};
  if (kernel == "linearise_fp32") return {point + numbers / 2 + vector, 0};
  if (kernel == "product" || kernel == "product_fp32") {
    double const bytes = numbers + 2 * vector;
    return {kernel == "product" ? bytes : bytes / 2, weights + 2 * gradient + 2 * 81};
  }
  if (kernel == "assembly") {
    // Each gradient of the 27 contracted with the symmetric 9x9, then 378 pairs of them.
    return {numbers + 125 * 9 * real / particles, weights + 27 * 162 + 378 * 54};
  }
  return {};
}

}  // namespace taut
