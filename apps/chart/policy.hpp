// A policy of contact as the user of a stability chart names it: other keys of a scene.
#pragma once

#include <taut/apps/program/scene.hpp>

#include <string>
#include <vector>

namespace taut {

struct ChartPolicy {
  std::string label;                   ///< "bound = closing"
  std::vector<std::string> overrides;  ///< of the scene: "contact.bound=closing"
};

/// Every other choice of bound, barrier, mollifier, curvature and stiffness that the program knows,
/// one at a time, and those of the PNCG paper together; the solver stays as it is. What has units
/// is from the scene's stiffest material.
std::vector<ChartPolicy> default_policies(Scene const& scene);

/// Reads KEY=VALUE[:KEY=VALUE...], where a KEY without a table is one of [contact]; "default" is
/// the scene as it is, "paper" the last of `default_policies`. Throws Error; values are checked
/// where the scene is loaded.
ChartPolicy parse_policy(std::string const& text, Scene const& scene);

/// All of them; empty or "all" stands for `default_policies`. Throws Error for one named twice.
std::vector<ChartPolicy> parse_policies(std::vector<std::string> const& texts, Scene const& scene);

}  // namespace taut
