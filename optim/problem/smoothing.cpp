#include "optim/problem/smoothing.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace isochron {
namespace {

/// Edges between vertices of the field, as places in it.
std::vector<std::array<int, 2>> edges_of(const Scene& scene, const Parameters::VertexField& field) {
  std::vector<int> place(scene.positions.size(), -1);
  for (std::size_t i = 0; i < field.vertices.size(); ++i) place[field.vertices[i]] = static_cast<int>(i);
  std::vector<std::array<int, 2>> edges;
  for (std::size_t i = 0; i < scene.edges.size(); ++i) {
    const Edge& edge = scene.edges[i];
    if (edge.sector && i > 0 && scene.edges[i - 1].vertex == edge.vertex) continue;  // once, whatever meets there
    const int a = place[edge.vertex[0]], b = place[edge.vertex[1]];
    if (a >= 0 && b >= 0) edges.push_back({a, b});
  }
  return edges;
}

}  // namespace

struct Preconditioner::Impl {
  struct Diffusion {
    int begin, stride, count;  ///< of unknowns; `stride` fields of `count` vertices each, interleaved
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors;
  };
  std::vector<std::unique_ptr<Diffusion>> diffusions;
  std::vector<Parameters::Block> blocks;
};

Preconditioner::Preconditioner() : impl_(std::make_unique<Impl>()) {}
Preconditioner::~Preconditioner() = default;
Preconditioner::Preconditioner(Preconditioner&&) noexcept = default;

bool Preconditioner::empty() const {
  return impl_->diffusions.empty();
}
const std::vector<Parameters::Block>& Preconditioner::blocks() const {
  return impl_->blocks;
}

void Preconditioner::add_diffusion(const Scene& scene, const Parameters::VertexField& field, double lambda) {
  const int count = static_cast<int>(field.vertices.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < count; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [a, b] : edges_of(scene, field)) {
    entries.emplace_back(a, a, lambda);
    entries.emplace_back(b, b, lambda);
    entries.emplace_back(a, b, -lambda);
    entries.emplace_back(b, a, -lambda);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  auto diffusion = std::make_unique<Impl::Diffusion>();
  diffusion->begin = field.begin;
  diffusion->stride = field.stride;
  diffusion->count = count;
  diffusion->factors.compute(matrix);
  if (diffusion->factors.info() != Eigen::Success) throw std::logic_error("diffusion: the matrix is not definite");
  impl_->diffusions.push_back(std::move(diffusion));
  impl_->blocks.push_back({field.name, field.begin, field.stride * count});
}

void Preconditioner::apply(std::vector<double>& values) const {
  for (const auto& diffusion : impl_->diffusions)
    for (int axis = 0; axis < diffusion->stride; ++axis) {
      Eigen::Map<Eigen::VectorXd, 0, Eigen::InnerStride<>> field(
          values.data() + diffusion->begin + axis, diffusion->count, Eigen::InnerStride<>(diffusion->stride));
      const Eigen::VectorXd smooth = diffusion->factors.solve(Eigen::VectorXd(field));
      field = smooth;
    }
}

void QuadraticPenalty::add_slopes(const Scene& scene, const Parameters::VertexField& field, double weight) {
  const auto edges = edges_of(scene, field);
  for (const auto& [a, b] : edges) {
    const Vec3 along = scene.positions[field.vertices[a]] - scene.positions[field.vertices[b]];
    const double w = weight * field.unit * field.unit / (dot(along, along) * static_cast<double>(edges.size()));
    for (int axis = 0; axis < field.stride; ++axis) {
      const int begin = field.begin + axis;
      squares_.push_back({{{{begin + field.stride * a, 1.0}, {begin + field.stride * b, -1.0}}}, w, false});
    }
  }
}

void QuadraticPenalty::add_forms(const std::vector<LinearForm>& forms, double weight) {
  for (const LinearForm& form : forms) squares_.push_back({form, weight, true});
}

void QuadraticPenalty::add_prior(const Parameters::Block& block, const std::vector<double>& means, double width) {
  for (int i = block.begin; i < block.begin + block.count; ++i)
    squares_.push_back({{{{i, 1.0}}, -means[i]}, 0.5 / (width * width), true});
}

double QuadraticPenalty::value(const std::vector<double>& theta, PenaltyScale scale) const {
  double slopes = 0, priors = 0;
  for (const Square& s : squares_) {
    const double form = s.form.at(theta);
    (s.prior ? priors : slopes) += s.weight * form * form;
  }
  return scale.slopes * slopes + scale.priors * priors;
}

bool QuadraticPenalty::holds(const Parameters::Block& block) const {
  return std::any_of(squares_.begin(), squares_.end(), [&](const Square& s) { return s.of(block); });
}

void QuadraticPenalty::add_gradient(const std::vector<double>& theta, PenaltyScale scale,
                                    std::vector<double>& gradient) const {
  for (const Square& s : squares_) {
    const double slope = 2 * s.scaled(scale) * s.form.at(theta);
    for (const auto& [i, factor] : s.form.entries) gradient[i] += slope * factor;
  }
}

void QuadraticPenalty::add_product(PenaltyScale scale, const std::vector<double>& vector,
                                   std::vector<double>& product) const {
  for (const Square& s : squares_) {
    double sum = 0;
    for (const auto& [i, factor] : s.form.entries) sum += factor * vector[i];
    for (const auto& [i, factor] : s.form.entries) product[i] += 2 * s.scaled(scale) * sum * factor;
  }
}

void QuadraticPenalty::add_diagonal(PenaltyScale scale, std::vector<double>& diagonal) const {
  for (const Square& s : squares_)
    for (const auto& [i, factor] : s.form.entries) diagonal[i] += 2 * s.scaled(scale) * factor * factor;
}

void QuadraticPenalty::add_noise(PenaltyScale scale, const Stream& stream, std::uint32_t draw,
                                 std::vector<double>& gradient) const {
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    Rng rng(stream, k, draw);
    const double noise = std::copysign(std::sqrt(2 * squares_[k].scaled(scale)), rng.uniform() - 0.5);
    for (const auto& [i, factor] : squares_[k].form.entries) gradient[i] += noise * factor;
  }
}

std::vector<Coupling> QuadraticPenalty::couplings(PenaltyScale scale) const {
  // A column for each square: the sum of all is the product with the transpose.
  std::vector<Eigen::Triplet<double>> entries;
  int squares = 0, unknowns = 0;
  for (const Square& s : squares_) {
    if (!(s.scaled(scale) > 0) || s.form.entries.size() < 2) continue;
    const double root = std::sqrt(2 * s.scaled(scale));
    for (const auto& [i, factor] : s.form.entries) {
      entries.emplace_back(i, squares, root * factor);
      unknowns = std::max(unknowns, i + 1);
    }
    ++squares;
  }
  Eigen::SparseMatrix<double> forms(unknowns, squares);
  forms.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> sum = forms * forms.transpose();
  std::vector<Coupling> result;
  for (int column = 0; column < unknowns; ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(sum, column); entry; ++entry)
      if (entry.row() > column) result.push_back({static_cast<int>(entry.row()), column, entry.value()});
  return result;
}

void QuadraticPenalty::add_curvature(int unknowns, PenaltyScale scale, std::vector<double>& curvature) const {
  const auto n = static_cast<std::size_t>(unknowns);
  for (const Square& s : squares_)
    for (const auto& [a, of_a] : s.form.entries)
      for (const auto& [b, of_b] : s.form.entries) curvature[a * n + b] += 2 * s.scaled(scale) * of_a * of_b;
}

}  // namespace isochron
