// What contact amounts to, for who reports it and does not compute it.
#pragma once

namespace taut {

/// At some positions.
struct ContactReport {
  int candidates = 0;       ///< pairs that were looked at
  int contacts = 0;         ///< of these, pairs that act
  double smallest_gap = 1;  ///< least distance over activation distance (dhat between bodies)
};

}  // namespace taut
