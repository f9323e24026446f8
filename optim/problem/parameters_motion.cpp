// Parameters that move something: what they are bound to, and how they move vertices and the pivots that they turn about.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/constants.h"
#include "optim/problem/parameters.h"

namespace isochron {
namespace {

constexpr double kDegree = kPi / 180;

/// Rodrigues' formula.
Vec3 rotate(const Vec3& p, const Vec3& axis, double radians) {
  const double c = std::cos(radians), s = std::sin(radians);
  return c * p + s * cross(axis, p) + (1 - c) * dot(axis, p) * axis;
}

/// Gives each vertex that is selected its place in the selection, and returns these, or -1, for every vertex of the file that
/// the selection names: those that lie at one position move as one, those without a face do not.
std::vector<int> select(const ParameterSpec& spec, const Scene& scene, const Shape& shape, std::vector<int>& slot) {
  const Selection& selection = spec.selection;
  std::vector<int> named, places;
  if (selection.kind == Selection::Kind::list) {
    std::vector<char> listed(shape.file_vertex_count());
    for (const int number : selection.indices) {
      if (number < 0 || number >= shape.file_vertex_count())
        spec.fail("selection", fmt::format("there is no vertex {} in shape '{}'", number, shape.name),
                  fmt::format("0 to {}", shape.file_vertex_count() - 1));
      if (shape.vertex_of_file(number) < 0)
        spec.fail("selection", fmt::format("vertex {} of shape '{}' has no face", number, shape.name));
      if (std::exchange(listed[number], 1)) spec.fail("selection", fmt::format("vertex {} is listed twice", number));
      named.push_back(number);
    }
  } else {
    const Vec3 &lo = selection.min, &hi = selection.max;
    const std::vector<Vec3> positions = shape.file_positions(scene.positions);
    for (int number = 0; number < shape.file_vertex_count(); ++number) {
      const Vec3& p = positions[number];
      const bool inside = selection.kind == Selection::Kind::all ||
                          (p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z);
      if (inside) named.push_back(number);
    }
  }
  slot.assign(shape.vertex_count, -1);
  int count = 0;
  for (const int number : named) {
    const int v = shape.vertex_of_file(number);
    if (v >= 0 && slot[v] < 0) slot[v] = count++;
    places.push_back(v < 0 ? -1 : slot[v]);
  }
  if (count == 0) spec.fail("selection", fmt::format("selects no vertex of shape '{}'", shape.name));
  return places;
}

/// How many of a selection's vertices move by themselves.
int selected_count(const std::vector<int>& slot) {
  return static_cast<int>(std::count_if(slot.begin(), slot.end(), [](int place) { return place >= 0; }));
}

}  // namespace

bool Parameters::bind_move(const ParameterSpec& spec, int first, Unknowns& unknowns) {
  switch (spec.type) {
    case ParameterType::translation:
    case ParameterType::rotation:
    case ParameterType::vertices:
      if (spec.light.empty()) {
        const std::vector<int> shapes = find_shapes(spec);
        std::vector<Motion> motions(shapes.size());
        for (std::size_t i = 0; i < shapes.size(); ++i) {
          motions[i].first_component = first;
          bind_motion(spec, motions[i], shapes[i], unknowns);
        }
        if (spec.type == ParameterType::rotation) bind_pivot(spec, shapes, motions);
        for (std::size_t i = 0; i < shapes.size(); ++i) motions_[shapes[i]].push_back(std::move(motions[i]));
      } else {
        bind_light(spec, first);
      }
      return true;
    case ParameterType::camera_translation:
      camera_motions_.push_back({spec.type, first, spec.direction});
      return true;
    case ParameterType::camera_rotation:
      camera_motions_.push_back({spec.type, first, normalize(spec.axis)});
      return true;
    default:
      return false;
  }
}

void Parameters::bind_light(const ParameterSpec& spec, int first) {
  const int light = find_light(spec);
  const bool turns = spec.type == ParameterType::rotation;
  if (turns && scene_.lights[light].kind == PointLight::Kind::point)
    spec.fail("light", fmt::format("'{}' shines in all directions: turning it changes nothing", spec.light), "a spot");
  if (spec.selection.kind != Selection::Kind::all) spec.fail("selection", "a light has no vertices");
  light_motions_[light].push_back({spec.type, first, turns ? normalize(spec.axis) : spec.direction});
}

void Parameters::bind_motion(const ParameterSpec& spec, Motion& motion, int shape_index, Unknowns& unknowns) {
  const Shape& shape = scene_.shapes[shape_index];
  motion.type = spec.type;
  motion.direction_kind = spec.direction_kind;
  motion.direction = spec.type == ParameterType::rotation ? normalize(spec.axis) : spec.direction;
  const std::vector<int> places = select(spec, scene_, shape, motion.slot);
  if (spec.type != ParameterType::vertices) return;
  const int selected = selected_count(motion.slot), stride = spec.direction_kind == VertexDirection::free ? 3 : 1;
  unknowns.count = stride * selected;
  for (const int place : places)
    for (int axis = 0; axis < stride; ++axis) unknowns.listed.push_back(place < 0 ? -1 : stride * place + axis);
  if (spec.direction_kind != VertexDirection::normal) return;
  const std::vector<Vec3> sums = vertex_normals(scene_);
  motion.normals.resize(selected);
  for (int v = 0; v < shape.vertex_count; ++v) {
    if (motion.slot[v] < 0) continue;
    const Vec3& sum = sums[shape.first_vertex + v];
    const double norm = length(sum);
    if (!(norm > 0))
      spec.fail("direction",
                fmt::format("vertex {} of shape '{}' has no normal", shape.numbers_in_file()[v], shape.name),
                "leave it out by selection");
    motion.normals[motion.slot[v]] = sum / norm;
  }
}

void Parameters::bind_pivot(const ParameterSpec& spec, const std::vector<int>& shapes,
                            std::vector<Motion>& motions) const {
  Vec3 pivot = spec.pivot;
  if (spec.pivot_kind == PivotKind::center) {
    Vec3 sum;
    int count = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      for (std::size_t v = 0; v < motions[i].slot.size(); ++v) {
        if (motions[i].slot[v] < 0) continue;
        sum += scene_.positions[scene_.shapes[shapes[i]].first_vertex + v];
        ++count;
      }
    pivot = sum / count;
  }
  for (Motion& motion : motions) motion.pivot = pivot;
  if (spec.pivot_kind != PivotKind::fixed) bind_carriers(shapes, motions);
}

void Parameters::bind_carriers(const std::vector<int>& shapes, std::vector<Motion>& motions) const {
  const auto moves_all = [&](const Motion& earlier, const Motion& motion) {
    for (std::size_t v = 0; v < motion.slot.size(); ++v)
      if (motion.slot[v] >= 0 && earlier.slot[v] < 0) return false;
    return true;
  };
  // Motions of several shapes are one parameter's where they have the same first component.
  const auto carries = [&](int first_component) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const std::vector<Motion>& earlier = motions_[shapes[i]];
      if (std::none_of(earlier.begin(), earlier.end(), [&](const Motion& each) {
            return each.first_component == first_component && moves_all(each, motions[i]);
          }))
        return false;
    }
    return true;
  };
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::vector<Motion>& earlier = motions_[shapes[i]];
    for (std::size_t m = 0; m < earlier.size(); ++m)
      if (earlier[m].type != ParameterType::vertices && carries(earlier[m].first_component))
        motions[i].carriers.push_back(static_cast<int>(m));
  }
}

