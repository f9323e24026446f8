// How images and derivatives are sampled.
#pragma once
#include <optional>

#include "core/gates/gate.h"
#include "core/scene/scene.h"

namespace isochron {

enum class Sampling { automatic, standard, ellipsoidal };

/// How ellipsoidal connections choose among the arcs on an ellipsoid: several in proportion to what each would carry if
/// nothing stood in the way, or (cheaper, far noisier; the paper's way) one uniformly.
enum class ArcPick { contribution, uniform };

/// The first numbers of each sample: together the samples of a technique cover evenly what they are taken from, in each
/// pixel or, where they may land on any, over the whole image (see PointSet); or every number is independent of all
/// others.
enum class Numbers { low_discrepancy, independent };

/// How the visibility term finds boundary segments. Each can be left out (YAML: `estimator.techniques`), to measure what it brings; the mean
/// stays, except under Dirac gates, where only lengths drawn from the gates are met.
struct BoundaryTechniques {
  bool wedge = true;        ///< edges by length x wedge, azimuth inside the wedge; else by length, any direction
  bool aimed = true;        ///< directions from the edge towards emitters
  bool from_camera = true;  ///< edge points seen from vertices of camera paths
  bool at_length = true;    ///< from the camera and from edges at lengths drawn from the gates, where they are narrow
  bool light_arcs = true;   ///< ellipsoidal connections beyond the segment, where gates are narrow
  bool operator==(const BoundaryTechniques&) const = default;
};

/// What finds the paths of images and of the interior term: ellipsoidal connections, or standard sampling.
struct SamplingMix {
  bool image_connections = false, interior_connections = false;
  /// The part of the samples, 0 to below 1, with light subpaths (LightSubpaths); the others are standard. Connections have light
  /// subpaths where it is not zero.
  double image_light = 0, interior_light = 0;
  /// Paths keep their lengths (VertexFlows::keep_length), so that derivatives do not act on the gates, but for light that the camera
  /// sees an emitter by. Needs connections in the interior term.
  bool keep_length = false;
  /// Whether every sample of a camera's images, or of the interior term, adds to its own pixel only.
  bool image_stays_in_pixels() const { return !image_connections && image_light == 0; }
  bool interior_stays_in_pixels() const { return !interior_connections && interior_light == 0; }
  bool operator==(const SamplingMix&) const = default;
};

struct EstimatorOptions {
  int max_bounces = 8;  ///< scattering vertices on a path, >= 0
  Sampling sampling = Sampling::automatic;
  bool antithetic = true;                ///< coupled pairs for the gate's derivative under ellipsoidal sampling
  ArcPick pick = ArcPick::contribution;  ///< of ellipsoidal sampling
  Numbers numbers = Numbers::low_discrepancy;
  std::optional<SamplingMix> mix = {};  ///< of automatic sampling, see measure_mix; none: by the gates' width alone
  BoundaryTechniques boundary = {};
  /// Whether paths keep their lengths, see SamplingMix and may_keep_length. True: by connections in the interior term.
  /// None: where they do and gates are narrow over the smallest emitter (the root of its area).
  std::optional<bool> keep_length = {};
  /// SamplingMix::image_light and interior_light. None: those of `mix`. Not of captures.
  std::optional<double> light = {};
  /// In [0, 1): as long as a path by standard sampling has met no area-sampled shape (Shape::hidden), the probability that its
  /// next vertex is drawn there by area (see HiddenGeometry) rather than by the BSDF or the cosine of a capture's wall. None: the
  /// default, see HiddenGeometry::steps. For paths of cameras, and after x1 in captures, it applies to derivatives only.
  std::optional<double> hidden = {};
  /// Contact-aware reparameterisation: within which distance path vertices follow what is close to them and moves differently,
  /// see VertexFlows; 0: not at all. All values give the same derivative, with other variances, divided differently between
  /// the interior and the visibility term.
  double follow = 1;         ///< all but what the camera sees: in radii of the smaller body
  double follow_radius = 4;  ///< what the camera sees: in widths of a pixel
  /// Samples per pixel, on average, from which each renderer learns once how to guide the visibility term; 0: unguided.
  double guiding_samples = 0;
  bool operator==(const EstimatorOptions&) const = default;
};

/// Whether the paths of a scene can keep their lengths: all emitters have an extent, and nothing is of glass.
bool may_keep_length(const Scene& scene);

/// What a renderer makes of `sampling`, `mix`, `light` and `keep_length`.
SamplingMix sampling_mix(const EstimatorOptions& options, const GateSet& gates, const Scene& scene);

/// The terms of the derivative (paper Eq. 13). A sample of `interior` and `path_length` is a camera path with all its
/// connections; one of `visibility` is one search for a boundary, by one of its five techniques (see BoundaryGuide).
enum class Term { interior, visibility, path_length };
inline constexpr Term kTerms[] = {Term::interior, Term::visibility, Term::path_length};
const char* name(Term term);

/// Samples [begin, end) of each pixel. Ranges of one stream that begin at different numbers are independent, those that
/// begin at the same are not. The samples of a range belong together: [0, 8) is not the mean of [0, 4) and [4, 8), and
/// with low-discrepancy numbers varies less.
struct SampleRange {
  int begin = 0, end = 0;
  int count() const { return end - begin; }
};

/// How many times as long as a ray it takes to test a triangle for an arc, and to differentiate a segment of a path. By these a unit of work
/// takes 0.77 to 1.43 times the median, over five scenes, images, interior and visibility terms, and all mixes (isochron_work).
inline constexpr double kRaysPerArc = 0.5, kRaysPerSegment = 0.4;

/// What work is counted by, the same on every machine: rays, triangles tested for arcs, and segments of paths that were differentiated.
struct WorkCounts {
  long long rays = 0, arcs = 0, segments = 0;

  double in_rays() const {
    return static_cast<double>(rays) + kRaysPerArc * static_cast<double>(arcs) +
           kRaysPerSegment * static_cast<double>(segments);
  }
  WorkCounts& operator+=(const WorkCounts& other) {
    rays += other.rays;
    arcs += other.arcs;
    segments += other.segments;
    return *this;
  }
  WorkCounts operator-(const WorkCounts& other) const {
    return {rays - other.rays, arcs - other.arcs, segments - other.segments};
  }
};

}  // namespace isochron
