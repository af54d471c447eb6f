// Boundaries along which nodes slide: a term that holds them across and lets them go along,
//
//   V(x) = Sum_i Sum_k  -f_ik (n_ik . d_ik) + 1/2 s_i (n_ik . d_ik)^2,
//   d_ik = x_i - (X_i + h v_k(X_i)),
//
// over the boundaries k that hold node i, with n_ik the normal that leads out of the solid. Any
// number of normals may meet at a node: their constraints hold together, in corners too, without a
// basis in which they would be orthogonal. s_i is `steepness` times what else resists a motion of
// the node, and f_ik is the force that it would take for the node to go with the boundary if what
// is elastic stayed as it was at the start (an augmented Lagrangian, Hestenes 1969): a body at rest
// does not sink at all, and an impact gives way by the share 1 / steepness of the motion that it
// takes, whatever the material and the step. A block preconditioner takes all of V.
//
// Where contact may separate, a node is held, both ways, or free, for a whole minimisation, so that
// each is as smooth as one of a body that slips. Held is first what has a positive f; then what
// pulls is let go and what has entered the solid is held, and the step is minimised again (Lagging
// passes), until that changes nothing: the primal-dual active set method (Hintermueller, Ito,
// Kunisch 2003), with f the force where the last minimisation ended. A one-sided V, in comparison,
// has a kink in its slope at which quasi-Newton methods and line searches get stuck (measured: 398
// iterations where 12 do).
//
// Friction is Coulomb's, smoothed: along the boundary
//
//   D(x) = Sum mu f_ik g(|u_ik|),     u = (I - n n^T) d,   g' = y/e (2 - y/e) for y < e, then 1
//
// with e = stick_speed h (Li et al. 2020, section 5, for its smoothing), and with f that of the
// last minimisation.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/scan.hpp>
#include <taut/core/potential/unknowns.hpp>
#include <taut/mpm/slip_kernels.hpp>

