// Limited-memory BFGS (Nocedal 1980) with any preconditioner as initial metric.
//
// The two-loop recursion is carried out on coefficients: with the products s_i'g, s_i'y_j and
// y_i'P q known, both loops are a few operations on the host, and each iteration makes four passes
// over the unknowns for windows up to 8, two more for each 8 pairs beyond.
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/integrators/descent.hpp>

#include <array>

namespace taut {

/// Pairs kept at most.
inline constexpr int max_lbfgs_window = 20;

namespace kernels {

/// The last steps s and changes of the gradient y, one pair per slot.
template <class P, class S>
struct PairHistory {
  using Real = typename P::real;
  using Slots = Kokkos::View<Real** [3], typename S::layout, typename S::memory>;
  /// Slots whose products are summed in one pass: what fits into a thread's registers.
  static constexpr int per_pass = 8;

  Slots s, y;
  int count;  ///< slots 0 .. count - 1 are in use

  KOKKOS_FUNCTION int last_of_pass(int first) const { return Kokkos::min(first + per_pass, count); }
  KOKKOS_FUNCTION static Vec3<Real> at(Slots const& slots, int i, int slot) {
    return {slots(i, slot, 0), slots(i, slot, 1), slots(i, slot, 2)};
  }
};

/// Writes the last step into slot `newest`, and sums s_j'g, s_j'y_newest, s_newest'y_j for the
/// slots of a pass from `first` on, and g' M^-1 g. The newest slot takes part unless it is -1.
template <class P, class S>
struct PairDots {
  static constexpr int count = 3 * PairHistory<P, S>::per_pass + 1;
  PairHistory<P, S> history;
  int first, newest;
  typename P::real length;
  VectorField<typename P::real, S> gradient, gradient_before, p;
  Array<typename P::real, S> mass;

  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Real = typename P::real;
    using Sum = typename P::sum;
    Vec3<Real> s{}, y{};
    if (newest >= 0) {
      s = length * load3<Real>(p, i);
      y = load3<Real>(gradient, i) - load3<Real>(gradient_before, i);
      for (int c = 0; c < 3; ++c) {
        history.s(i, newest, c) = s[c];
        history.y(i, newest, c) = y[c];
      }
    }
    auto const g = load3<Sum>(gradient, i);
    for (int j = first; j < history.last_of_pass(first); ++j) {
      auto const sj = convert<Sum>(history.at(history.s, i, j));
      auto const yj = convert<Sum>(history.at(history.y, i, j));
      int const k = 3 * (j - first);
      sums[k] += dot(sj, g);
      sums[k + 1] += dot(sj, convert<Sum>(y));
      sums[k + 2] += dot(convert<Sum>(s), yj);
    }
    Sum const gg = dot(g, g);
    if (gg > 0) sums[count - 1] += gg / Sum(mass(i));
  }
};

using PairCoefficients = Kokkos::Array<double, max_lbfgs_window>;

/// q = g - sum a_j y_j
template <class P, class S>
struct SubtractChanges {
  PairHistory<P, S> history;
  PairCoefficients a;
  VectorField<typename P::real, S> gradient, q;
  KOKKOS_FUNCTION void operator()(int i) const {
    using Real = typename P::real;
    auto sum = load3<Real>(gradient, i);
    for (int j = 0; j < history.count; ++j) sum = sum - Real(a[j]) * history.at(history.y, i, j);
    store3(q, i, sum);
  }
};

/// y_j'r for the slots of a pass.
template <class P, class S>
struct ChangeDots {
  static constexpr int count = PairHistory<P, S>::per_pass;
  PairHistory<P, S> history;
  int first;
  VectorField<typename P::real, S> r;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, count>& sums) const {
    using Sum = typename P::sum;
    auto const ri = load3<Sum>(r, i);
    for (int j = first; j < history.last_of_pass(first); ++j)
      sums[j - first] += dot(convert<Sum>(history.at(history.y, i, j)), ri);
  }
};

