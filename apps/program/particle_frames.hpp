// Where the shapes of a scene of material points are, as poses.
#pragma once

#include <taut/apps/program/rigid_frames.hpp>
#include <taut/apps/program/scene.hpp>
#include <taut/mpm/boundary.hpp>

namespace taut {

/// Of a solid whose axis is y, to the axis of the shape.
RigidMap frame_of(CylinderShape const& cylinder);
/// From the frame of an analytic shape as kernels have it (BoundarySpec, whose shape and sizes it
/// sets) to that of its owner. Throws Error for one that meshes alone have.
RigidMap set_shape(Shape const& shape, BoundarySpec& spec);

/// Where what is placed at time 0 and follows a motion is at time t, the end of a step, and how
/// fast.
BoundaryMotion motion_at(RigidMotion const& motion, RigidMap const& start, double t);

}  // namespace taut
