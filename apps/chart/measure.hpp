// How far positions x are from the solution x* of a time step: the error of position, and that of
// energy,
//
//   E(x) - E(x*) = 1/2 |d|^2_M + c h^2 Sum_e W (Psi(F* + dF) - Psi(F*) - P(F*) : dF),   d = x - x*,
//
// evaluated in fp64 and independently of the methods under test. The gradient of E at x* is zero,
// so forces and the inertial target drop out, and with them the cancellation of large numbers;
// where x still moves prescribed vertices, the work of their reactions is left out. With contact
// there is more in E than this: errors are then those of position alone.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/fem/rest_shape.hpp>

#include <optional>

namespace taut {

/// max_i |x_i - y_i|, m; NaN if any of them is.
double largest_distance(std::vector<Point> const& x, std::vector<Point> const& y);
/// |x_i - y_i| of each point, m.
std::vector<double> distances(std::vector<Point> const& x, std::vector<Point> const& y);

class StepMeasure {
public:
  virtual ~StepMeasure() = default;
  virtual double length() const = 0;  ///< m, what errors of position are relative to
  virtual double position_error(std::vector<Point> const& x) const = 0;
  /// (E(x) - E(x*)) / (E(before) - E(x*)); NaN where it is not defined.
  virtual double energy_gap(std::vector<Point> const& x) const = 0;
  /// |x_i - x*_i| / length of each point.
  virtual std::vector<double> errors(std::vector<Point> const& x) const = 0;
  /// What is left of the forces at each point, over a characteristic force of it: what methods for
  /// material points are stopped by in the literature. Empty where no term knows such a force.
  virtual std::vector<double> residuals(std::vector<Point> const&) const { return {}; }
  /// Their root mean square; NaN where there are none.
  double residual(std::vector<Point> const& x) const;
};

/// Of a step of meshes.
class MeshMeasure final : public StepMeasure {
public:
  /// `before` and `solution`: positions at the beginning of step number `step` (from 1) and its
  /// over-solved end. Errors of position are relative to `length` (m) or, by default, to the
  /// largest motion in the step. Keeps a reference to `geometry`. Throws Error if nothing moves in
  /// the step.
  MeshMeasure(Scene const& scene, SceneGeometry const& geometry, int step,
              std::vector<Point> const& before, std::vector<Point> solution,
              std::optional<double> length = {});

  double length() const override { return length_; }
  /// max_i |x_i - x*_i| / length
  double position_error(std::vector<Point> const& x) const override;
  /// NaN with contact.
  double energy_gap(std::vector<Point> const& x) const override;
  std::vector<double> errors(std::vector<Point> const& x) const override;
  /// E(x) - E(x*), kg m^2, without what contact adds to it.
  double energy_above(std::vector<Point> const& x) const;

private:
  struct Part {
    std::string model;
    std::vector<std::int32_t> tets;
  };
  template <class Model>
  double strain_energy_above(Part const& part, std::vector<Point> const& x) const;
  Mat3<double> gradient(std::int32_t tet, std::vector<Point> const& x) const;

  SceneGeometry const& geometry_;
  std::vector<Point> solution_;
  std::vector<RestShape> shapes_;
  std::vector<double> mass_;  ///< kg; zero in a quasi-static step
  std::vector<Part> parts_;
  double scale_ = 1;  ///< c h^2, s^2
  double length_ = 0, unit_energy_ = 1;
  bool contact_ = false;
};

}  // namespace taut
