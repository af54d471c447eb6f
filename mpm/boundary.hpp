// What holds the nodes of a grid: half-spaces, boxes, balls, cylinders, tori and what has a field
// of distances (distance_field.hpp), solid inside or outside, which move rigidly. A node belongs to
// a boundary if it is in the solid at the end of the step; what is asked of it there is asked of
// its velocity, for nodes of a grid stay where they are: none relative to the solid (sticky), none
// along the normal (slip), none into it (separate).
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/space.hpp>
#include <taut/core/math/rigid_pose.hpp>
#include <taut/core/report/error.hpp>
#include <taut/mpm/distance_field.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace taut {

enum class BoundaryShape : std::uint8_t { half_space, box, ball, cylinder, torus, field };
enum class BoundaryContact : std::uint8_t { sticky, slip, separate };

/// A DistanceField as kernels see it.
struct FieldView {
  float const* values = nullptr;
  int n[3] = {0, 0, 0};
  double spacing = 1, band = 0;
  Vec3<double> lowest{};

  /// The trilinear interpolant, and its direction of ascent, which is 0 where all is as far as the
  /// band; the band's width around the lattice.
  KOKKOS_FUNCTION double distance(Vec3<double> const& y, Vec3<double>& normal) const {
    int at[3];
    double t[3];
    normal = {};
    for (int c = 0; c < 3; ++c) {
      double const u = (y[c] - lowest[c]) / spacing;
      if (!(u >= 0 && u < n[c] - 1)) return band;
      at[c] = static_cast<int>(u);
      t[c] = u - at[c];
    }
    double d = 0;
    Vec3<double> ascent{};
    for (int corner = 0; corner < 8; ++corner) {
      int const on[3] = {corner >> 2, corner >> 1 & 1, corner & 1};
      double weight[3], slope[3];
      for (int c = 0; c < 3; ++c) {
        weight[c] = on[c] ? t[c] : 1 - t[c];
        slope[c] = on[c] ? 1 : -1;
      }
      std::size_t const i = std::size_t(at[0] + on[0]), j = std::size_t(at[1] + on[1]),
                        k = std::size_t(at[2] + on[2]);
      double const value = double(values[(i * n[1] + j) * n[2] + k]);
      d += weight[0] * weight[1] * weight[2] * value;
      ascent[0] += slope[0] * weight[1] * weight[2] * value;
      ascent[1] += weight[0] * slope[1] * weight[2] * value;
      ascent[2] += weight[0] * weight[1] * slope[2] * value;
    }
    double const length = norm(ascent);
    // Less than that is the round-off of equal numbers.
    if (length > 1e-5 * band) normal = (1 / length) * ascent;
    return d;
  }
};

/// A boundary at one moment, as kernels see it.
struct Boundary {
  BoundaryShape shape = BoundaryShape::half_space;
  BoundaryContact contact = BoundaryContact::sticky;
  bool outside = false;     ///< solid outside of the shape: a container
  double friction = 0;      ///< Coulomb's, for what slips
  Vec3<double> size{};      ///< m; see BoundarySpec
  RigidPose pose;           ///< the shape's own frame to the world
  Vec3<double> velocity{};  ///< of the pose's origin, m/s
  Vec3<double> spin{};      ///< about that origin, rad/s
  FieldView field = {};

