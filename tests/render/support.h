// Shared by the renderer's tests: motions of a scene, their tangent basis, and estimates with standard errors.
#pragma once
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/render/renderer.h"
#include "core/scene/scene_loader.h"
#include "core/techniques/boundary_guide.h"
#include "tests/render/scene_building.h"

namespace isochron::testing {

/// One scalar unknown of a scene: how to set it, and its velocities at zero.
struct Motion {
  std::function<void(Scene&, double)> apply;
  std::function<void(const Scene&, std::vector<std::pair<int, double>>&)> velocity;  ///< (dof, coefficient)
};

inline Motion move_vertices(const Scene& scene, const std::string& shape, std::function<bool(const Vec3&)> select,
                            std::function<Vec3(const Vec3&, double)> place, std::function<Vec3(const Vec3&)> velocity) {
  const Shape& s = scene.shapes[scene.find_shape(shape)];
  std::vector<int> chosen;
  for (int v = s.first_vertex; v < s.first_vertex + s.vertex_count; ++v)
    if (select(scene.positions[v])) chosen.push_back(v);
  return {[=](Scene& target, double t) {
            for (int v : chosen) target.positions[v] = place(target.positions[v], t);
          },
          [=](const Scene& source, std::vector<std::pair<int, double>>& out) {
            for (int v : chosen)
              for (int axis = 0; axis < 3; ++axis)
                if (const double c = velocity(source.positions[v])[axis]; c != 0) out.emplace_back(3 * v + axis, c);
          }};
}

inline Motion translate(
    const Scene& scene, const std::string& shape, const Vec3& direction,
    std::function<bool(const Vec3&)> select = [](const Vec3&) { return true; }) {
  return move_vertices(
      scene, shape, select, [=](const Vec3& p, double t) { return p + direction * t; },
      [=](const Vec3&) { return direction; });
}

/// Rotation about the vertical axis through `pivot`, per radian.
inline Motion rotate_y(const Scene& scene, const std::string& shape, const Vec3& pivot) {
  return move_vertices(
      scene, shape, [](const Vec3&) { return true; },
      [=](const Vec3& p, double t) {
        const double c = std::cos(t), s = std::sin(t);
        const Vec3 d = p - pivot;
        return pivot + Vec3{c * d.x + s * d.z, d.y, -s * d.x + c * d.z};
      },
      [=](const Vec3& p) {
        return cross(Vec3{0, 1, 0}, p - pivot);
      });
}

/// All values of a quantity of a material alike.
inline Motion change_material(const Scene& scene, const std::string& material, const std::string& quantity) {
  const int m = scene.find_material(material);
  Quantity found;
  const int first = scene.materials[m].find(quantity, &found), count = static_cast<int>(found.values.size());
  return {[=](Scene& target, double t) {
            Material& changed = target.materials[m];
            for (int k = first; k < first + count; ++k) changed.set_number(k, changed.number(k) + t);
          },
          [=](const Scene& source, std::vector<std::pair<int, double>>& out) {
            for (int k = first; k < first + count; ++k) out.emplace_back(DofLayout(source).number(m, k), 1.0);
          }};
}

inline Motion change_emission(const Scene& scene, const std::string& shape) {
  const int s = scene.find_shape(shape);
  return {[=](Scene& target, double t) {
            for (int c = 0; c < 3; ++c) target.shapes[s].emission.radiance[c] += t;
          },
          [=](const Scene& source, std::vector<std::pair<int, double>>& out) {
            for (int c = 0; c < 3; ++c) out.emplace_back(DofLayout(source).emission(s, c), 1.0);
          }};
}

inline TangentBasis make_basis(const Scene& scene, const std::vector<Motion>& motions) {
  const int size = DofLayout(scene).size();
  std::vector<std::vector<TangentBasis::Entry>> rows(size);
  for (std::size_t column = 0; column < motions.size(); ++column) {
    std::vector<std::pair<int, double>> entries;
    motions[column].velocity(scene, entries);
    for (const auto& [dof, coefficient] : entries) rows[dof].push_back({static_cast<int>(column), coefficient});
  }
  TangentBasis basis;
  basis.columns = static_cast<int>(motions.size());
  basis.row_begin.push_back(0);
  for (const auto& row : rows) {
    basis.entries.insert(basis.entries.end(), row.begin(), row.end());
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

/// The validation scene in so many pixels across, with a glossy panel and with `block` as its block's material.
inline Scene glossy_validation_scene(int width, double roughness, const Material& block) {
  Scene scene = load_scene(PROJECT_ROOT "/tests/data/validation/scene.yaml");
  scene.camera.width = scene.camera.height = width;
  replace_material(scene, "panel", conductor(Rgb(0.7), roughness, true));
  replace_material(scene, "block", block);
  return scene;
}

/// The same with a block of glass and a light inside of it, whose paths connections do not find.
inline Scene scene_with_light_in_glass() {
  Scene scene = glossy_validation_scene(16, 0.5, glass(0.3, 1.5));
  const Shape& block = scene.shapes[scene.find_shape("block")];
  Vec3 middle{0, 0, 0};
  for (int v = block.first_vertex; v < block.first_vertex + block.vertex_count; ++v)
    middle = middle + scene.positions[v] / block.vertex_count;
  scene.lights.push_back({.name = "inside", .position = middle, .intensity = Rgb(1)});
  return scene;
}

struct Estimate {
  double mean = 0, standard_error = 0;
};

/// Running mean and standard error over independent batches.
class Batches {
 public:
  void add(double x) {
    ++count_;
    const double d = x - mean_;
    mean_ += d / count_;
    squares_ += d * (x - mean_);
  }
  Estimate estimate() const { return {mean_, std::sqrt(squares_ / (count_ - 1) / count_)}; }

 private:
  int count_ = 0;
  double mean_ = 0, squares_ = 0;
};

/// By how much a standard error of so many normal replicates comes out too large, once in 10 000 cases: the root of chi^2 over its
/// degrees of freedom (Wilson and Hilferty). Limits on errors are limits on the true ones, times this.
inline double scatter_of_errors(int replicates) {
  constexpr double kQuantile = 3.719;  // of the normal law
  const double v = 2.0 / (9 * (replicates - 1));
  return std::pow(1 - v + kQuantile * std::sqrt(v), 1.5);
}

/// What a z-score of so many replicates exceeds as rarely as a normal number exceeds z: Student's law with a degree of freedom less
/// (Cornish and Fisher).
inline double student_limit(double z, int replicates) {
  const double n = replicates - 1, z2 = z * z;
  return z * (1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
              (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n));
}

/// z-score of the difference of two independent estimates.
inline double z_score(const Estimate& a, const Estimate& b) {
  const double error = std::hypot(a.standard_error, b.standard_error);
  return error > 0 ? (a.mean - b.mean) / error : (a.mean == b.mean ? 0.0 : INFINITY);
}

/// Image means per gate over `batches` batches of `samples` samples each.
inline std::vector<Estimate> image_means(const Renderer& renderer, int gates, int samples, int batches, Stream stream) {
  std::vector<Batches> sums(gates);
  for (int b = 0; b < batches; ++b) {
    const GatedImage image = renderer.render(stream, {b * samples, (b + 1) * samples});
    for (int g = 0; g < gates; ++g) sums[g].add(image.mean(g));
  }
  std::vector<Estimate> out;
  for (const Batches& s : sums) out.push_back(s.estimate());
  return out;
}

/// Samples of a term for the effort of so many camera paths: one of the visibility term is one search by one of five
/// techniques.
inline int samples_of(Term term, int paths) {
  return term == Term::visibility ? BoundaryGuide::kSearches * paths : paths;
}

/// [column][gate] of one term.
inline std::vector<std::vector<Estimate>> term_means(const Renderer& renderer, Term term, int columns, int gates,
                                                     int samples, int batches, Stream stream) {
  stream.pass = 1 + static_cast<std::uint32_t>(term);
  std::vector<std::vector<Batches>> sums(columns, std::vector<Batches>(gates));
  for (int b = 0; b < batches; ++b) {
    const auto images = renderer.derive(term, stream, {b * samples, (b + 1) * samples});
    for (int c = 0; c < columns; ++c)
      for (int g = 0; g < gates; ++g) sums[c][g].add(images[c].mean(g));
  }
  std::vector<std::vector<Estimate>> out(columns);
  for (int c = 0; c < columns; ++c)
    for (const Batches& s : sums[c]) out[c].push_back(s.estimate());
  return out;
}

/// Mean and standard error of value({seed, ...}) over streams that share nothing, not even the points that cover their samples.
template <class F>
Estimate replicated(int replicates, std::uint32_t seed, F&& value) {
  Batches sum;
  for (int i = 0; i < replicates; ++i) sum.add(value(Stream{seed, static_cast<std::uint32_t>(i), 0}));
  return sum.estimate();
}

/// The derivative of the image's mean under gate 0, all terms together. `renderer` has one column.
inline double total_derivative(const Renderer& renderer, int samples, Stream stream) {
  double sum = 0;
  for (const Term term : kTerms) {
    stream.pass = 1 + static_cast<std::uint32_t>(term);
    sum += renderer.derive(term, stream, {0, samples_of(term, samples)})[0].mean(0);
  }
  return sum;
}

/// Central difference of image means with common random numbers, [gate].
inline std::vector<Estimate> finite_difference(const Scene& scene, const Motion& motion, double step,
                                               const GateSet& gates, const EstimatorOptions& options, int samples,
                                               int batches, Stream stream) {
  Scene above = scene, below = scene;
  motion.apply(above, step);
  motion.apply(below, -step);
  const Renderer renderer_above(above, gates, options), renderer_below(below, gates, options);
  std::vector<Batches> sums(gates.size());
  for (int b = 0; b < batches; ++b) {
    const SampleRange range{b * samples, (b + 1) * samples};
    const GatedImage plus = renderer_above.render(stream, range), minus = renderer_below.render(stream, range);
    for (int g = 0; g < gates.size(); ++g) sums[g].add((plus.mean(g) - minus.mean(g)) / (2 * step));
  }
  std::vector<Estimate> out;
  for (const Batches& s : sums) out.push_back(s.estimate());
  return out;
}

}  // namespace isochron::testing
