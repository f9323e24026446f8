// What a run writes besides images and tables: see geometry_files.h.
#pragma once
#include <string>

#include "core/base/description.h"
#include "core/scene/mesh_writer.h"

namespace isochron {

struct OutputSpec {
  std::string geometry = "ply";  ///< a format of mesh_formats(), or none
  int every = 0;                 ///< meshes of every so many iterations besides the first and the last; 0: of none
  int frames = 24;               ///< images over the iterations at most, see frames.h; 0: none
  /// Per sensor point, of final.h5, whose noise should be small beside that of counts: variance over mean, by which it raises the
  /// deviance per reading, is 0.084, 0.0030, 0.00048 and 0.00006 in `letter` with 64, 1024, 4096 and 16384 samples.
  int histogram_samples = 4096;
};

inline void describe(Keys& keys, OutputSpec& output) {
  std::vector<std::pair<std::string, std::string>> formats;
  for (const MeshFormat& format : mesh_formats()) formats.emplace_back(format.name, format.meaning);
  formats.emplace_back("none", "no meshes");
  const auto choose = [&output, formats](int i) { output.geometry = formats[i].first; };
  keys.value("geometry", field::choice(formats, choose, [&output] { return output.geometry; }),
             "format of the meshes of moving shapes: initial, final and, if known, target");
  keys.value("every", field::integer(output.every, 0), "also writes them at every so many iterations; 0: none",
             {.unit = "iterations"});
  keys.value("frames", field::integer(output.frames, 0, 10000),
             "largest number of images over the iterations in DIR/frames, for reports (fewer above 64 MB); 0: none");
  keys.value("histogram_samples", field::integer(output.histogram_samples, 1, 1 << 30),
             "samples per sensor point for the expected counts of a capture in final.h5");
}

}  // namespace isochron