  /// Distance to the surface, m, negative in the solid; and the normal that leads out of it.
  KOKKOS_FUNCTION double distance(Vec3<double> const& x, Vec3<double>& normal) const {
    Vec3<double> const y = transpose_times(pose.rotation, x - pose.translation);
    Vec3<double> n{0, 1, 0};
    double d = y[1];
    if (shape == BoundaryShape::box) {
      d = from_box(y, n);
    } else if (shape == BoundaryShape::ball) {
      d = away(y, n) - size[0];
    } else if (shape == BoundaryShape::cylinder) {
      d = from_cylinder(y, n);
    } else if (shape == BoundaryShape::torus) {
      Vec3<double> to_ring{y[0], 0, y[2]};
      double const r = norm(to_ring);
      to_ring = r > 0 ? (size[0] / r) * to_ring : Vec3<double>{size[0], 0, 0};
      d = away(y - to_ring, n) - size[1];
    } else if (shape == BoundaryShape::field) {
      d = field.distance(y, n);
    }
    double const sign = outside ? -1 : 1;
    normal = pose.rotation * (sign * n);
    // Whether a node on a wall is held must not depend on how the wall was turned into its place.
    double const round_off = 1e-14 * (norm(x) + norm(pose.translation));
    return Kokkos::abs(d) <= round_off ? 0 : sign * d;
  }
  KOKKOS_FUNCTION bool holds(Vec3<double> const& x) const {
    Vec3<double> normal;
    return distance(x, normal) <= 0;
  }
  KOKKOS_FUNCTION Vec3<double> velocity_at(Vec3<double> const& x) const {
    return velocity + cross(spin, x - pose.translation);
  }

private:
  /// |y|, and its direction.
  KOKKOS_FUNCTION static double away(Vec3<double> const& y, Vec3<double>& n) {
    double const r = norm(y);
    n = r > 0 ? (1 / r) * y : Vec3<double>{0, 1, 0};
    return r;
  }
  KOKKOS_FUNCTION double from_box(Vec3<double> const& y, Vec3<double>& n) const {
    Vec3<double> beyond{};
    int deepest = 0;
    double inner = -Kokkos::Experimental::infinity_v<double>;
    for (int c = 0; c < 3; ++c) {
      double const d = Kokkos::abs(y[c]) - 0.5 * size[c];
      if (d > inner) deepest = c;
      inner = Kokkos::max(inner, d);
      if (d > 0) beyond[c] = y[c] < 0 ? -d : d;
    }
    if (inner > 0) return away(beyond, n);
    n = Vec3<double>{};
    n[deepest] = y[deepest] < 0 ? -1 : 1;
    return inner;
  }
  KOKKOS_FUNCTION double from_cylinder(Vec3<double> const& y, Vec3<double>& n) const {
    Vec3<double> radial{y[0], 0, y[2]};
    double const r = norm(radial);
    radial = r > 0 ? (1 / r) * radial : Vec3<double>{1, 0, 0};
    Vec3<double> const axial{0, y[1] < 0 ? -1.0 : 1.0, 0};
    double const side = r - size[0], cap = Kokkos::abs(y[1]) - 0.5 * size[1];
    if (side > 0 && cap > 0) return away(side * radial + cap * axial, n);
    n = side > cap ? radial : axial;
    return Kokkos::max(side, cap);
  }
};

/// Where a boundary is and how it moves at a moment.
struct BoundaryMotion {
  RigidPose pose;
  Vec3<double> velocity{};  ///< of the pose's origin, m/s
  Vec3<double> spin{};      ///< rad/s
};

/// The most that a boundary moves at.
struct BoundarySpeed {
  double linear = 0;   ///< of the pose's origin, m/s
  double angular = 0;  ///< rad/s
};

/// A boundary as a scene has it. Sizes, in the shape's own frame:
///
///   half_space   solid below y = 0                    box        lengths along x, y, z
///   ball         radius                               cylinder   radius, height (axis y)
///   torus        radius of the ring (axis y), of its section
///   field        none: the field has them
struct BoundarySpec {
  std::string name = {};
  BoundaryShape shape = BoundaryShape::half_space;
  BoundaryContact contact = BoundaryContact::sticky;
  bool outside = false;
  double friction = 0;
  Vec3<double> size{};
  /// As a function of time, s; empty: at rest at the origin.
  std::function<BoundaryMotion(double)> motion = {};
  std::shared_ptr<DistanceField const> field = {};
};

