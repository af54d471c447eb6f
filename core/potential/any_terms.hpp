// Swept terms that are chosen at run time: a list of terms of any types behind one type. A call is
// a whole sweep, so the indirection costs nothing; the inner loops stay those of the concrete
// terms.
//
// Two types: `AnySteppedTerms` holds terms that are told when a step begins, `AnyTerms` those that
// are not, for a potential tells the first what the second amount to.
#pragma once

#include <taut/core/potential/term.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

namespace taut {

template <class Precision_, class Space_, bool stepped>
class TermList {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<typename Precision::real, Space>;
  using Blocks = BlockField<typename Precision::real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using Fixed = FixedMask<Space>;
  using Indices = typename Bodies<Space>::Indices;

  /// Returns the term as the list, and every copy of it, holds it: for who has to tell it things.
  template <SweptTerm Term>
  std::shared_ptr<Term> add(Term term) {
    static_assert(SteppedTerm<Term> == stepped,
                  "taut: a term with begin_step belongs into AnySteppedTerms, any other into "
                  "AnyTerms");
    auto const held = std::make_shared<Holder<Term>>(std::move(term));
    terms_.push_back(held);
    return {held, &held->term};
  }

  double value(Positions const& x, double scale) const {
    return total([&](auto const& t) { return t.value(x, scale); });
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return total([&](auto const& t) { return t.change(x, p, alpha, scale); });
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    double unused = 0;
    return quadratic_form(x, p, scale, unused);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale,
                        double& certified) const {
    return total([&](auto const& t) { return t.quadratic_form(x, p, scale, certified); });
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g) const {
    for (auto const& t : terms_) t->add_gradient(x, scale, fixed, g);
  }
  template <class Curvature>
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Curvature const& c) const {
    for (auto const& t : terms_) t->add_gradient(x, scale, fixed, g, c);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g) const {
    return total([&](auto const& t) { return t.add_gradient_after(x, p, alpha, scale, fixed, g); });
  }
  template <class Curvature>
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Curvature const& c) const {
    return total(
        [&](auto const& t) { return t.add_gradient_after(x, p, alpha, scale, fixed, g, c); });
  }
  void add_product(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                   Vectors const& hp) const {
    for (auto const& t : terms_) t->add_product(x, p, scale, fixed, hp);
  }
  void add_to(Matrix const& matrix, Positions const& x, double scale, Fixed const& fixed) const {
    for (auto const& t : terms_) t->add_to(matrix, x, scale, fixed);
  }
  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    return max_step(x, p, at_most, 0);
  }
  double max_step(Positions const& x, Vectors const& p, double at_most, double certified) const {
    for (auto const& t : terms_) at_most = t->max_step(x, p, at_most, certified);
    return at_most;
  }
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    for (auto const& t : terms_) at_most = t->max_prescribed_step(x, p, at_most);
    return at_most;
  }
  void elements(std::vector<Connectivity>& kinds) const {
    for (auto const& t : terms_) t->elements(kinds);
  }
  std::int64_t pattern_version(Positions const& x) const {
    std::int64_t version = 0;
    for (auto const& t : terms_) version += t->pattern_version(x);
    return version;
  }
  std::optional<Obstruction> obstruction() const {
    for (auto t = terms_.rbegin(); t != terms_.rend(); ++t) {
      if (auto found = (*t)->obstruction()) return found;
    }
    return {};
  }
  bool empty() const { return terms_.empty(); }

  bool divisible() const {
    return std::all_of(terms_.begin(), terms_.end(), [](auto const& t) { return t->divisible(); });
  }
  void add_form_shares(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                       Array<double, Space> const& shares) const {
    for (auto const& t : terms_) t->add_form_shares(x, p, scale, fixed, shares);
  }
  void lasting_elements(std::vector<Connectivity>& kinds) const {
    for (auto const& t : terms_) t->lasting_elements(kinds);
  }
  bool link(Fixed const& fixed, Indices const& body, Indices const& label) const {
    bool changed = false;
    for (auto const& t : terms_) changed = t->link(fixed, body, label) || changed;
    return changed;
  }
  void set_idle(IdleMask<Space> const& idle) const {
    for (auto const& t : terms_) t->set_idle(idle);
  }
  void mark_acting(Positions const& x, Fixed const& fixed, Array<int, Space> const& marks) const {
    for (auto const& t : terms_) t->mark_acting(x, fixed, marks);
  }

  void begin_step(StepStart<Precision, Space> const& start) const requires stepped {
    for (auto const& t : terms_) t->begin_step(start);
  }
  bool relag(Positions const& x) const {
    bool changed = false;
    for (auto const& t : terms_) changed = t->relag(x) || changed;
    return changed;
  }
  double motion_left(Positions const& x) const requires stepped {
    double left = 0;
    for (auto const& t : terms_) left = std::max(left, t->motion_left(x));
    return left;
  }
  double max_advance(Positions const& x, Vectors const& p, double at_most) const requires stepped {
    for (auto const& t : terms_) at_most = t->max_advance(x, p, at_most);
    return at_most;
  }
  void advance(double fraction) const requires stepped {
    for (auto const& t : terms_) t->advance(fraction);
  }

