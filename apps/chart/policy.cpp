#include <taut/apps/chart/policy.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>

namespace taut {
namespace {

/// The paper gives every pair a stiffness kappa, of a mass, by hand. For its twisted mat
/// b''(dhat/2) kappa / h^2 = 6.39 * 4.1 E l with l the mean edge of the surface; in terms of a
/// pressure over a quarter of a vertex's share of the surface, 0.77 l^2, and of dhat = 0.3 l, that
/// is 4 * 26.2 E l * 0.3 l / (0.77 l^2) = 41 E.
constexpr double paper_pressure_over_young = 41;

ChartPolicy paper(double young) {
  return {"all of the PNCG paper",
          {"contact.bound=half_dhat", "contact.curvature=truncated", "contact.mollifier=false",
           "contact.stiffness=given",
           fmt::format("contact.pressure={:g}", paper_pressure_over_young * young)}};
}

double stiffest(Scene const& scene) {
  double young = 0;
  for (SceneObject const& object : scene.objects) young = std::max(young, object.material.young);
  return young;
}

}  // namespace

ChartPolicy parse_policy(std::string const& text, Scene const& scene) {
  if (text == "default") return {"default", {}};
  if (text == "paper") return paper(stiffest(scene));
  ChartPolicy policy;
  for (std::size_t end = 0; end <= text.size(); ++end) {
    std::size_t const begin = end;
    end = std::min(text.find(':', begin), text.size());
    std::string const assignment = text.substr(begin, end - begin);
    std::size_t const equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size()) {
      throw Error(
          "--policies {}: \"{}\" is not KEY=VALUE: write it like bound=closing, or default or "
          "paper",
          text, assignment);
    }
    std::string const key = assignment.substr(0, equals), value = assignment.substr(equals + 1);
    policy.label += fmt::format("{}{} = {}", policy.label.empty() ? "" : "; ", key, value);
    bool const has_table = key.find('.') != std::string::npos;
    policy.overrides.push_back(fmt::format("{}{}={}", has_table ? "" : "contact.", key, value));
  }
  return policy;
}

std::vector<ChartPolicy> default_policies(Scene const& scene) {
  std::vector<ChartPolicy> policies;
  std::string const pressure = fmt::format("{:g}", stiffest(scene));
  for (std::string const& text :
       {std::string("default"), std::string("bound=closing"), std::string("bound=half_dhat"),
        std::string("barrier=ipc"), std::string("barrier=log_squared"),
        std::string("barrier=cubic"), std::string("mollifier=false"),
        std::string("curvature=truncated"), std::string("curvature=exact"),
        std::string("stiffness=ipc_adaptive"), "stiffness=given:pressure=" + pressure,
        std::string("paper")}) {
    policies.push_back(parse_policy(text, scene));
  }
  return policies;
}

std::vector<ChartPolicy> parse_policies(std::vector<std::string> const& texts, Scene const& scene) {
  if (texts.empty() || (texts.size() == 1 && texts[0] == "all")) return default_policies(scene);
  std::vector<ChartPolicy> policies;
  for (std::string const& text : texts) {
    policies.push_back(parse_policy(text, scene));
    for (std::size_t i = 0; i + 1 < policies.size(); ++i) {
      if (policies[i].label == policies.back().label)
        throw Error("--policies: {} is named twice: drop one", text);
    }
  }
  return policies;
}

}  // namespace taut
