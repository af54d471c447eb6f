// Bytes and flops that contact cannot do without: the measure that `taut bench contact` compares
// its times with. Counted is what an oracle would do that knew which pairs act: per contact the
// four vertices and three parameters of the pair, once each; per vertex of the surface what a sweep
// reads and writes of x, p, g and the curvature, once each. Candidates that do not act, and proofs
// that there are no others, count as loss, except for searches, whose candidates must be written.
//
// Flops as in counts.hpp. Closest points count as if all were inside a triangle or inside
// both edges (75); those at ends and edges cost more. Two contacts of three are of edges, and have
// a mollifier that does not act (21).
#pragma once

#include <taut/apps/bench/counts.hpp>

namespace taut {

/// What a scene consists of.
struct ContactSizes {
  double vertices, edges, triangles;  ///< of the surface
  double candidates;                  ///< by boxes
  double contacts;
};

/// Of the whole sweep `kernel` (contact.hpp); nothing for what is not counted.
SweepCounts count_contact(std::string_view kernel, std::string_view precision,
                          ContactSizes const& sizes);

}  // namespace taut