/// p = -(r + sum c_j s_j), where p holds r before; sums g'p and p'M p.
template <class P, class S>
struct AddSteps {
  PairHistory<P, S> history;
  PairCoefficients c;
  VectorField<typename P::real, S> gradient, p;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 2>& sums) const {
    using Real = typename P::real;
    using Sum = typename P::sum;
    auto sum = load3<Real>(p, i);
    for (int j = 0; j < history.count; ++j) sum = sum + Real(c[j]) * history.at(history.s, i, j);
    store3(p, i, -sum);
    auto const wide = convert<Sum>(-sum);
    sums[0] += dot(load3<Sum>(gradient, i), wide);
    sums[1] += Sum(mass(i)) * dot(wide, wide);
  }
};

}  // namespace kernels

struct LbfgsParams {
  int window = 5;  ///< pairs kept, 1 to max_lbfgs_window
  /// Try the step of the quadratic model first; off: the unit step, which needs no p'Hp but suits
  /// only a P that is close to H^-1 in size, too.
  bool newton_step = true;
  /// The same after a step that had to be shortened: p'Hp costs less than trying another one. Both
  /// off: unit steps alone (HOT).
  bool newton_after_backtracks = true;
  /// Without pairs, too, the first step tried is that of the quadratic model; off: the unit step.
  bool newton_first_step = true;
  /// Pairs are of the metric that they were made with: with a new one they are forgotten (HOT's
  /// option --adaptiveH). Off, they are kept, which costs fewer iterations.
  bool forget_when_renewed = false;
  double least_curvature = 1e-8;  ///< pairs are kept if s'y exceeds this times |s'g|
};

/// The directions of L-BFGS.
template <class P, class S>
class LbfgsDirections {
public:
  using Precision = P;
  using Space = S;

  template <class Params>
  explicit LbfgsDirections(Params const& params) : params_(params.lbfgs) {
    if (params_.window < 1 || params_.window > max_lbfgs_window)
      throw Error("lbfgs: window = {} is out of range; choose 1 to {}", params_.window,
                  max_lbfgs_window);
  }

  void resize(int n, bool) {
    history_.s = s_memory_.resize("lbfgs_s", n, params_.window);
    history_.y = y_memory_.resize("lbfgs_y", n, params_.window);
    reducer_.provide(n, Dots::count);
  }

  void start() { restart(); }
  void restart() {
    history_.count = pairs_ = 0;
    newest_ = -1;
    restarted_ = true;
  }

