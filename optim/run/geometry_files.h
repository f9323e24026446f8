#pragma once
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"
#include "optim/problem/parameters.h"

namespace isochron {

/// The meshes of the shapes that parameters move, as files DIR/geometry/MOMENT_SHAPE.ply or .obj: see to_ply and to_obj.
/// What of a shape's name is no letter, digit, - or _ becomes _. Where a parameter has the shape's albedos by vertex, vertices have a
/// property `albedo`.
class GeometryFiles {
 public:
  /// Makes DIR/geometry unless nothing is to be written.
  GeometryFiles(const std::string& folder, const OutputSpec& output, const Parameters& parameters);

  /// All of them at theta, but for shapes of which a parameter is unknown (NaN). `errors`: of each vertex of the scene along its
  /// normal, as property `standard_error`; empty: unknown.
  void write(const std::string& moment, const std::vector<double>& theta, const std::vector<double>& errors = {}) const;
  void remove(const std::string& moment) const;
  /// Where the experiment wants it, those at the beginning of an iteration, as NNNNNN_SHAPE.
  void write_iteration(int iteration, const std::vector<double>& theta) const;

 private:
  struct File {
    int shape;
    std::string name;  ///< behind the moment
  };
  std::string path(const std::string& moment, const File& file) const;

  std::string folder_;
  OutputSpec output_;
  const Parameters& parameters_;
  std::vector<File> files_;
};

}  // namespace isochron
