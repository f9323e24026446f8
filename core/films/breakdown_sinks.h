// Sinks that keep account of where light and its derivatives come from: by number of bounces, gate, shape and technique.
// Exact: one pass sorts the paths, so that what is left out by fewer bounces is known without the noise of a
// difference.
#pragma once
#include <span>
#include <vector>

#include "core/films/breakdown.h"
#include "core/films/sinks.h"

namespace isochron {

/// Keeps technique, bounces and shapes of the path that contributions are attributed to.
class SortingSink : public Sink {
 public:
  explicit SortingSink(const PreparedScene& scene) : scene_(scene) {}

  void note_technique(Technique technique) override { technique_ = static_cast<std::size_t>(technique); }
  void note_path(const Path& path) override;
  void note_boundary(int bounces, int triangle, double) override;

 protected:
  std::size_t technique_ = static_cast<std::size_t>(Technique::standard);
  int bounces_ = 0;
  std::vector<int> shapes_;  ///< each once

 private:
  void add_shape(int triangle);

  const PreparedScene& scene_;
};

class ImageBreakdownSink final : public SortingSink {
 public:
  ImageBreakdownSink(const PreparedScene& scene, const GateSet& gates, ImageBreakdown& breakdown)
      : SortingSink(scene), gates_(gates), breakdown_(breakdown) {}

  bool differential() const override { return false; }
  void add(int pixel, const Rgb& value, double length, GateUse use) override;

 private:
  const GateSet& gates_;
  ImageBreakdown& breakdown_;
};

class GradientBreakdownSink final : public SortingSink {
 public:
  /// `adjoints`: [pixel][gate][channel][adjoint].
  GradientBreakdownSink(const PreparedScene& scene, const GateSet& gates, const TangentBasis& basis, int channels,
                        std::span<const double> adjoints, GradientBreakdown& breakdown)
      : SortingSink(scene),
        gates_(gates),
        rates_(scene.layout, basis),
        channels_(channels),
        adjoints_(adjoints),
        breakdown_(breakdown) {}

  bool differential() const override { return true; }
  void bind(const LocalDifferential& differential) override { rates_.bind(differential); }
  void add(int pixel, const Rgb& value, double length, GateUse use) override;
  void add_length_rate(int pixel, int gate, const Rgb& value) override { add_to_gate(pixel, gate, value, 0, 1); }

 private:
  void add_to_gate(int pixel, int gate, const Rgb& value, double w, double slope);

  const GateSet& gates_;
  ColumnRates rates_;
  const int channels_;
  std::span<const double> adjoints_;
  GradientBreakdown& breakdown_;
};

}  // namespace isochron
