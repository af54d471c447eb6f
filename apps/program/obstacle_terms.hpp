// The obstacles of a scene that are formulas: a term each.
#pragma once

#include <taut/apps/program/contact_terms.hpp>
#include <taut/apps/program/scene.hpp>

#include <memory>

namespace taut {

/// An obstacle term as the program looks at it, whatever its shape.
template <class P>
class ProgramObstacle {
public:
  virtual ~ProgramObstacle() = default;
  /// Where it is to be at the end of the next step: a point of its own frame goes to pose(point).
  virtual void move_to(RigidMap const& pose) const = 0;
  /// Puts it there, at rest, whatever is in the way.
  virtual void place(RigidMap const& pose) const = 0;
  virtual RigidMap pose() const = 0;
  virtual ContactReport report(VectorField<typename P::position, DefaultSpace> const& x) const = 0;
  /// As ProgramContact::activation, per vertex of the surface.
  virtual Array<double, DefaultSpace> activation() const = 0;
  virtual void set_activation(Array<double, DefaultSpace> const& activation) const = 0;
  /// Bodies rub on it with this coefficient.
  virtual void add_to(Friction<P>& friction, double mu) const = 0;
  /// How far a point is inside, m: not above 0 if it is not.
  virtual double depth(Point const& x) const = 0;
};

/// Adds the term of an obstacle that is no surface (SceneObstacle::is_surface); `part` is what it
/// keeps in.
template <class P>
std::shared_ptr<ProgramObstacle<P> const> add_obstacle_term(AnySteppedTerms<P>& terms,
                                                            ContactPart<P> const& part,
                                                            ContactOptions const& options,
                                                            SceneObstacle const& obstacle);

}  // namespace taut
