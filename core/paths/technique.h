// The techniques that find paths, one by one.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace isochron {

/// Tells their random numbers apart, and the histograms of those that search for boundaries (BoundaryGuide), which come last.
enum class Technique : std::uint32_t {
  standard,        ///< from the pixel, by standard sampling
  walk,            ///< from the pixel, with ellipsoidal connections
  camera_lengths,  ///< connections of the camera itself, lengths drawn from the gates
  camera_pairs,    ///< the same, in pairs from the gates' derivative
  light_subpath,   ///< from the pixel and from an emitter
  primary_edge,    ///< a silhouette edge that the camera sees
  pixel_border,    ///< a point of a pixel's border, where the flow crosses it
  from_edge,       ///< a boundary segment by its edge
  from_light,      ///< one between an edge and a light without an extent
  from_camera      ///< an edge seen from a vertex of a camera path
};
inline constexpr int kTechniques = static_cast<int>(Technique::from_camera) + 1;

inline const char* name(Technique technique) {
  constexpr std::array<const char*, kTechniques> kNames = {
      "standard sampling",    "connections of walks", "connections of the camera", "pairs of the camera",
      "light subpaths",       "edges in the image",   "borders of pixels",         "segments from edges",
      "segments from lights", "segments from walks"};
  return kNames[static_cast<std::size_t>(technique)];
}

}  // namespace isochron