namespace taut {

struct SlipParams {
  double steepness = 1e3;     ///< over what else resists; 10 to 1e4
  double stick_speed = 1e-3;  ///< m/s, below which friction sticks
  /// What is held or free by mistake is left so if that costs less energy than all of the mass over
  /// this length, in cells, in a step.
  double settled = 3e-4;
  double friction_change = 1e-2;  ///< of all friction forces, rms, that is left as it is
};

/// The boundaries that do not stick, as a term of the potential of a grid. ParticleStepper tells it
/// (`hold`) what is where. Where there is friction or separation, give the time stepper passes
/// (Lagging): it takes those that something changes in, rarely more than three.
template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class Slip {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;

  /// Throws Error for a steepness or a speed that cannot be.
  explicit Slip(SlipParams const& params = {}) : params_(params) {
    if (!(params.steepness >= 10 && params.steepness <= 1e4) || !(params.stick_speed > 0)) {
      throw Error("slip: steepness = {}, stick_speed = {} m/s; give 10 to 1e4, and a speed above 0",
                  params.steepness, params.stick_speed);
    }
  }

  /// A step of h seconds begins, with nodes at `rest` and the boundaries where they will be.
  void hold(Positions const& rest, Unknowns<Precision, Space> const& unknowns,
            BoundaryList<Space> const& boundaries, double h) {
    nodes_ = static_cast<int>(rest.extent(0));
    unknowns_ = unknowns;
    boundaries_ = boundaries.list();
    using Count = kernels::CountSlip<Space, Positions>;
    Count const count{boundaries_, boundaries.count(), rest};
    grow(views_.begin, "slip_begin", nodes_ + 1);
    int const pairs = exclusive_scan<Space, int>("count_slip", nodes_, count, views_.begin);
    assign_on<Space>(Kokkos::subview(views_.begin, Kokkos::make_pair(nodes_, nodes_ + 1)), pairs);
    grow(views_.pair, "slip_pairs", pairs);
    grow(views_.stiffness, "slip_stiffness", nodes_);
    views_.stick = params_.stick_speed * h;
    views_.friction = views_.separates = false;
    for (BoundarySpec const& spec : boundaries.specs()) {
      views_.friction |= spec.friction > 0;
      views_.separates |= spec.contact == BoundaryContact::separate;
    }
    for_each<Space>("list_slip", nodes_, kernels::ListSlip<Space, Positions>{count, h, views_});
    reducer_.provide(nodes_, 3);
  }
  void begin_step(StepStart<Precision, Space> const& start) const {
    for_each<Space>("begin_slip", nodes_,
                    kernels::BeginSlip<Space, Precision>{views_, boundaries_, start, unknowns_.mass,
                                                         params_.steepness});
    double const error = params_.settled * unknowns_.length / start.time_step;
    negligible_ = 0.5 * start.free_mass * error * error;
  }
  bool relag(Positions const& x) const {
    if (!views_.friction && !views_.separates) return false;
    auto const errors =
        reducer_.template sum<3>("slip_errors", nodes_,
                                 kernels::SlipErrors<Space, Precision>{
                                     {views_, boundaries_, x}, unknowns_.fixed, params_.steepness});
    double const change = params_.friction_change;
    bool const settled = double(errors[0]) <= negligible_;
    bool const rubs = double(errors[1]) > change * change * double(errors[2]);
    if (settled && !rubs) return false;
    for_each<Space>("relag_slip", nodes_,
                    kernels::RelagSlip<Space, Precision>{{views_, boundaries_, x}});
    return true;
  }
  /// The force of a boundary on the nodes at x, N.
  Vec3<double> force(Positions const& x, int boundary) const {
    auto const sum = reducer_.template sum<3>(
        "slip_force", nodes_,
        kernels::SlipForce<Space, Precision>{{views_, boundaries_, x}, unknowns_.fixed, boundary});
    return {double(sum[0]), double(sum[1]), double(sum[2])};
  }

  static constexpr bool couples = false;  ///< nodes (UncoupledTerm)

  double value(Positions const& x, double scale) const { return scale * sum(x, {}, 0, 0); }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * sum(x, p, 1, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * sum(x, p, 2, 0);
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g) const {
    add(x, scale, fixed, g, {}, {}, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Vectors const& diagonal) const {
    add(x, scale, fixed, g, {}, diagonal, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Blocks const& blocks) const {
    add(x, scale, fixed, g, {}, {}, blocks);
  }
  template <class... Curvature>
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Curvature const&... curvature) const {
    add_gradient(x, scale, fixed, g, curvature...);
    return -change(x, p, -alpha, scale);
  }
  void add_product(Positions const& x, Vectors const& p, double scale,
                   FixedMask<Space> const& fixed, Vectors const& hp) const {
    if (nodes_ > 0) add(x, scale, fixed, hp, p, {}, {});
  }
  void add_to(Matrix const& matrix, Positions const& x, double scale,
              FixedMask<Space> const& fixed) const {
    for_each<Space>(
        "slip_assemble", nodes_,
        kernels::AssembleSlip<Space, Precision, Matrix>{{views_}, x, scale, fixed, matrix});
  }
  double max_step(Positions const&, Vectors const&, double at_most) const { return at_most; }
  double max_prescribed_step(Positions const&, Vectors const&, double at_most) const {
    return at_most;
  }
  void elements(std::vector<Connectivity>&) const {}  // diagonal blocks are always there

private:
  double sum(Positions const& x, Vectors const& p, int what, double alpha) const {
    return double(reducer_.template sum<1>(
        "slip_energy", nodes_, kernels::SlipSum<Space, Precision>{{views_}, x, p, what, alpha})[0]);
  }
  void add(Positions const& x, double scale, FixedMask<Space> const& fixed, Vectors const& g,
           Vectors const& p, Vectors const& diagonal, Blocks const& blocks) const {
    for_each<Space>(
        "slip_gradient", nodes_,
        kernels::AddSlip<Space, Precision>{{views_}, x, scale, fixed, g, p, diagonal, blocks});
  }

  SlipParams params_;
  int nodes_ = 0;
  Unknowns<Precision, Space> unknowns_;
  mutable double negligible_ = 0;  ///< J
  kernels::SlipViews<Space> views_;
  Kokkos::View<Boundary const*, typename Space::memory> boundaries_;
  Reducer<Space, typename Precision::sum> reducer_;
};

}  // namespace taut
