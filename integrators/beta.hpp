// How much of the last direction the next one keeps:
//   p+ = -P g+ + beta p + gamma P y,   y = g+ - g.
//
// "Printed" below is the supplement of the PNCG paper and its public code; where they differ from
// the literature, the literature's formula is what is implemented, so that a name means what it
// says:
//   FR   printed with g'g (paper) or g'P+ g (code) as denominator; here g'P g (Fletcher, Reeves
//   1964). PRP  printed as g+'P+ y / (-g'p), which is Liu and Storey's formula, and coded without
//   P; here
//        g+'P+ y / g'P g (Polak, Ribiere 1969). `LiuStorey` is the printed one.
//   DK   as printed: the Dai-Kou family (2013) with tau = s'y / s's, in which the tau terms cancel.
//   SSML-BFGS as printed, that is without the scaling that its name announces.
#pragma once

#include <taut/core/report/error.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <string_view>

namespace taut {

/// The scalars of which betas are made. `g`, `P` belong to the iterate where the last step of
/// length `alpha` along `p` began, `g1`, `P1` to the one where it ended, and y = g1 - g.
struct Dots {
  double g1_P1_g1 = 0;
  double g1_P1_y = 0;
  double y_P1_y = 0;
  double g_P1_g = 0;  ///< the last gradient in the new metric
  double g_P_g = 0;   ///< and in its own
  double g1_p = 0;
  double g_p = 0;
  double y_p = 0;
  double p_p = 0;
  double g_g = 0;
  double g1_g1 = 0;
  double alpha = 0;
};

struct Coefficients {
  double beta = 0;
  double gamma = 0;
};

/// One formula for beta (and gamma). Stateless but for its parameters; evaluated on the host.
template <class B>
concept Beta = requires(B const& beta, Dots const& dots) {
  { beta(dots) } -> std::same_as<Coefficients>;
};

/// beta = 0: preconditioned gradient descent, the floor of every comparison.
struct SteepestDescent {
  static constexpr char const* name = "gradient";
  Coefficients operator()(Dots const&) const { return {}; }
};

struct FletcherReeves {
  static constexpr char const* name = "fr";
  Coefficients operator()(Dots const& d) const { return {d.g1_P1_g1 / d.g_P_g}; }
};

struct PolakRibiere {
  static constexpr char const* name = "prp";
  Coefficients operator()(Dots const& d) const { return {d.g1_P1_y / d.g_P_g}; }
};

struct PolakRibierePlus {
  static constexpr char const* name = "prp+";
  Coefficients operator()(Dots const& d) const { return {std::max(0.0, PolakRibiere()(d).beta)}; }
};

struct HestenesStiefel {
  static constexpr char const* name = "hs";
  Coefficients operator()(Dots const& d) const { return {d.g1_P1_y / d.y_p}; }
};

/// Fletcher 1987.
struct ConjugateDescent {
  static constexpr char const* name = "cd";
  Coefficients operator()(Dots const& d) const { return {d.g1_P1_g1 / -d.g_p}; }
};

struct LiuStorey {
  static constexpr char const* name = "ls";
  Coefficients operator()(Dots const& d) const { return {d.g1_P1_y / -d.g_p}; }
};

/// The paper's choice.
struct DaiKou {
  static constexpr char const* name = "dk";
  Coefficients operator()(Dots const& d) const {
    return {(d.g1_P1_y - d.y_P1_y * d.g1_p / d.y_p) / d.y_p};
  }
};

/// DK kept above eta g1'p / p'p. Dai and Kou take eta = 1/2, the paper's code 1/100. The floor
/// carries the unit of a gradient over a displacement, so with P != I it means something else in
/// each scene.
struct DaiKouPlus {
  static constexpr char const* name = "dk+";
  double eta = 0.01;
  Coefficients operator()(Dots const& d) const {
    return {std::max(DaiKou()(d).beta, eta * d.g1_p / d.p_p)};
  }
};

/// Hager and Zhang 2005, truncated as there; the truncation depends on units as that of DK+ does.
struct HagerZhang {
  static constexpr char const* name = "hz";
  double eta = 0.01;
  Coefficients operator()(Dots const& d) const {
    double const beta = (d.g1_P1_y - 2 * d.y_P1_y * d.g1_p / d.y_p) / d.y_p;
    return {std::max(beta, -1 / (std::sqrt(d.p_p) * std::min(eta, std::sqrt(d.g_g))))};
  }
};

/// SSML-BFGS, three terms: the BFGS update of P1 by the last step, applied to -g1.
struct MemorylessBfgs {
  static constexpr char const* name = "bfgs";
  Coefficients operator()(Dots const& d) const {
    double const gamma = d.g1_p / d.y_p;
    return {d.g1_P1_y / d.y_p - (d.alpha + d.y_P1_y / d.y_p) * gamma, gamma};
  }
};

/// Any of the above, chosen by name at run time. Throws `Error` for a name that does not exist.
class AnyBeta {
public:
  AnyBeta() : AnyBeta(DaiKou::name) {}
  explicit AnyBeta(std::string_view name) {
    auto const found =
        std::find_if(rules.begin(), rules.end(), [&](Rule const& r) { return r.name == name; });
    if (found == rules.end()) {
      std::string known;
      for (Rule const& r : rules) known += (known.empty() ? "" : ", ") + std::string(r.name);
      throw Error("beta \"{}\" does not exist; choose one of {}", name, known);
    }
    rule_ = &*found;
  }

  std::string_view name() const { return rule_->name; }
  Coefficients operator()(Dots const& dots) const { return rule_->evaluate(dots); }

private:
  struct Rule {
    std::string_view name;
    Coefficients (*evaluate)(Dots const&);
  };
  template <class B>
  static constexpr Rule rule = {B::name, [](Dots const& dots) { return B()(dots); }};

  static constexpr std::array rules = {
      rule<DaiKou>,           rule<DaiKouPlus>,      rule<FletcherReeves>,   rule<PolakRibiere>,
      rule<PolakRibierePlus>, rule<HestenesStiefel>, rule<ConjugateDescent>, rule<LiuStorey>,
      rule<HagerZhang>,       rule<MemorylessBfgs>,  rule<SteepestDescent>};

  Rule const* rule_;
};

}  // namespace taut