private:
  struct Interface {
    virtual ~Interface() = default;
    virtual double value(Positions const&, double) const = 0;
    virtual double change(Positions const&, Vectors const&, double, double) const = 0;
    virtual double quadratic_form(Positions const&, Vectors const&, double, double&) const = 0;
    virtual void add_gradient(Positions const&, double, Fixed const&, Vectors const&) const = 0;
    virtual void add_gradient(Positions const&, double, Fixed const&, Vectors const&,
                              Vectors const&) const = 0;
    virtual void add_gradient(Positions const&, double, Fixed const&, Vectors const&,
                              Blocks const&) const = 0;
    virtual double add_gradient_after(Positions const&, Vectors const&, double, double,
                                      Fixed const&, Vectors const&) const = 0;
    virtual double add_gradient_after(Positions const&, Vectors const&, double, double,
                                      Fixed const&, Vectors const&, Vectors const&) const = 0;
    virtual double add_gradient_after(Positions const&, Vectors const&, double, double,
                                      Fixed const&, Vectors const&, Blocks const&) const = 0;
    virtual void add_product(Positions const&, Vectors const&, double, Fixed const&,
                             Vectors const&) const = 0;
    virtual void add_to(Matrix const&, Positions const&, double, Fixed const&) const = 0;
    virtual double max_step(Positions const&, Vectors const&, double, double) const = 0;
    virtual double max_prescribed_step(Positions const&, Vectors const&, double) const = 0;
    virtual void elements(std::vector<Connectivity>&) const = 0;
    virtual std::int64_t pattern_version(Positions const&) const = 0;
    virtual std::optional<Obstruction> obstruction() const = 0;
    virtual bool divisible() const = 0;
    virtual void add_form_shares(Positions const&, Vectors const&, double, Fixed const&,
                                 Array<double, Space> const&) const = 0;
    virtual void lasting_elements(std::vector<Connectivity>&) const = 0;
    virtual bool link(Fixed const&, Indices const&, Indices const&) const = 0;
    virtual void set_idle(IdleMask<Space> const&) const = 0;
    virtual void mark_acting(Positions const&, Fixed const&, Array<int, Space> const&) const = 0;
    virtual void begin_step(StepStart<Precision, Space> const&) const = 0;
    virtual bool relag(Positions const&) const = 0;
    virtual double motion_left(Positions const&) const = 0;
    virtual double max_advance(Positions const&, Vectors const&, double) const = 0;
    virtual void advance(double) const = 0;
  };

  template <class Term>
  struct Holder final : Interface {
    Term term;
    explicit Holder(Term t) : term(std::move(t)) {}
    double value(Positions const& x, double h) const override { return term.value(x, h); }
    double change(Positions const& x, Vectors const& p, double a, double h) const override {
      return term.change(x, p, a, h);
    }
    double quadratic_form(Positions const& x, Vectors const& p, double h,
                          double& certified) const override {
      return taut::quadratic_form(term, x, p, h, certified);
    }
    void add_gradient(Positions const& x, double h, Fixed const& f,
                      Vectors const& g) const override {
      term.add_gradient(x, h, f, g);
    }
    void add_gradient(Positions const& x, double h, Fixed const& f, Vectors const& g,
                      Vectors const& d) const override {
      term.add_gradient(x, h, f, g, d);
    }
    void add_gradient(Positions const& x, double h, Fixed const& f, Vectors const& g,
                      Blocks const& b) const override {
      term.add_gradient(x, h, f, g, b);
    }
    double add_gradient_after(Positions const& x, Vectors const& p, double a, double h,
                              Fixed const& f, Vectors const& g) const override {
      return term.add_gradient_after(x, p, a, h, f, g);
    }
    double add_gradient_after(Positions const& x, Vectors const& p, double a, double h,
                              Fixed const& f, Vectors const& g, Vectors const& d) const override {
      return term.add_gradient_after(x, p, a, h, f, g, d);
    }
    double add_gradient_after(Positions const& x, Vectors const& p, double a, double h,
                              Fixed const& f, Vectors const& g, Blocks const& b) const override {
      return term.add_gradient_after(x, p, a, h, f, g, b);
    }
    void add_product(Positions const& x, Vectors const& p, double h, Fixed const& f,
                     Vectors const& hp) const override {
      term.add_product(x, p, h, f, hp);
    }
    void add_to(Matrix const& m, Positions const& x, double h, Fixed const& f) const override {
      term.add_to(m, x, h, f);
    }
    double max_step(Positions const& x, Vectors const& p, double at_most,
                    double certified) const override {
      return taut::max_step(term, x, p, at_most, certified);
    }
    double max_prescribed_step(Positions const& x, Vectors const& p,
                               double at_most) const override {
      return term.max_prescribed_step(x, p, at_most);
    }
    void elements(std::vector<Connectivity>& kinds) const override { term.elements(kinds); }
    std::int64_t pattern_version(Positions const& x) const override {
      if constexpr (ChangingTerm<Term>) return term.pattern_version(x);
      return 0;
    }
    std::optional<Obstruction> obstruction() const override {
      if constexpr (ObstructedTerm<Term>) return term.obstruction();
      return {};
    }
    bool divisible() const override { return divides(term); }
    void add_form_shares(Positions const& x, Vectors const& p, double h, Fixed const& f,
                         Array<double, Space> const& shares) const override {
      if constexpr (DivisibleTerm<Term>) {
        term.add_form_shares(x, p, h, f, shares);
      } else {
        throw Error("a term of the list cannot say where its curvature is: see DivisibleTerm");
      }
    }
    void lasting_elements(std::vector<Connectivity>& kinds) const override {
      taut::lasting_elements(term, kinds);
    }
    bool link(Fixed const& fixed, Indices const& body, Indices const& label) const override {
      if constexpr (LinkingTerm<Term>) return term.link(fixed, body, label);
      return false;
    }
    void set_idle(IdleMask<Space> const& idle) const override {
      if constexpr (IdlingTerm<Term>) term.set_idle(idle);
    }
    void mark_acting(Positions const& x, Fixed const& fixed,
                     Array<int, Space> const& marks) const override {
      if constexpr (MarkingTerm<Term>) term.mark_acting(x, fixed, marks);
    }
    void begin_step(StepStart<Precision, Space> const& start) const override {
      if constexpr (SteppedTerm<Term>) term.begin_step(start);
    }
    bool relag(Positions const& x) const override {
      if constexpr (LaggedTerm<Term>) return term.relag(x);
      return false;
    }
    double motion_left(Positions const& x) const override {
      if constexpr (MovingTerm<Term>) return term.motion_left(x);
      return 0;
    }
    double max_advance(Positions const& x, Vectors const& p, double at_most) const override {
      if constexpr (MovingTerm<Term>) return term.max_advance(x, p, at_most);
      return at_most;
    }
    void advance(double fraction) const override {
      if constexpr (MovingTerm<Term>) term.advance(fraction);
    }
  };

  template <class Part>
  double total(Part const& part) const {
    double sum = 0;
    for (auto const& t : terms_) sum += part(*t);
    return sum;
  }

  std::vector<std::shared_ptr<Interface const>> terms_;
};

template <class Precision = Mixed, class Space = DefaultSpace>
using AnyTerms = TermList<Precision, Space, false>;
template <class Precision = Mixed, class Space = DefaultSpace>
using AnySteppedTerms = TermList<Precision, Space, true>;

}  // namespace taut