void Parameters::turn(const Motion& rotation, const CarriedPoint& pivot, const std::vector<double>& theta, Vec3& p,
                      std::vector<Moved>* tangent) {
  const double radians = theta[rotation.first_component] * kDegree;
  p = pivot.position + rotate(p - pivot.position, rotation.direction, radians);
  if (!tangent) return;
  for (Moved& earlier : *tangent) earlier.velocity = rotate(earlier.velocity, rotation.direction, radians);
  // p = c + R (p_before - c): what moves the pivot c moves p by (1 - R) dc. The unknowns that carry a pivot act on all
  // points that turn about it, so that they are among the earlier ones.
  for (const Moved& of_pivot : pivot.velocity) {
    const Vec3 velocity = of_pivot.velocity - rotate(of_pivot.velocity, rotation.direction, radians);
    const auto same = std::find_if(tangent->begin(), tangent->end(),
                                   [&](const Moved& earlier) { return earlier.column == of_pivot.column; });
    same->velocity += velocity;
  }
  tangent->push_back({rotation.first_component, kDegree * cross(rotation.direction, p - pivot.position)});
}

std::vector<Parameters::CarriedPoint> Parameters::pivots(int shape_index, const std::vector<double>& theta) const {
  const std::vector<Motion>& motions = motions_[shape_index];
  std::vector<CarriedPoint> points(motions.size());
  for (std::size_t m = 0; m < motions.size(); ++m) {
    CarriedPoint& point = points[m];
    point.position = motions[m].pivot;
    for (int carrier : motions[m].carriers) {
      const Motion& motion = motions[carrier];
      if (motion.type == ParameterType::rotation) {
        turn(motion, points[carrier], theta, point.position, &point.velocity);
      } else {
        point.position += theta[motion.first_component] * motion.direction;
        point.velocity.push_back({motion.first_component, motion.direction});
      }
    }
  }
  return points;
}

