// The renderer's public face: gated images, their derivatives term by term, and loss gradients.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "core/base/random.h"
#include "core/films/breakdown.h"
#include "core/films/replicates.h"
#include "core/gates/gate.h"
#include "core/image/image.h"
#include "core/paths/options.h"
#include "core/paths/technique.h"
#include "core/scene/scene.h"

namespace isochron {

class SceneCache;

/// Of a gradient, see Renderer::add_gradient.
inline constexpr int kGradientParts = 32;

/// A prepared scene at one value of the parameters. Immutable; safe to share between threads.
class Renderer {
 public:
  /// `basis` says what moves (derivatives skip the rest); null or empty: nothing does, only `render` makes sense.
  /// The scene, gates and basis must outlive the renderer.
  /// A cache reuses what scenes of the same topology have in common; the bits are the same.
  Renderer(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
           const TangentBasis* basis = nullptr, SceneCache* cache = nullptr);
  ~Renderer();

  /// Unbiased estimate of the gated images: average over the samples of `range`.
  GatedImage render(const Stream& stream, SampleRange range) const;

  /// Unbiased estimate of one term of the images' derivative, one image per unknown (column of the basis).
  std::vector<GatedImage> derive(Term term, const Stream& stream, SampleRange range) const;

  /// As `render` of each of several ranges of samples.
  ReplicatedImage render_replicates(const Stream& stream, const std::vector<SampleRange>& ranges) const;
  /// As `derive` of each.
  std::vector<ReplicatedImage> derive_replicates(Term term, const Stream& stream,
                                                 const std::vector<SampleRange>& ranges) const;

  /// Unbiased estimate of one term of sum(adjoint * dI), added to `dof_gradient` (size DofLayout::size()). Costs the
  /// same for any number of unknowns. `parts`, if given, receives the contributions of disjoint sets of pixels' samples,
  /// per unknown (column of the basis): [part][column], kGradientParts of them, of the same pixels in every range.
  void add_gradient(Term term, const GatedImage& adjoint, const Stream& stream, SampleRange range,
                    std::vector<double>& dof_gradient, std::vector<std::vector<double>>* parts = nullptr) const;

  /// As `add_gradient` for every adjoint (at least one, images of one shape), with the same paths. Their gates and pixels are picked for all
  /// together. Paths are most of the cost. `parts` are of the first.
  void add_gradients(Term term, std::span<const GatedImage> adjoints, const Stream& stream, SampleRange range,
                     std::span<std::vector<double>> dof_gradients,
                     std::vector<std::vector<double>>* parts = nullptr) const;

  /// Whether the term can be other than zero: it depends on what moves and, for path_length, gates have jumps.
  bool has(Term term) const;

  /// As `render`, sorted.
  ImageBreakdown render_breakdown(const Stream& stream, SampleRange range) const;
  /// As `add_gradient` for every adjoint (at least one, images of one shape), over the columns of the basis, sorted.
  GradientBreakdown gradient_breakdown(Term term, std::span<const GatedImage> adjoints, const Stream& stream,
                                       SampleRange range) const;

  /// Whether values of different pixels, in images and in a term of the derivative, are independent: every sample adds to
  /// only its own pixel and shares no random numbers with those of others.
  bool pixels_are_independent() const;
  bool pixels_are_independent(Term term) const;

  /// What the options resolved to.
  const SamplingMix& mix() const;
  /// Rays traced so far by this renderer (all threads).
  long long rays() const;
  /// Work done so far, in rays: stands for time, but is the same on every machine.
  double work() const;
  /// Of the samples of one technique.
  double work_of(Technique technique) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace isochron
