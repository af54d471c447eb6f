// Matrices to test decompositions on: random ones and every degenerate kind, drawn in double and
// rounded to the precision under test. What is measured on a result is computed in long double.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace taut::test {

using Random = std::mt19937_64;
using Wide = Mat3<long double>;

#ifdef NDEBUG
inline constexpr int many = 250'000, some = 4'000;  // per scalar type
#else
inline constexpr int many = 10'000, some = 500;  // unoptimised, under sanitizers
#endif

/// Machine epsilon of the scalar behind T, the unit of all tolerances.
template <class T>
inline constexpr double epsilon = std::numeric_limits<ValueType<T>>::epsilon();

/// A size whose square is far from overflow, as the decompositions ask for.
template <class T>
inline constexpr double extreme_size = std::is_same_v<ValueType<T>, float> ? 1e15 : 1e30;

double uniform(Random& random, double from, double to);
/// Evenly distributed exponents.
double log_uniform(Random& random, double from, double to);
Mat3<double> uniform_matrix(Random& random);
Mat3<double> diagonal(double a, double b, double c);
/// U diag(a, b, c) V^T with random rotations U and V.
Mat3<double> with_stretches(Random& random, double a, double b, double c);

/// A kind of deformation gradient.
struct Family {
  std::string name;
  std::function<Mat3<double>(Random&)> draw;
};
/// `extreme` is a size like 1e15, applied and inverted.
std::vector<Family> deformations(double extreme);

// What Eigen says.
struct Reference {
  Vec3<double> s;  ///< signed singular values
  Mat3<double> R;  ///< nearest rotation
};
Reference eigen_svd(Mat3<double> const& F);
/// Ascending eigenvalues of a symmetric n x n matrix, and its eigenvectors column after column.
struct SymmetricReference {
  std::vector<long double> values, vectors;
};
SymmetricReference eigen_symmetric(std::span<long double const> matrix, int n);

template <class T>
void set_lane(T& pack, int i, double value) {
  ValueType<T> all[ScalarTraits<T>::lanes];
  store(pack, all);
  all[i] = static_cast<ValueType<T>>(value);
  pack = load<T>(all);
}
template <class T>
void set_lane(Mat3<T>& pack, int i, Mat3<double> const& value) {
  for (int k = 0; k < 9; ++k) set_lane(pack.a[k], i, value.a[k]);
}
template <class T>
Wide wide(Mat3<T> const& pack, int i) {
  Wide m;
  for (int k = 0; k < 9; ++k) m.a[k] = lane(pack.a[k], i);
  return m;
}
template <class T>
Vec3<long double> wide(Vec3<T> const& pack, int i) {
  return {lane(pack[0], i), lane(pack[1], i), lane(pack[2], i)};
}

/// Draws `count` matrices of a family, as many at a time as T has lanes, and hands each pack over.
template <class T, class Use>
void draw_packs(Family const& family, int count, Use const& use) {
  Random random(std::hash<std::string>{}(family.name));
  for (int drawn = 0; drawn < count; drawn += ScalarTraits<T>::lanes) {
    Mat3<T> F;
    for (T& entry : F.a) entry = T(0);
    for (int i = 0; i < ScalarTraits<T>::lanes; ++i) set_lane(F, i, family.draw(random));
    use(F);
  }
}

/// The largest of many errors; a NaN counts as infinite.
class Worst {
public:
  void see(long double error) {
    double const e = std::isnan(error) ? std::numeric_limits<double>::infinity()
                                       : static_cast<double>(std::abs(error));
    if (e > worst_) worst_ = e;
  }
  double value() const { return worst_; }

private:
  double worst_ = 0;
};

template <class T>
T frobenius(Mat3<T> const& m) {
  return std::sqrt(contract(m, m));
}
/// |F|, and 1 for the zero matrix, so that errors relative to it are absolute.
inline long double size(Wide const& F) {
  long double const norm = frobenius(F);
  return norm > 0 || std::isnan(norm) ? norm : 1;
}
inline long double orthogonality(Wide const& R) {
  return frobenius(transpose_times(R, R) - identity3<long double>());
}
/// V diag(d) V^T or, with another left factor, U diag(d) V^T.
inline Wide compose(Wide const& U, Vec3<long double> const& d, Wide const& V) {
  return U * Wide{{d[0], 0, 0, 0, d[1], 0, 0, 0, d[2]}} * transpose(V);
}

}  // namespace taut::test
