// Swept terms that are chosen at run time: a list of terms of any types behind one type. A call is
// a whole sweep, so the indirection costs nothing; the inner loops stay those of the concrete
// terms.
#pragma once

#include <taut/core/potential/term.hpp>

#include <limits>
#include <memory>
#include <vector>

namespace taut {

template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class AnyTerms {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<typename Precision::real, Space>;
  using Blocks = BlockField<typename Precision::real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using Fixed = FixedMask<Space>;

  template <SweptTerm Term>
  void add(Term term) {
    terms_.push_back(std::make_shared<Holder<Term> const>(std::move(term)));
  }

  double value(Positions const& x, double scale) const {
    return total([&](auto const& t) { return t.value(x, scale); });
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return total([&](auto const& t) { return t.change(x, p, alpha, scale); });
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return total([&](auto const& t) { return t.quadratic_form(x, p, scale); });
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
    for (auto const& t : terms_) at_most = t->max_step(x, p, at_most);
    return at_most;
  }
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    for (auto const& t : terms_) at_most = t->max_prescribed_step(x, p, at_most);
    return at_most;
  }
  void elements(std::vector<Connectivity>& kinds) const {
    for (auto const& t : terms_) t->elements(kinds);
  }

private:
  struct Interface {
    virtual ~Interface() = default;
    virtual double value(Positions const&, double) const = 0;
    virtual double change(Positions const&, Vectors const&, double, double) const = 0;
    virtual double quadratic_form(Positions const&, Vectors const&, double) const = 0;
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
    virtual double max_step(Positions const&, Vectors const&, double) const = 0;
    virtual double max_prescribed_step(Positions const&, Vectors const&, double) const = 0;
    virtual void elements(std::vector<Connectivity>&) const = 0;
  };

  template <class Term>
  struct Holder final : Interface {
    Term term;
    explicit Holder(Term t) : term(std::move(t)) {}
    double value(Positions const& x, double h) const override { return term.value(x, h); }
    double change(Positions const& x, Vectors const& p, double a, double h) const override {
      return term.change(x, p, a, h);
    }
    double quadratic_form(Positions const& x, Vectors const& p, double h) const override {
      return term.quadratic_form(x, p, h);
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
    double max_step(Positions const& x, Vectors const& p, double at_most) const override {
      return term.max_step(x, p, at_most);
    }
    double max_prescribed_step(Positions const& x, Vectors const& p,
                               double at_most) const override {
      return term.max_prescribed_step(x, p, at_most);
    }
    void elements(std::vector<Connectivity>& kinds) const override { term.elements(kinds); }
  };

  template <class Part>
  double total(Part const& part) const {
    double sum = 0;
    for (auto const& t : terms_) sum += part(*t);
    return sum;
  }

  std::vector<std::shared_ptr<Interface const>> terms_;
};

}  // namespace taut