Vec3 Parameters::move(int shape_index, int v, const std::vector<CarriedPoint>& pivots, const std::vector<double>& theta,
                      std::vector<Moved>* tangent) const {
  Vec3 p = scene_.positions[scene_.shapes[shape_index].first_vertex + v];
  for (std::size_t m = 0; m < motions_[shape_index].size(); ++m) {
    const Motion& motion = motions_[shape_index][m];
    const int slot = motion.slot[v];
    if (slot < 0) continue;
    const auto add = [&](int column, const Vec3& direction) {
      p += theta[column] * direction;
      if (tangent) tangent->push_back({column, direction});
    };
    if (motion.type == ParameterType::translation) {
      add(motion.first_component, motion.direction);
    } else if (motion.type == ParameterType::rotation) {
      turn(motion, pivots[m], theta, p, tangent);
    } else if (motion.direction_kind == VertexDirection::free) {
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 unit;
        unit[axis] = 1;
        add(motion.first_component + 3 * slot + axis, unit);
      }
    } else {
      const bool normal = motion.direction_kind == VertexDirection::normal;
      add(motion.first_component + slot, normal ? motion.normals[slot] : motion.direction);
    }
  }
  return p;
}

void Parameters::move_light(int light, const std::vector<double>& theta, Vec3& position, Vec3& direction,
                            std::vector<Moved>* position_rate, std::vector<Moved>* direction_rate) const {
  position = scene_.lights[light].position;
  direction = scene_.lights[light].direction;
  for (const RigidMotion& motion : light_motions_[light]) {
    const double t = theta[motion.first_component];
    if (motion.type == ParameterType::translation) {
      position += t * motion.direction;
      if (position_rate) position_rate->push_back({motion.first_component, motion.direction});
      continue;
    }
    direction = rotate(direction, motion.direction, t * kDegree);
    if (!direction_rate) continue;
    for (Moved& earlier : *direction_rate) earlier.velocity = rotate(earlier.velocity, motion.direction, t * kDegree);
    direction_rate->push_back({motion.first_component, kDegree * cross(motion.direction, direction)});
  }
  view(theta, true, position, position_rate);
  view(theta, false, direction, direction_rate);
}

void Parameters::view(const std::vector<double>& theta, bool is_point, Vec3& p, std::vector<Moved>* tangent) const {
  if (camera_motions_.empty()) return;
  const Vec3& home = scene_.camera.position;
  if (is_point) {
    p -= home;
    for (const RigidMotion& motion : camera_motions_) {
      if (motion.type != ParameterType::camera_translation) continue;
      p -= theta[motion.first_component] * motion.direction;
      if (tangent) tangent->push_back({motion.first_component, -motion.direction});
    }
  }
  for (auto motion = camera_motions_.rbegin(); motion != camera_motions_.rend(); ++motion) {
    if (motion->type != ParameterType::camera_rotation) continue;
    const double radians = -theta[motion->first_component] * kDegree;
    p = rotate(p, motion->direction, radians);
    if (!tangent) continue;
    for (Moved& earlier : *tangent) earlier.velocity = rotate(earlier.velocity, motion->direction, radians);
    tangent->push_back({motion->first_component, -kDegree * cross(motion->direction, p)});
  }
  if (is_point) p += home;
}

}  // namespace isochron
