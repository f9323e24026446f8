#include "optim/run/next_level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "optim/remesh/outline.h"
#include "optim/remesh/remesh.h"

namespace isochron {
namespace {

using SurfaceField = LevelSurface::Field;

bool moves(const ParameterSpec& spec) {
  using enum ParameterType;
  return spec.type == translation || spec.type == rotation || spec.type == vertices ||
         spec.type == camera_translation || spec.type == camera_rotation;
}

std::vector<double> part(const std::vector<double>& values, const Parameters::Block& block) {
  return {values.begin() + block.begin, values.begin() + block.begin + block.count};
}

/// The values of one of the surface's fields; null where it has no such field.
const std::vector<double>* find(const LevelSurface& surface, int parameter, const std::string& quantity) {
  for (const SurfaceField& field : surface.fields)
    if (field.parameter == parameter && field.quantity == quantity) return &field.values;
  return nullptr;
}

/// Its vertices are those of a clean mesh: a fit may bring two of them to one place.
LevelSurface cleaned(const LevelSurface& surface) {
  LevelSurface result{clean_mesh(surface.mesh), surface.fields};
  if (!result.mesh.file_vertices) return result;
  const std::vector<int>& vertex = result.mesh.file_vertices->vertex;
  for (SurfaceField& field : result.fields) {
    const std::vector<double> old = std::exchange(field.values, {});
    field.values.resize(result.mesh.positions.size() * field.columns);
    for (std::size_t v = vertex.size(); v-- > 0;)  // so that of several the first is left
      if (vertex[v] >= 0)
        std::copy_n(old.begin() + static_cast<std::ptrdiff_t>(v) * field.columns, field.columns,
                    field.values.begin() + static_cast<std::ptrdiff_t>(vertex[v]) * field.columns);
  }
  result.mesh.file_vertices.reset();
  return result;
}

LevelSurface carried_over(const LevelSurface& old, const Remeshed& made_of_it) {
  LevelSurface next{made_of_it.mesh, old.fields};
  for (SurfaceField& field : next.fields) field.values = carry_over(made_of_it, old.mesh, field.values, field.columns);
  return next;
}

}  // namespace

const ParameterSpec* remeshed_parameter(const Experiment& experiment) {
  for (const ParameterSpec& spec : experiment.parameters)
    if (spec.remesh.levels > 0) return &spec;
  return nullptr;
}

Mesh mesh_of(const Scene& scene, const std::string& name) {
  const Shape& shape = scene.shapes[scene.find_shape(name)];
  const auto first = scene.positions.begin() + shape.first_vertex;
  Mesh mesh{{first, first + shape.vertex_count}, {}};
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    auto face = scene.triangles[t].vertex;
    for (int& v : face) v -= shape.first_vertex;
    mesh.faces.push_back(face);
  }
  return mesh;
}

std::vector<double> offsets_alone(const Problem& problem, std::vector<double> theta, const std::string& shape) {
  const std::vector<ParameterSpec>& specs = problem.experiment().parameters;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const Parameters::Block& block = problem.parameters().blocks()[i];
    const bool of_vertices = specs[i].type == ParameterType::vertices && specs[i].shape == shape;
    if (moves(specs[i]) && !of_vertices) std::fill_n(theta.begin() + block.begin, block.count, 0.0);
  }
  return theta;
}

LevelSurface found_surface(const Problem& problem, const std::vector<double>& theta, const ParameterSpec& remeshed) {
  const Parameters& parameters = problem.parameters();
  const std::vector<ParameterSpec>& specs = problem.experiment().parameters;
  LevelSurface surface;
  surface.mesh = mesh_of(parameters.apply(offsets_alone(problem, theta, remeshed.shape)), remeshed.shape);
  const int vertices = static_cast<int>(surface.mesh.positions.size());
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const Parameters::Block& block = parameters.blocks()[i];
    const auto add = [&](const char* quantity, const std::vector<double>& values) {
      surface.fields.push_back({static_cast<int>(i), quantity, block.count / vertices, values});
    };
    if (specs[i].name == remeshed.name) {
      const std::vector<double> found = part(theta, block);
      const auto shifted = [&](std::vector<double> bounds) {
        for (std::size_t k = 0; k < bounds.size(); ++k) bounds[k] -= found[k];
        return bounds;
      };
      if (!specs[i].lower.empty()) add("lower", shifted(part(parameters.lower(), block)));
      if (!specs[i].upper.empty()) add("upper", shifted(part(parameters.upper(), block)));
    } else if (specs[i].type == ParameterType::texture && specs[i].shape == remeshed.shape) {
      add("initial", part(theta, block));
      if (specs[i].lower.size() > 1) add("lower", part(parameters.lower(), block));
      if (specs[i].upper.size() > 1) add("upper", part(parameters.upper(), block));
    }
  }
  return surface;
}

