// Friction: a swept term of the potential,
//
//   V(x) = Sum over contacts mu lambda e f(|u| / e),   e = eps_v h,
//
//   u = (1 - n n') (Sum_a c_a (x_a - x_a^t) - motion),
//
// Coulomb's law, smoothed (friction_law.hpp), of contacts that are lagged: the coefficients c, the
// normals n and the normal forces lambda are those at the positions that it was last told of,
// x^t when a step begins (Li et al. 2020, "Incremental Potential Contact", section 5). So friction
// follows the normal force by one step: what lands is held up by friction in the step after, by the
// same impulse. `relag` takes the contacts at other positions, for a second minimisation of the
// same step (Lagging, integrators/time_stepper.hpp).
//
// Contacts come from sources, which are asked in the order in which they were added:
//
//   Friction<> friction(unknowns, rest, {});
//   friction.add(contact, 0.5);                                        // mu of all pairs
//   friction.add(obstacle, FrictionCoefficients(0.3).set(2, 0, 0));    // and of objects 2 and 0
//
// In a potential it goes after its sources: these must know of the step before they are asked.
//
// A pair of meshes exerts no net force, but the moment of its tangential force over its gap.
#pragma once

#include <taut/contact/contact_islands.hpp>
#include <taut/contact/friction_coefficients.hpp>
#include <taut/contact/friction_kernels.hpp>
#include <taut/core/exec/copy.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

namespace taut {

/// Who knows contacts: appends those at x that have friction (LaggedContacts::append), and none of
/// coefficient zero. `mu` gives the coefficient of two objects.
template <class Source, class Precision, class S>
concept FrictionSource = requires(Source const& source,
                                  VectorField<typename Precision::position, S> const& x,
                                  kernels::FrictionMatrix<S> const& mu,
                                  LaggedContacts<Precision, S>& to) {
  {source.lag(x, mu, to)};
};

/// 1e-3 of the diagonal of the box around `points`, per second, m/s.
inline double default_stick_speed(std::span<Point const> points) {
  double square = 0;
  for (int c = 0; c < 3 && !points.empty(); ++c) {
    double low = points[0][c], high = low;
    for (Point const& x : points) low = std::min(low, x[c]), high = std::max(high, x[c]);
    square += (high - low) * (high - low);
  }
  return 1e-3 * std::sqrt(square);
}

/// What friction amounts to in the step so far.
struct FrictionReport {
  int contacts = 0;  ///< that friction acts in
  int sliding = 0;   ///< of these, those that slip faster than eps_v
  double work = 0;   ///< force times slip: the heat of this step, J
  double limit = 0;  ///< sum of mu lambda, N
};

template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class Friction {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using Fixed = FixedMask<Space>;
  using Contacts = LaggedContacts<Precision, Space>;

  struct Params {
    /// eps_v, m/s: what is slower sticks and creeps. Else default_stick_speed of all vertices at
    /// rest: where some are of obstacles, give that of the bodies. (In BDF2 the step counts as 2/3
    /// h: what sticks is slower by as much.)
    std::optional<double> stick_speed = {};
  };

  /// `rest`: where the vertices are at rest, m. Copies share everything: they are one friction.
  /// Throws Error where something does not fit or has no size.
  Friction(Unknowns<Precision, Space> const& unknowns, std::vector<Point> const& rest,
           Params const& params = {})
      : state_(std::make_shared<State>(unknowns, rest, params)) {}

  /// Contacts of `source` have friction from the next step on. It is copied: copies of a term share
  /// their state.
  template <FrictionSource<Precision, Space> Source>
  void add(Source const& source, FrictionCoefficients const& mu) {
    state_->sources.push_back([source, matrix = mu.template in_space<Space>()](
                                  Positions const& x, Contacts& to) { source.lag(x, matrix, to); });
  }

  double value(Positions const& x, double scale) const {
    if (count() == 0) return 0;
    return scale * sum("friction_value", kernels::FrictionValue<Precision, Space>{slips(), x});
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    if (count() == 0) return 0;
    using Kernel = kernels::FrictionChange<Precision, Space>;
    return scale * sum("friction_change", Kernel{slips(), x, p, alpha});
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    if (count() == 0) return 0;
    return scale * sum("friction_form", kernels::FrictionForm<Precision, Space>{slips(), x, p});
  }

  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g) const {
    gradient<0>(x, scale, fixed, g, g);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Vectors const& diagonal) const {
    gradient<3>(x, scale, fixed, g, diagonal);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Blocks const& blocks) const {
    gradient<6>(x, scale, fixed, g, blocks);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g) const {
    return gradient_after<0>(x, p, alpha, scale, fixed, g, g);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Vectors const& diagonal) const {
    return gradient_after<3>(x, p, alpha, scale, fixed, g, diagonal);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Blocks const& blocks) const {
    return gradient_after<6>(x, p, alpha, scale, fixed, g, blocks);
  }

