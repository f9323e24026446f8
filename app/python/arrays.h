// NumPy's arrays of what the renderer has.
#pragma once
#include <pybind11/numpy.h>

#include <vector>

#include "core/image/image.h"

namespace isochron {

/// Of doubles, converted and copied into one piece where need be.
using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// [gate, row, column, channel], without a copy.
pybind11::array to_array(GatedImage image);
pybind11::array to_array(std::vector<double> values);

/// From [row, column, gate, channel], as images lie in memory. `shape` is an image of the shape that it must have.
GatedImage to_image(const Array& array, const GatedImage& shape);

std::vector<double> to_vector(const Array& array);

}  // namespace isochron
