// The light side of a boundary segment: what a surface point sends towards a given point, gathered by a
// standard walk or, under narrow gates, by ellipsoidal connections of lengths drawn from the gates.
#pragma once
#include <span>
#include <vector>

#include "core/techniques/ellipsoidal.h"

namespace isochron {

/// Light that vertex 1 of a path sends to vertex 0.
struct GatheredLight {
  Rgb value;               ///< contribution over density from vertex 1 on, without the gate
  double length;           ///< from vertex 1 to the emitter; of the whole path if it was drawn for a target
  int bounces;             ///< scattering vertices
  int target;              ///< index of the CameraSide whose length it was drawn for; -1: it can be joined with any
  SurfacePoint next = {};  ///< vertex 2; none (triangle -1) where vertex 1 emits the light

  /// Of the path that `before` begins. Exactly as drawn: under a Dirac gate no other length counts.
  double whole_length(double before) const { return target >= 0 ? length : before + length; }
};

/// What a boundary segment's light is joined with.
struct CameraSide {
  int pixel;      ///< or GatePick::kImage
  double length;  ///< from the camera to where the light side begins
};

class LightSide final : private LengthReceiver {
 public:
  /// `arcs`: by ellipsoidal connections, which need emitters with an extent.
  LightSide(Worker& worker, bool arcs);
  LightSide(const LightSide&) = delete;
  LightSide& operator=(const LightSide&) = delete;

  /// Light that x sends towards `towards`, to be joined with the paths `before`. The result lives until the
  /// next call.
  const std::vector<GatheredLight>& gather(const SurfacePoint& towards, const SurfacePoint& x,
                                           std::span<const CameraSide> before, int max_bounces, Rng& rng);

 private:
  void take(int target, int bounces, const Rgb& value) override;

  Worker& worker_;
  const PreparedScene& scene_;
  const bool arcs_;
  Path path_;
  EllipsoidalConnections connections_;
  std::span<const CameraSide> before_;
  std::vector<double> whole_lengths_;  ///< drawn from the gates; 0: none
  std::vector<double> lengths_;        ///< the same less `before_`
  std::vector<GatheredLight> lights_;
};

}  // namespace isochron
