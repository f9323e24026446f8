// Back-projection of captures that Python has as arrays.
#pragma once
#include <pybind11/pybind11.h>

#include <optional>
#include <utility>

#include "app/python/arrays.h"

namespace isochron {

/// counts [spot * sensor point, bin]; points and normals [point, xyz]; laser [spot, xyz], or none: confocal; bins in metres;
/// origins [2, xyz] of laser and sensor, where the ways from and to there count; response: offsets in metres and values; used [point],
/// or none: all. Returns the fields of BackProjection and FirstSurface by name; volumes are [depth, up, across].
pybind11::dict back_project_arrays(const Array& counts, const Array& points, const Array& normals,
                                   const std::optional<Array>& laser, double delta_t, double t_start,
                                   const std::optional<Array>& origins,
                                   const std::optional<std::pair<Array, Array>>& response,
                                   const std::optional<Array>& used, double false_alarms);

}  // namespace isochron
