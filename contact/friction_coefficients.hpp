// Coefficients of friction mu by pairs of objects.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/space.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace taut {

namespace kernels {

/// mu(a, b) of objects a and b, and of whatever has no number of its own (-1).
template <class S>
struct FrictionMatrix {
  double others = 0;
  int objects = 0;  ///< with entries in `entry`
  Kokkos::View<double const*, typename S::memory> entry;

  KOKKOS_FUNCTION double operator()(int a, int b) const {
    bool const known = a >= 0 && b >= 0 && a < objects && b < objects;
    return known ? entry(a * objects + b) : others;
  }
};

}  // namespace kernels

/// One coefficient for all pairs of objects, and exceptions.
class FrictionCoefficients {
public:
  /// For all pairs. Throws Error unless it is finite and not negative.
  FrictionCoefficients(double mu) : others_(mu) {  // NOLINT(google-explicit-constructor)
    check(mu, "");
  }

  /// For objects a and b; a = b: for parts of one against each other. Throws Error as above, and
  /// for a negative number of an object.
  FrictionCoefficients& set(int a, int b, double mu) {
    if (a < 0 || b < 0)
      throw Error("friction: there is no object {}: count from 0", std::min(a, b));
    check(mu, fmt::format(" between objects {} and {}", a, b));
    int const needed = 1 + std::max(a, b);
    if (needed > objects_) grow(needed);
    entry_[std::size_t(a) * objects_ + b] = entry_[std::size_t(b) * objects_ + a] = mu;
    return *this;
  }

  double operator()(int a, int b) const {
    bool const known = a >= 0 && b >= 0 && a < objects_ && b < objects_;
    return known ? entry_[std::size_t(a) * objects_ + b] : others_;
  }

  /// The same where kernels run.
  template <class S>
  kernels::FrictionMatrix<S> in_space() const {
    return {others_, objects_, to_space<S>("friction_coefficients", entry_)};
  }

private:
  static void check(double mu, std::string const& where) {
    if (std::isfinite(mu) && mu >= 0) return;
    throw Error("friction: a coefficient of {}{}: give a finite number that is not negative", mu,
                where);
  }
  void grow(int objects) {
    std::vector<double> entry(std::size_t(objects) * objects, others_);
    for (int a = 0; a < objects_; ++a)
      for (int b = 0; b < objects_; ++b) {
        entry[std::size_t(a) * objects + b] = entry_[std::size_t(a) * objects_ + b];
      }
    entry_ = std::move(entry);
    objects_ = objects;
  }

  double others_;
  int objects_ = 0;
  std::vector<double> entry_;
};

}  // namespace taut