/// A motion that never changes.
inline std::function<BoundaryMotion(double)> at_rest(RigidPose const& pose) {
  return [pose](double) { return BoundaryMotion{pose, {}, {}}; };
}

template <class S>
class BoundaryList {
public:
  BoundaryList() = default;
  /// Throws Error for a size or a friction that cannot be.
  explicit BoundaryList(std::vector<BoundarySpec> specs) : specs_(std::move(specs)) {
    constexpr int numbers[] = {0, 3, 1, 2, 2, 0};
    for (BoundarySpec const& spec : specs_) {
      for (int k = 0; k < numbers[static_cast<int>(spec.shape)]; ++k) {
        if (!(spec.size[k] > 0) || !std::isfinite(spec.size[k])) {
          throw Error("boundary \"{}\": a size of {} m; give one above 0", spec.name, spec.size[k]);
        }
      }
      if (!(spec.friction >= 0) || !std::isfinite(spec.friction)) {
        throw Error("boundary \"{}\": friction = {}; give 0 or more", spec.name, spec.friction);
      }
      if ((spec.shape == BoundaryShape::field) != bool(spec.field)) {
        throw Error("boundary \"{}\": a field of distances and its shape go together", spec.name);
      }
      fields_.push_back(spec.field ? upload(*spec.field) : Values());
    }
    list_ = View("boundaries", specs_.size());
    host_ = Kokkos::create_mirror_view(list_);
    set_time(0);
  }

  /// Where all of them are at a time, s. Throws Error for a pose that is none.
  void set_time(double time) {
    for (std::size_t k = 0; k < specs_.size(); ++k) {
      BoundarySpec const& spec = specs_[k];
      BoundaryMotion const at = spec.motion ? spec.motion(time) : BoundaryMotion{};
      if (!(distortion(at.pose.rotation) < 1e-6) ||
          !std::isfinite(norm(at.pose.translation) + norm(at.velocity) + norm(at.spin))) {
        throw Error("boundary \"{}\": at {} s it is nowhere, or its rotation is none", spec.name,
                    time);
      }
      host_(k) = {spec.shape, spec.contact, spec.outside, spec.friction,
                  spec.size,  at.pose,      at.velocity,  at.spin};
      if (spec.field) host_(k).field = view_of(*spec.field, fields_[k]);
    }
    assign_on<S>(list_, host_);
    S::instance().fence("taut: boundaries");
  }

  int count() const { return static_cast<int>(specs_.size()); }
  Kokkos::View<Boundary const*, typename S::memory> list() const { return list_; }
  std::vector<BoundarySpec> const& specs() const { return specs_; }
  /// Of boundary k in the h seconds after `time`, of eight moments: what moves for less than an
  /// eighth of them may be missed.
  BoundarySpeed fastest(int k, double time, double h) const {
    constexpr int moments = 8;
    BoundarySpeed most;
    auto const& motion = specs_[static_cast<std::size_t>(k)].motion;
    for (int m = 1; motion && m <= moments; ++m) {
      BoundaryMotion const at = motion(time + h * m / moments);
      most.linear = std::max(most.linear, norm(at.velocity));
      most.angular = std::max(most.angular, norm(at.spin));
    }
    return most;
  }

private:
  using View = Kokkos::View<Boundary*, typename S::memory>;
  using Values = Kokkos::View<float*, typename S::memory>;

  static Values upload(DistanceField const& field) {
    Values values("boundary_field", field.values.size());
    Kokkos::View<float const*, Kokkos::HostSpace> const host(field.values.data(),
                                                             field.values.size());
    assign(values, host);
    return values;
  }
  static FieldView view_of(DistanceField const& field, Values const& values) {
    return {values.data(),
            {field.n[0], field.n[1], field.n[2]},
            field.spacing,
            field.band,
            field.lowest};
  }

  std::vector<BoundarySpec> specs_;
  std::vector<Values> fields_;  ///< per boundary, empty without one
  View list_;
  typename View::HostMirror host_;
};

}  // namespace taut
