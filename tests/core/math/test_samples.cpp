// The drawing of matrices and the answers of Eigen, which is slow to compile: the tests of the
// decompositions share this file.
#include "samples.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace taut::test {
namespace {

// Of the quaternion (w, x, y, z), of any length.
Mat3<double> rotation(double w, double x, double y, double z) {
  double const s = 2 / (w * w + x * x + y * y + z * z);
  return {{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y),  //
           s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x),  //
           s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}};
}

Mat3<double> random_rotation(Random& random) {
  std::normal_distribution<double> normal;
  double const w = normal(random), x = normal(random), y = normal(random);
  return rotation(w, x, y, normal(random));
}

// One of the 24 rotations that map the axes onto each other.
Mat3<double> axis_rotation(Random& random) {
  Mat3<double> r = identity3<double>();
  for (int turns = static_cast<int>(random() % 8); turns >= 0; --turns) {
    int const i = static_cast<int>(random() % 3), j = (i + 1) % 3, k = (i + 2) % 3;
    Mat3<double> quarter{};
    quarter(i, i) = quarter(k, j) = 1;
    quarter(j, k) = -1;
    r = r * quarter;
  }
  return r;
}

Mat3<double> near_axis_rotation(Random& random) {
  double const x = log_uniform(random, 1e-9, 1), y = log_uniform(random, 1e-9, 1);
  return rotation(uniform(random, -1, 1), x, y, log_uniform(random, 1e-9, 1));
}

double coin(Random& random) { return random() % 2 == 0 ? 1.0 : -1.0; }

}  // namespace

double uniform(Random& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

double log_uniform(Random& random, double from, double to) {
  return std::exp(uniform(random, std::log(from), std::log(to)));
}

Mat3<double> uniform_matrix(Random& random) {
  Mat3<double> m;
  for (double& entry : m.a) entry = uniform(random, -1, 1);
  return m;
}

Mat3<double> diagonal(double a, double b, double c) { return {{a, 0, 0, 0, b, 0, 0, 0, c}}; }

Mat3<double> with_stretches(Random& random, double a, double b, double c) {
  return random_rotation(random) * diagonal(a, b, c) * random_rotation(random);
}

std::vector<Family> deformations(double extreme) {
  using M = Mat3<double>;
  auto const I = identity3<double>();
  return {
      {"identity", [I](Random&) { return I; }},
      {"zero", [](Random&) { return M{}; }},
      {"minus identity", [I](Random&) { return -1.0 * I; }},
      {"small strain",
       [I](Random& r) {
         return random_rotation(r) * (I + log_uniform(r, 1e-8, 0.3) * uniform_matrix(r));
       }},
      {"strained",
       [](Random& r) {
         return with_stretches(r, uniform(r, 0.3, 3), uniform(r, 0.3, 3), uniform(r, 0.3, 3));
       }},
      {"flat",
       [](Random& r) { return with_stretches(r, uniform(r, 0.1, 2), uniform(r, 0.1, 2), 0); }},
      {"rank one", [](Random& r) { return with_stretches(r, uniform(r, 0.1, 2), 0, 0); }},
      {"nearly rank one",
       [](Random& r) {
         return with_stretches(r, 1, log_uniform(r, 1e-12, 1), log_uniform(r, 1e-12, 1));
       }},
      {"inverted",
       [](Random& r) {
         return with_stretches(r, uniform(r, 0.1, 2), uniform(r, 0.1, 2), uniform(r, -2, 0));
       }},
      {"s1 + s2 near zero",
       [](Random& r) {
         double const s = uniform(r, 0.01, 1);
         return with_stretches(r, 1, s, log_uniform(r, 1e-12, 0.1) - s);
       }},
      {"nearly a reflection",
       [](Random& r) {
         double const a = log_uniform(r, 1e-12, 0.1), b = log_uniform(r, 1e-12, 0.1);
         return with_stretches(r, 1, 1 - a, b - 1);
       }},
      {"reflection", [](Random& r) { return with_stretches(r, 1, 1, -1); }},
      {"axis reflection", [](Random& r) { return axis_rotation(r) * diagonal(1, 1, -1); }},
      {"permutation", axis_rotation},
      {"two equal",
       [](Random& r) {
         double const s = uniform(r, 0.1, 2);
         return with_stretches(r, s, s, uniform(r, -2, 2));
       }},
      {"three equal",
       [](Random& r) {
         double const s = uniform(r, 0.1, 2);
         return with_stretches(r, s, s, coin(r) * s);
       }},
      {"diagonal",
       [](Random& r) { return diagonal(uniform(r, -1, 1), uniform(r, -1, 1), uniform(r, -1, 1)); }},
      {"axis aligned, simple numbers",
       [](Random& r) {
         auto const number = [&] { return 0.5 * static_cast<double>(r() % 9) - 2; };
         return axis_rotation(r) * diagonal(number(), number(), number()) * axis_rotation(r);
       }},
      {"turned about nearly an axis",
       [I](Random& r) { return near_axis_rotation(r) * (I + 0.3 * uniform_matrix(r)); }},
      {"aspect ratio 1e6",
       [](Random& r) {
         return with_stretches(r, log_uniform(r, 1e-6, 1), log_uniform(r, 1e-6, 1),
                               coin(r) * log_uniform(r, 1e-6, 1));
       }},
      {"tiny", [extreme](Random& r) { return (1 / extreme) * uniform_matrix(r); }},
      {"huge", [extreme](Random& r) { return extreme * uniform_matrix(r); }},
      {"random", uniform_matrix},
  };
}

Reference eigen_svd(Mat3<double> const& F) {
  using Svd = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>;
  static Svd svd(3, 3, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.compute(Eigen::Map<Eigen::Matrix3d const>(F.a));
  Mat3<double> U, V;
  Eigen::Map<Eigen::Matrix3d>(U.a) = svd.matrixU();
  Eigen::Map<Eigen::Matrix3d>(V.a) = svd.matrixV();
  double const sign = determinant(U) * determinant(V) < 0 ? -1 : 1;
  Eigen::VectorXd const& s = svd.singularValues();
  return {{s[0], s[1], sign * s[2]}, U * diagonal(1, 1, sign) * transpose(V)};
}

SymmetricReference eigen_symmetric(std::span<long double const> matrix, int n) {
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Eigen::SelfAdjointEigenSolver<Matrix> const eigen(Eigen::Map<Matrix const>(matrix.data(), n, n));
  Matrix const& V = eigen.eigenvectors();
  return {{eigen.eigenvalues().begin(), eigen.eigenvalues().end()},
          {V.data(), V.data() + V.size()}};
}

}  // namespace taut::test
