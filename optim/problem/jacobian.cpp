#include "optim/problem/jacobian.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/parallel.h"
#include "core/films/sinks.h"

namespace isochron {
namespace {

/// Bytes of derivative images, and of partial sums of the renderer's work partitions (about 8), that are alive at a time.
constexpr double kGroupBytes = 1e9, kImagesPerUnknown = 8 + 2;

/// Matrices of unknowns x unknowns that one step of Levenberg-Marquardt holds; errors take less.
constexpr double kSquareMatrices = 8;

/// Adds the derivative images, or central differences, of one half of the samples to the columns of `jacobian`.
void add_half(const Problem& problem, const std::vector<double>& theta, const TangentBasis& all,
              std::uint32_t iteration, int half, JacobianHalves& jacobian) {
  const SampleSpec& samples = problem.experiment().samples;
  const auto add = [&](int column, const GatedImage& image) {
    double* entry = jacobian.half[half].data() + jacobian.residuals * static_cast<std::size_t>(column);
    parallel_ranges(image.data.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) entry[i] += image.data[i];
    });
  };
  const int columns = static_cast<int>(jacobian.unknowns);
  if (problem.by_differences()) {
    for (int i = 0; i < columns; ++i) {
      add(i, problem.finite_difference(theta, i, problem.stream(Pass::finite_difference, iteration),
                                       half_of(samples.primal, half)));
    }
    return;
  }
  const Scene scene = problem.parameters().apply(theta);
  const double bytes = 8.0 * static_cast<double>(jacobian.residuals) * kImagesPerUnknown;
  const int group = std::max(1, static_cast<int>(std::min(kGroupBytes / bytes, 1e6)));
  for (int first = 0; first < columns; first += group) {
    const TangentBasis basis = select_columns(all, first, std::min(group, columns - first));
    const Renderer renderer = problem.renderer(scene, problem.estimator(samples.visibility), &basis);
    for (Term term : kTerms) {
      if (samples.term(term) == 0) continue;
      const auto images =
          renderer.derive(term, problem.stream(pass_of(term), iteration), half_of(samples.term(term), half));
      for (int i = 0; i < basis.columns; ++i) add(first + i, images[i]);
    }
  }
}

}  // namespace

double residual_count(const Problem& problem) {
  const Camera& camera = problem.scene().camera;
  return 1.0 * camera.width * camera.height * problem.gates().size() * (problem.scene().grey ? 1 : 3);
}

double linearisation_bytes(const Problem& problem, double columns) {
  return 8 * (2 * residual_count(problem) * columns + kSquareMatrices * columns * columns);
}

JacobianHalves render_jacobian(const Problem& problem, const std::vector<double>& theta, const TangentBasis& basis,
                               std::uint32_t iteration) {
  const bool differences = problem.by_differences();
  JacobianHalves jacobian(static_cast<std::size_t>(residual_count(problem)),
                          differences ? theta.size() : static_cast<std::size_t>(basis.columns));
  for (const int half : {0, 1}) add_half(problem, theta, basis, iteration, half, jacobian);
  return jacobian;
}

SampleRange half_of(int samples, int half) {
  const int count = (samples + 1) / 2;
  return {half * count, (half + 1) * count};
}

std::vector<std::vector<double>> probe_readings(const Problem& problem, const std::vector<double>& theta,
                                                const std::vector<double>& weights, std::uint32_t iteration,
                                                Probes probes, std::uint32_t rendered) {
  std::vector<std::vector<double>> products;
  for (int done = 0; done < probes.count; done += kAdjointsTogether) {
    std::vector<GatedImage> signs(std::min(kAdjointsTogether, probes.count - done), problem.blank());
    parallel(static_cast<int>(signs.size()), [&](int k) {
      const auto probe = static_cast<std::uint32_t>(probes.first + done + k);
      std::vector<double>& values = signs[k].data;
      for (std::size_t i = 0; i < values.size(); ++i) {
        Rng rng(problem.stream(Pass::probe, iteration), i, probe);
        values[i] = std::copysign(std::sqrt(weights[i]), rng.uniform() - 0.5);
      }
    });
    for (std::vector<double>& product : problem.transpose_apply(theta, signs, rendered))
      products.push_back(std::move(product));
  }
  return products;
}

std::vector<std::vector<double>> probe_diagonals(const Problem& problem, const std::vector<double>& theta,
                                                 const std::vector<double>& weights, std::uint32_t iteration,
                                                 Probes probes) {
  std::vector<std::vector<double>> diagonals = probe_readings(problem, theta, weights, iteration, probes, iteration);
  for (std::vector<double>& diagonal : diagonals)
    for (double& d : diagonal) d *= d;
  return diagonals;
}

TangentBasis combinations_of(const TangentBasis& basis, const std::vector<std::vector<double>>& coefficients) {
  std::vector<TangentBasis> columns;
  for (const std::vector<double>& c : coefficients) columns.push_back(basis.combined(c));
  TangentBasis all;
  all.columns = static_cast<int>(columns.size());
  all.row_begin = {0};
  for (std::size_t dof = 0; dof + 1 < basis.row_begin.size(); ++dof) {
    for (int i = 0; i < all.columns; ++i)
      for (int e = columns[i].row_begin[dof]; e < columns[i].row_begin[dof + 1]; ++e)
        all.entries.push_back({i, columns[i].entries[e].coefficient});
    all.row_begin.push_back(static_cast<int>(all.entries.size()));
  }
  return all;
}

}  // namespace isochron