  void add_product(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                   Vectors const& hp) const {
    if (count() == 0) return;
    using Kernel = kernels::FrictionProduct<Precision, Space>;
    auto const slots = state_->slots(false);
    for_each<Space>("friction_product", count(), Kernel{slips(), x, p, fixed, slots});
    gather<0>(slots, scale, fixed, hp, hp);
  }

  /// Throws Error, before it writes anything, if the matrix was made for other contacts and lacks a
  /// block of one of these.
  void add_to(Matrix const& matrix, Positions const& x, double scale, Fixed const& fixed) const {
    if (count() == 0) return;
    using Missing = kernels::FindMissingFriction<Precision, Space>;
    if (minimum<Space>("friction_pattern", count(), count(),
                       Missing{lagged().table(), fixed, matrix}) < count()) {
      throw Error(
          "friction: the matrix has no block for vertices in contact: its pattern is of another "
          "step; make the pattern anew");
    }
    auto const slots = state_->slots(true);
    using Kernel = kernels::FrictionGradient<Precision, Space, true>;
    for_each<Space>("friction_curvature", count(), Kernel{{slips(), x, {}, 0, slots}});
    auto const vertices = lagged().active_vertices();
    for_each<Space>("friction_assemble", vertices.extent_int(0),
                    kernels::AssembleFriction<Precision, Space>{
                        vertices, lagged().slots(), lagged().table(), slots, fixed, matrix, scale});
  }
  /// The contacts, in memory that lasts until they are asked for again.
  void elements(std::vector<Connectivity>& kinds) const {
    kinds.push_back({state_->lagged.elements(), 4});
  }
  /// Grows whenever contacts are lagged.
  std::int64_t pattern_version(Positions const&) const { return state_->version; }

  void add_form_shares(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                       Array<double, Space> const& shares) const {
    if (count() == 0) return;
    using Kernel = kernels::FrictionShares<Precision, Space>;
    auto const vertices = lagged().active_vertices();
    for_each<Space>("friction_shares", vertices.extent_int(0),
                    Kernel{vertices, lagged().slots(), {slips(), x, p}, fixed, scale, shares});
  }
  /// Joins the bodies of each contact.
  bool link(Fixed const& fixed, typename Bodies<Space>::Indices const& body,
            typename Bodies<Space>::Indices const& label) const {
    using Kernel = kernels::LinkFriction<Precision, Space>;
    return maximum<Space>("friction_link", count(), 0,
                          Kernel{lagged().table(), fixed, body, label}) > 0;
  }

  /// Friction forbids nothing.
  double max_step(Positions const&, Vectors const&, double at_most) const { return at_most; }
  double max_prescribed_step(Positions const&, Vectors const&, double at_most) const {
    return at_most;
  }

  /// Slip is measured from where the step starts, and contacts are those there.
  void begin_step(StepStart<Precision, Space> const& start) const {
    double const length = state_->stick_speed * start.time_step;
    if (!(length > 0 && std::isfinite(length))) {
      throw Error("friction: a step of {} s: give a positive time step", start.time_step);
    }
    assign_on<Space>(state_->from, start.x);
    state_->length = length;
    state_->lag(start.x);
  }
  /// Takes the contacts at x instead, within the step; false if there were none and are none, so
  /// that nothing has changed.
  bool relag(Positions const& x) const {
    int const before = count();
    state_->lag(x);
    return before > 0 || count() > 0;
  }

