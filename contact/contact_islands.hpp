// What minimisers that go by islands (core/potential/bodies.hpp) ask of terms made of stencils of
// up to four vertices: which bodies a stencil joins, and the share that it has in p'Hp. What is
// fixed does neither: it does not move.
#pragma once

#include <taut/contact/contact_kernels.hpp>
#include <taut/contact/friction_kernels.hpp>

namespace taut::kernels {

/// The share of a pair is at its first vertex that is free.
template <class Pair, class Precision, class S>
struct PairFormShares {
  typename SurfaceViews<S>::Indices vertex;
  SlotsOfVertices<S> of;
  PairForm<Pair, Precision, S> form;
  FixedMask<S> fixed;
  double scale;
  Array<double, S> shares;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = vertex(i);
    if (fixed(v)) return;
    double sum = 0;
    for (int j = of.begin(v); j < of.begin(v + 1); ++j) {
      int const slot = of.slot(j);
      if (!form.pairs.idle(slot / 4) && owns(slot)) sum += form.form(slot / 4);
    }
    shares(v) += scale * sum;
  }
  KOKKOS_FUNCTION bool owns(int slot) const {
    for (int a = 0; a < slot % 4; ++a) {
      if (!fixed(form.pairs.vertex(slot / 4, a))) return false;
    }
    return true;
  }
};

/// Pair k joins the bodies of its two sides, if something of each is free.
template <class Precision, class S>
struct LinkPairs {
  PairTable<Precision, S> pairs;
  FixedMask<S> fixed;
  typename Bodies<S>::Indices body, label;

  KOKKOS_FUNCTION void operator()(int k, int& changed) const {
    int const second = pairs.kind(k) == PairKind::point_triangle ? 1 : 2;
    int const a = free_body(k, 0, second), b = free_body(k, second, 4);
    if (a >= 0 && b >= 0) join_labels(label, a, b, changed);
  }
  KOKKOS_FUNCTION int free_body(int k, int first, int last) const {
    for (int a = first; a < last; ++a) {
      int const v = pairs.vertex(k, a);
      if (!fixed(v)) return body(v);
    }
    return -1;
  }
};

/// The share of a contact with friction is at its first vertex that is free and takes part.
template <class Precision, class S>
struct FrictionShares {
  typename SurfaceViews<S>::Indices vertex;
  SlotsOfVertices<S> of;
  FrictionForm<Precision, S> form;
  FixedMask<S> fixed;
  double scale;
  Array<double, S> shares;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = vertex(i);
    if (fixed(v)) return;
    double sum = 0;
    for (int j = of.begin(v); j < of.begin(v + 1); ++j) {
      int const slot = of.slot(j);
      if (owns(slot)) sum += form.form(slot / 4);
    }
    shares(v) += scale * sum;
  }
  KOKKOS_FUNCTION bool owns(int slot) const {
    auto const& contacts = form.slips.contacts;
    for (int a = 0; a < slot % 4; ++a) {
      if (contacts.c(slot / 4, a) != 0 && !fixed(contacts.vertex(slot / 4, a))) return false;
    }
    return true;
  }
};

/// Contact k joins the bodies of all that is free in it.
template <class Precision, class S>
struct LinkFriction {
  LaggedTable<Precision, S> contacts;
  FixedMask<S> fixed;
  typename Bodies<S>::Indices body, label;

  KOKKOS_FUNCTION void operator()(int k, int& changed) const {
    int first = -1;
    for (int a = 0; a < 4; ++a) {
      int const v = contacts.vertex(k, a);
      if (contacts.c(k, a) == 0 || fixed(v)) continue;
      if (first < 0) first = body(v);
      join_labels(label, first, body(v), changed);
    }
  }
};

}  // namespace taut::kernels
