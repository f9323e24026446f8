// Area-sampled shapes (hidden geometry sampling, theory section 9): points of paths are drawn uniformly by area on the shapes that
// parameters change or that the user names (Shape::hidden), which a ray in a random direction may rarely meet. Which triangles these
// are, how often a step is drawn there, and which way a vertex counts for.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/discrete_distribution.h"
#include "core/paths/options.h"

namespace isochron {

class PreparedScene;

/// Probabilities that a step is drawn by area.
struct AreaSteps {
  double first = 0;  ///< from a capture's wall
  /// The same for paths that contribute themselves, not by a boundary at their end: 1 where their only bounce must be on what changes.
  double standard_first = 0;
  double later = 0;  ///< as long as the path has met no area-sampled shape
};

class HiddenGeometry {
 public:
  /// For the scene as it is now. Which triangles may belong to it, and whether area sampling alone is best, is decided by the first.
  void update(const PreparedScene& scene);

  bool empty() const { return triangles_.empty(); }
  /// Not of empty geometry.
  bool holds(int triangle) const { return triangle >= 0 && on_it_[triangle]; }

  /// EstimatorOptions::hidden where it is of use: in derivatives, to which paths that miss these shapes add nothing, and, of later
  /// steps, where there are other shapes.
  AreaSteps steps(const EstimatorOptions& options, bool derivatives) const;
  /// The probability of area sampling for one step, given that of its kind. It becomes 1 for the `last` step that can lead to what changes,
  /// where only area-sampled shapes do: without it the path adds nothing to derivatives.
  double step(double probability, bool last) const {
    return last && alone_changes_ ? std::ceil(probability) : probability;
  }

  /// A triangle, by area. `u` in (0, 1) is replaced by a fresh uniform number.
  int pick(double& u) const { return triangles_[distribution_.sample(u)]; }
  /// Of every point on its triangles, per area.
  double pdf() const { return 1 / distribution_.total(); }
  /// Density per area of a path's next vertex on `triangle`, which the one before sees: area sampling with this probability, or else
  /// another way, of density `other`, whichever has the larger density (maximum heuristic).
  double next_vertex_pdf(int triangle, double probability, double other) const {
    return std::max(own_pdf(triangle, probability), (1 - probability) * other);
  }
  /// Whether it is area sampling.
  bool takes(int triangle, double probability, double other) const {
    return own_pdf(triangle, probability) >= (1 - probability) * other;
  }

 private:
  double own_pdf(int triangle, double probability) const {
    return probability > 0 && holds(triangle) ? probability * pdf() : 0;
  }
  /// Whether its points have weights (the wall's reflection over their density) of no larger mean square than points drawn by the
  /// wall's cosine, whose weights are 1.
  bool beats_cosine_sampling(const PreparedScene& scene) const;

  std::vector<int> candidates_, triangles_;  ///< in an order in which neighbours are close
  DiscreteDistribution distribution_;        ///< of the triangles, by their areas
  std::vector<char> on_it_;                  ///< of every triangle of the scene
  bool is_all_ = false;                      ///< area sampling can draw every point that a sensor point sees
  bool of_captures_ = false, is_best_alone_ = false, is_chosen_ = false;
  /// Whether every vertex, or every first vertex x1 of a capture's paths, that gives its path a derivative is area-sampled.
  bool alone_changes_ = false, alone_changes_x1_ = false;
};

}  // namespace isochron
