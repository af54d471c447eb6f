// How obstacle terms are made, for the source files that instantiate them.
#pragma once

#include <taut/apps/program/obstacle_terms.hpp>
#include <taut/apps/program/rigid_frames.hpp>
#include <taut/contact/obstacle.hpp>

#include <limits>

namespace taut {

inline RigidMap to_map(RigidPose const& pose) {
  RigidMap map;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) map.rotation[i][j] = pose.rotation(i, j);
    map.translation[i] = pose.translation[i];
  }
  return map;
}

/// The shape that the library knows, in the frame of the obstacle.
struct ToShape {
  template <class Use>
  static auto with(SceneObstacle const& obstacle, Use const& use) {
    if (auto const* half = std::get_if<HalfSpaceShape>(&obstacle.geometry)) {
      return use(HalfSpace{to_vec(half->point), to_vec(half->normal)});
    }
    if (auto const* box = std::get_if<InsideBoxShape>(&obstacle.geometry)) {
      return use(InsideBox{{0, 0, 0}, to_vec(box->size)});
    }
    if (auto const* sphere = std::get_if<InsideSphereShape>(&obstacle.geometry)) {
      return use(InsideBall{{0, 0, 0}, sphere->radius});
    }
    auto const& cylinder = std::get<InsideCylinderShape>(obstacle.geometry);
    return use(InsideCylinder{{0, 0, 0}, {0, 1, 0}, cylinder.radius, cylinder.height, true});
  }
};

template <class P, class Shape>
class ObstacleHandle final : public ProgramObstacle<P> {
public:
  using Term = Obstacle<Shape, AnyBarrier, AnyStiffness, P, DefaultSpace>;

  explicit ObstacleHandle(Term const& term) : term_(term) {}
  void move_to(RigidMap const& pose) const override { term_.move_to(to_pose(pose)); }
  void place(RigidMap const& pose) const override { term_.place(to_pose(pose)); }
  RigidMap pose() const override { return to_map(term_.pose()); }
  ContactReport report(typename Term::Positions const& x) const override {
    ObstacleReport const r = term_.report(x);
    return {.candidates = 0, .contacts = r.contacts, .smallest_gap = r.smallest_gap};
  }
  Array<double, DefaultSpace> activation() const override { return term_.activation(); }
  void set_activation(Array<double, DefaultSpace> const& a) const override {
    term_.set_activation(a);
  }
  void add_to(Friction<P>& friction, double mu) const override { friction.add(term_, mu); }
  double depth(Point const& x) const override {
    auto const faces = taut::place(term_.shape(), term_.pose());
    double least = std::numeric_limits<double>::infinity();
    for (int f = 0; f < faces.count; ++f) {
      least = std::min(least, distance_to(faces.face[f], to_vec(x) - faces.origin).distance);
    }
    return least;
  }

private:
  Term term_;
};

template <class P>
std::shared_ptr<ProgramObstacle<P> const> add_obstacle_term(AnySteppedTerms<P>& terms,
                                                            ContactPart<P> const& part,
                                                            ContactOptions const& options,
                                                            SceneObstacle const& obstacle) {
  return ToShape::with(obstacle, [&]<class Shape>(Shape const& shape) {
    using Term = typename ObstacleHandle<P, Shape>::Term;
    Term const term(part.unknowns, part.surface, part.rest, shape,
                    {.dhat = part.dhat,
                     .start_share = options.number("start_share"),
                     .barrier = AnyBarrier(options),
                     .stiffness = AnyStiffness(options)},
                    to_pose(obstacle.placement));
    terms.add(term);
    return std::shared_ptr<ProgramObstacle<P> const>(
        std::make_shared<ObstacleHandle<P, Shape>>(term));
  });
}

}  // namespace taut