  template <class E, class M>
  Heading next(E&, VectorField<typename P::position, S> const&, DescentFields<P, S>& fields,
               M const& preconditioner, Step const& last, bool renewed) {
    if (renewed && params_.forget_when_renewed) restart();
    Heading heading;
    int const slot = restarted_ ? -1 : (newest_ + 1) % params_.window;
    history_.count = std::max(history_.count, slot + 1);
    PairCoefficients s_g{}, s_y{}, y_s{}, y_r{};
    for (int first = 0; first == 0 || first < history_.count; first += History::per_pass) {
      auto const dots = reducer_.template sum<Dots::count>(
          "pair_dots", fields.size(),
          Dots{history_, first, slot, typename P::real(last.length), fields.gradient,
               fields.gradient_before, fields.direction, fields.mass});
      heading.gradient = double(dots[Dots::count - 1]);
      for (int j = first; j < history_.last_of_pass(first); ++j) {
        int const k = 3 * (j - first);
        s_g[j] = double(dots[k]);
        s_y[j] = double(dots[k + 1]);
        y_s[j] = double(dots[k + 2]);
      }
    }
    if (slot >= 0) heading.skipped = !keep(slot, s_y, y_s, std::abs(last.length * slope_));
    restarted_ = false;

    PairCoefficients a{}, c{};
    for (int k = 0; k < pairs_; ++k) {
      int const i = slot_of_age(k);
      a[i] = s_g[i];
      for (int l = 0; l < k; ++l) a[i] -= a[slot_of_age(l)] * s_y_[i][slot_of_age(l)];
      a[i] /= s_y_[i][i];
    }
    auto const& q = fields.gradient_before;  // is not needed any more
    for_each<S>("subtract_changes", fields.size(),
                kernels::SubtractChanges<P, S>{history_, a, fields.gradient, q});
    preconditioner.apply(q, fields.direction);
    using ChangeDots = kernels::ChangeDots<P, S>;
    for (int first = 0; first < history_.count; first += History::per_pass) {
      auto const dots = reducer_.template sum<ChangeDots::count>(
          "change_dots", fields.size(), ChangeDots{history_, first, fields.direction});
      for (int j = first; j < history_.last_of_pass(first); ++j) y_r[j] = double(dots[j - first]);
    }
    for (int k = pairs_ - 1; k >= 0; --k) {
      int const i = slot_of_age(k);
      double b = y_r[i];
      for (int l = k + 1; l < pairs_; ++l) b += c[slot_of_age(l)] * s_y_[slot_of_age(l)][i];
      c[i] = a[i] - b / s_y_[i][i];
    }
    auto const sums = reducer_.template sum<2>(
        "add_steps", fields.size(),
        kernels::AddSteps<P, S>{history_, c, fields.gradient, fields.direction, fields.mass});

    heading.slope = slope_ = double(sums[0]);
    heading.descent = std::abs(heading.slope);  // positive definite: any descent will do
    heading.metric = double(sums[1]);
    heading.steepest = pairs_ == 0;
    bool by_model = params_.newton_step || (params_.newton_after_backtracks && last.backtracks > 0);
    if (heading.steepest) by_model = params_.newton_first_step;
    heading.first_length = by_model ? 0 : 1;
    return heading;
  }

private:
  using History = kernels::PairHistory<P, S>;
  using Dots = kernels::PairDots<P, S>;
  using PairCoefficients = kernels::PairCoefficients;

  int slot_of_age(int k) const { return (newest_ - k + params_.window) % params_.window; }

  /// Takes the pair in `slot` into the history if s'y > 0; the pair that was there before is gone.
  bool keep(int slot, PairCoefficients const& s_y, PairCoefficients const& y_s,
            double slope_along_step) {
    if (!(s_y[slot] > params_.least_curvature * slope_along_step)) {
      pairs_ = std::min(pairs_, params_.window - 1);
      return false;
    }
    newest_ = slot;
    pairs_ = std::min(pairs_ + 1, params_.window);
    for (int j = 0; j < history_.count; ++j) {
      s_y_[j][slot] = s_y[j];
      s_y_[slot][j] = y_s[j];
    }
    return true;
  }

  LbfgsParams params_;
  History history_{{}, {}, 0};
  Resizable<typename History::Slots> s_memory_, y_memory_;
  int pairs_ = 0, newest_ = -1;
  bool restarted_ = true;
  double slope_ = 0;
  double s_y_[max_lbfgs_window][max_lbfgs_window] = {};  ///< s_i'y_j
  Reducer<S, typename P::sum> reducer_;
};

template <class Preconditioner, class LineSearch, class Stopping>
struct LbfgsComposition {
  LbfgsParams lbfgs = {};
  typename Preconditioner::Params preconditioner = {};
  typename LineSearch::Params line_search = {};
  typename Stopping::Params stop = {};
  Budget budget = {};
  Safeguard safeguard = {};
};

template <template <class...> class Preconditioner, class LineSearch = SufficientDecrease,
          class Stopping = DecrementWindow, class Precision = Mixed, class Space = DefaultSpace>
using Lbfgs =
    DescentMinimiser<LbfgsDirections<Precision, Space>, Preconditioner<Precision, Space>,
                     LineSearch, Stopping,
                     LbfgsComposition<Preconditioner<Precision, Space>, LineSearch, Stopping>>;

}  // namespace taut
