// Where light and gradients come from: by number of bounces, gate, shape and technique.
#pragma once
#include <cstddef>
#include <vector>

#include "core/image/image.h"

namespace isochron {

/// Gated images sorted by where their light comes from.
struct ImageBreakdown {
  GatedImage image;                  ///< [pixel][bounces * gates + gate][channel], bounces from 0 to max_bounces
  std::vector<double> by_shape;      ///< light on paths that meet a shape (emitters included), summed over the image
  std::vector<double> by_technique;  ///< light that each technique brings, summed over the image
};

/// Sums of adjoint * dI sorted by where they come from, for several adjoints at once.
struct GradientBreakdown {
  int adjoints = 0, columns = 0;
  std::vector<double> by_bounces;  ///< [bounces][column][adjoint], bounces from 0 to max_bounces
  std::vector<double> by_gate;     ///< [gate][column], of the first adjoint
  /// [shape][column], of the first adjoint: of paths that meet a shape (emitters included; one path may meet several);
  /// of the visibility term: by the shape that the edge is part of.
  std::vector<double> by_shape;
  std::vector<double> by_technique;  ///< [technique][column], of the first adjoint
  std::size_t index(int bounces, int column) const {
    return (static_cast<std::size_t>(bounces) * columns + column) * adjoints;
  }
};

}  // namespace isochron
