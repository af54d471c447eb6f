// How often a closed surface goes around a point, decided exactly: 1 inside of an ordinary body, 0
// outside, 2 where a body overlaps itself, negative where it is turned inside out.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <span>

namespace taut {

/// Whether every side of a triangle is as often walked one way as the other. The boundary of a tet
/// mesh always is closed.
bool is_closed(std::span<Triangle const> surface);

/// The winding number around q of the surface with vertices x, which must be closed and finite.
/// Around a point of the surface itself it has no meaning.
int winding_number(std::span<Point const> x, std::span<Triangle const> surface, Point const& q);

}  // namespace taut
