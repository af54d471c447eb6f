// Deformations and helpers that the tests of the models share.
#pragma once

#include <taut/materials/models.hpp>

#include <cmath>
#include <random>
#include <vector>

namespace taut::test {

inline Mat3<double> random_matrix(std::mt19937& rng, double size = 1) {
  std::normal_distribution<double> normal(0, size);
  Mat3<double> m;
  for (double& entry : m.a) entry = normal(rng);
  return m;
}

inline Mat3<double> random_rotation(std::mt19937& rng) {
  return polar_rotation(random_matrix(rng));
}

// F = U diag(s) V^T with random rotations.
inline Mat3<double> with_stretches(std::mt19937& rng, double a, double b, double c) {
  Mat3<double> const S = {{a, 0, 0, 0, b, 0, 0, 0, c}};
  return random_rotation(rng) * S * random_rotation(rng);
}

inline double frobenius(Mat3<double> const& m) { return std::sqrt(contract(m, m)); }

// The deformations of the issue: random, compressed, stretched, inverted, at rest.
template <class Model>
std::vector<Mat3<double>> deformations() {
  std::mt19937 rng(7);
  std::vector<Mat3<double>> all = {identity3<double>(),
                                   with_stretches(rng, 1.2, 1.1, 0.9),
                                   with_stretches(rng, 0.85, 0.6, 0.4),
                                   with_stretches(rng, 0.3, 0.25, 0.2),
                                   with_stretches(rng, 3.0, 1.5, 0.7),
                                   with_stretches(rng, 8.0, 4.0, 2.0)};
  for (int k = 0; k < 20; ++k) {
    Mat3<double> F = identity3<double>() + random_matrix(rng, 0.25);
    if (Model::allows_inversion || determinant(F) > 0.05) all.push_back(F);
  }
  if (Model::allows_inversion) {
    all.push_back(with_stretches(rng, 1.1, 0.8, -0.3));
    all.push_back(with_stretches(rng, 2.0, 1.7, -1.2));
    all.push_back(with_stretches(rng, 1.0, 0.6, 0.0));
  }
  return all;
}

inline constexpr Lame<double> lame{3571.428571428572, 14285.71428571429};

}  // namespace taut::test
