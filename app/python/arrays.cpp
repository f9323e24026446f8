#include "app/python/arrays.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace py = pybind11;

namespace isochron {
namespace {

/// What an array keeps alive as long as it uses the values.
py::capsule owner_of(std::vector<double>* values) {
  return py::capsule(values, [](void* owned) { delete static_cast<std::vector<double>*>(owned); });
}

}  // namespace

py::array to_array(GatedImage image) {
  auto* const values = new std::vector<double>(std::move(image.data));
  const py::ssize_t channel = sizeof(double), gate = image.channels * channel, column = image.gates * gate;
  return py::array_t<double>({image.gates, image.height, image.width, image.channels},
                             {gate, image.width * column, column, channel}, values->data(), owner_of(values));
}

py::array to_array(std::vector<double> values) {
  auto* const kept = new std::vector<double>(std::move(values));
  return py::array_t<double>(static_cast<py::ssize_t>(kept->size()), kept->data(), owner_of(kept));
}

GatedImage to_image(const Array& array, const GatedImage& shape) {
  GatedImage image = shape;
  if (array.ndim() != 4 || array.shape(0) != shape.height || array.shape(1) != shape.width ||
      array.shape(2) != shape.gates || array.shape(3) != shape.channels)
    throw InputError(
        fmt::format("image: its shape is not the experiment's (allowed: {} gates, {} rows, {} columns, {} channels)",
                    shape.gates, shape.height, shape.width, shape.channels));
  image.data.assign(array.data(), array.data() + array.size());
  return image;
}

std::vector<double> to_vector(const Array& array) {
  return {array.data(), array.data() + array.size()};
}

}  // namespace isochron