  double stick_speed() const { return state_->stick_speed; }
  Contacts const& lagged() const { return state_->lagged; }
  FrictionReport report(Positions const& x) const {
    if (count() == 0) return {};
    using Kernel = kernels::FrictionTotals<Precision, Space>;
    auto const s = state_->reducer.template sum<3>("friction_report", count(), Kernel{slips(), x});
    return {count(), static_cast<int>(s[0]), s[1], s[2]};
  }

private:
  using Slots = kernels::FrictionSlots<Precision, Space>;

  struct State {
    double stick_speed, length = 1;
    std::vector<std::function<void(Positions const&, Contacts&)>> sources;
    Positions from;
    Contacts lagged;
    Vectors force;
    Blocks block;
    Reducer<Space, double> reducer;
    std::int64_t version = 0;

    State(Unknowns<Precision, Space> const& unknowns, std::vector<Point> const& rest,
          Params const& params)
        : stick_speed(params.stick_speed ? *params.stick_speed : default_stick_speed(rest)),
          from("friction_from", unknowns.size()),
          lagged(unknowns.size()) {
      if (rest.size() != std::size_t(unknowns.size())) {
        throw Error("friction: {} positions at rest, but {} unknowns: give as many of each",
                    rest.size(), unknowns.size());
      }
      if (!(stick_speed > 0 && std::isfinite(stick_speed))) {
        throw Error(
            "friction: contacts that stick may creep at {} m/s: give a positive speed, or vertices "
            "that are not all in one place",
            stick_speed);
      }
    }

    void lag(Positions const& x) {
      ++version;
      lagged.clear();
      for (auto const& source : sources) source(x, lagged);
      lagged.finish();
      if (force.extent_int(0) >= lagged.count()) return;
      std::size_t const n = lagged.table().limit.extent(0);
      force = {}, block = {};  // the old memory first
      force = Vectors(Kokkos::view_alloc(Kokkos::WithoutInitializing, "friction_force"), n);
      reducer = Reducer<Space, double>(static_cast<int>(n), 3);
    }
    /// Blocks are made when they are first asked for.
    Slots slots(bool curvature) {
      if (curvature && block.extent(0) < force.extent(0)) {
        block = Blocks(Kokkos::view_alloc(Kokkos::WithoutInitializing, "friction_block"),
                       force.extent(0));
      }
      return {lagged.table().c, force, block};
    }
  };

  int count() const { return state_->lagged.count(); }
  kernels::SlipTable<Precision, Space> slips() const {
    return {state_->lagged.table(), state_->from, state_->length};
  }
  template <class Kernel>
  double sum(char const* name, Kernel const& kernel) const {
    return state_->reducer.template sum<1>(name, count(), kernel)[0];
  }

  template <int numbers, class CurvatureField>
  void gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                CurvatureField const& c) const {
    if (count() == 0) return;
    using Kernel = kernels::FrictionGradient<Precision, Space, (numbers > 0)>;
    auto const slots = state_->slots(numbers > 0);
    for_each<Space>("friction_gradient", count(), Kernel{{slips(), x, {}, 0, slots}});
    gather<numbers>(slots, scale, fixed, g, c);
  }
  template <int numbers, class CurvatureField>
  double gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                        Fixed const& fixed, Vectors const& g, CurvatureField const& c) const {
    if (count() == 0) return 0;
    using Kernel = kernels::FrictionGradientAfter<Precision, Space, (numbers > 0)>;
    auto const slots = state_->slots(numbers > 0);
    double const change = sum("friction_gradient_after", Kernel{{slips(), x, p, alpha, slots}});
    gather<numbers>(slots, scale, fixed, g, c);
    return scale * change;
  }
  template <int numbers, class CurvatureField>
  void gather(Slots const& slots, double scale, Fixed const& fixed, Vectors const& g,
              CurvatureField const& c) const {
    using Gather = kernels::GatherSlots<Precision, Space, Slots, CurvatureField, numbers>;
    auto const vertices = state_->lagged.active_vertices();
    for_each<Space>("friction_gather", vertices.extent_int(0),
                    Gather{vertices, state_->lagged.slots(), slots, fixed, scale, g, c});
  }

  std::shared_ptr<State> state_;
};

}  // namespace taut