LevelSurface within_outline(const LevelSurface& surface, const std::vector<ParameterSpec>& parameters, double share,
                            double least_area) {
  const auto is_albedo = [&](const SurfaceField& field) {
    return parameters[field.parameter].type == ParameterType::texture && field.quantity == std::string("initial");
  };
  const auto column = [](const SurfaceField& field, int k) {
    std::vector<double> values;
    for (std::size_t i = k; i < field.values.size(); i += field.columns) values.push_back(field.values[i]);
    return values;
  };
  std::vector<double> albedo(surface.mesh.positions.size(), 0.0);
  for (const SurfaceField& field : surface.fields)
    for (int k = 0; is_albedo(field) && k < field.columns; ++k) {
      const std::vector<double> own = column(field, k);
      for (std::size_t v = 0; v < albedo.size(); ++v) albedo[v] += own[v];
    }
  const Remeshed left = within_outline(surface.mesh, albedo, share, least_area);
  if (left.mesh.faces.empty()) return surface;
  LevelSurface result = carried_over(surface, left);
  for (SurfaceField& field : result.fields)
    for (int k = 0; is_albedo(field) && k < field.columns; ++k) {
      const std::vector<double> typical = typical_albedos(result.mesh, column(field, k));
      for (std::size_t v = 0; v < typical.size(); ++v) field.values[v * field.columns + k] = typical[v];
    }
  return result;
}

LevelSurface without_small_features(const LevelSurface& surface, double edge_length, bool cuts_strips) {
  // A regular triangle's.
  const double least_area = std::sqrt(3.0) / 4 * edge_length * edge_length;
  const auto is_corner = [](const MeshPoint& point) { return std::ranges::max(point.weights) == 1; };
  const auto carried_where_changed = [&](const LevelSurface& old, const Remeshed& left) {
    const bool same = left.mesh.faces.size() == old.mesh.faces.size() && std::ranges::all_of(left.origins, is_corner);
    return same || left.mesh.faces.empty() ? old : carried_over(old, left);
  };
  LevelSurface left = carried_where_changed(surface, without_small_holes(surface.mesh, least_area));
  if (cuts_strips) left = carried_where_changed(left, without_narrow_strips(left.mesh, edge_length));
  return carried_where_changed(left, without_small_parts(left.mesh, least_area));
}

LevelSurface remeshed_surface(const LevelSurface& surface, double edge_length) {
  const LevelSurface old = cleaned(surface);
  return carried_over(old, remesh(old.mesh, edge_length));
}

std::vector<ParameterSpec> next_parameters(const Problem& problem, const std::vector<double>& theta,
                                           const ParameterSpec& remeshed, const LevelSurface& surface) {
  const Parameters& parameters = problem.parameters();
  std::vector<ParameterSpec> specs = problem.experiment().parameters;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    ParameterSpec& spec = specs[i];
    const Parameters::Block& block = parameters.blocks()[i];
    const auto of_surface = [&](const char* quantity, std::vector<double>& values) {
      const std::vector<double>* found = find(surface, static_cast<int>(i), quantity);
      if (found) values = *found;
      return found != nullptr;
    };
    spec.scale = block.scale;
    of_surface("lower", spec.lower);
    of_surface("upper", spec.upper);
    if (spec.name == remeshed.name) {
      spec.remesh = {};
      spec.initial = {0};
      spec.target.clear();
    } else if (of_surface("initial", spec.initial)) {
      if (spec.target.size() > 1) spec.target.clear();
      // Sums of rounded products may leave bounds by a last bit.
      for (std::size_t k = 0; k < spec.initial.size(); ++k) {
        const auto bound = [&](const std::vector<double>& values) { return values[values.size() > 1 ? k : 0]; };
        if (!spec.lower.empty()) spec.initial[k] = std::max(spec.initial[k], bound(spec.lower));
        if (!spec.upper.empty()) spec.initial[k] = std::min(spec.initial[k], bound(spec.upper));
      }
    } else if (spec.prior_width == 0) {
      spec.initial = part(theta, block);
    }
  }
  return specs;
}

}  // namespace isochron
