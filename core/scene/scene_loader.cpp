#include "core/scene/scene_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "core/scene/mesh.h"

namespace isochron {

namespace {

void describe(Keys& keys, Material& material, bool& grey) {
  std::vector<Keys::Kind> kinds;
  for (const MaterialKind* kind : material_kinds()) kinds.push_back({kind->name, kind->meaning});
  const auto choose = [&](const std::string& kind) { material = Material(kind, material.name); };
  const auto describe_kind = [&](Keys& inner, const std::string& kind) {
    if (kind == material.kind()) return material.bsdf().describe(inner, grey);
    bool ignored = true;
    Material(kind).bsdf().describe(inner, ignored);
  };
  keys.kinds("type", kinds, material.kind(), choose, describe_kind, "how it scatters light");
}

/// Scale, then rotation, then translation.
struct Transform {
  double scale = 1, degrees = 0;
  Vec3 axis{0, 0, 1}, translation;
};

void describe(Keys& keys, Transform& transform) {
  keys.value("scale", field::positive(transform.scale), "first, about the origin");
  const auto rotation = [&](Keys& inner) {
    inner.value("axis", unit_direction(transform.axis), "by the right-hand rule", {.required = true});
    inner.value("degrees", field::number(transform.degrees), "", {.required = true, .unit = "degrees"});
  };
  keys.map("rotate", rotation, "second, about the origin", {.otherwise = "none"});
  keys.value("translate", field::vec3(transform.translation), "last", {.unit = "scene units"});
}

void transform_mesh(const Transform& transform, Mesh& mesh) {
  const double angle = transform.degrees * kPi / 180;
  const double cosine = std::cos(angle), sine = std::sin(angle);
  const Vec3& axis = transform.axis;
  const auto move = [&](Vec3& p) {
    const Vec3 q = p * transform.scale;
    const Vec3 rotated = angle == 0 ? q : q * cosine + cross(axis, q) * sine + axis * (dot(axis, q) * (1 - cosine));
    p = rotated + transform.translation;
  };
  for (Vec3& p : mesh.positions) move(p);
  if (!mesh.file_vertices) return;
  for (Vec3& p : mesh.file_vertices->loose) move(p);
}

/// Normals are computed from cross products, which must not vanish or overflow.
void check_areas(const YamlValue& cause, const Mesh& mesh) {
  for (const auto& face : mesh.faces) {
    const Vec3& a = mesh.positions[face[0]];
    const double area = length_squared(cross(mesh.positions[face[1]] - a, mesh.positions[face[2]] - a));
    if (!(area > 0) || !std::isfinite(area))
      cause.fail("gives a face whose area vanishes or overflows", "sizes that a double can hold");
  }
}

/// Throws InputError unless the mesh bounds a solid: every edge has two faces, which run along it in opposite directions, or
/// pairs of such faces, each about a sector that is all inside or all outside.
void check_solid(const Mesh& mesh, const std::vector<Edge>& edges) {
  const auto along = [&](int face, const Edge& edge) {
    return runs_along(mesh.faces[face], edge.vertex[0], edge.vertex[1]);
  };
  for (const Edge& edge : edges) {
    const auto complain = [&](const char* what) {
      const Vec3 &a = mesh.positions[edge.vertex[0]], &b = mesh.positions[edge.vertex[1]];
      throw InputError(
          fmt::format("a transparent material needs a closed surface; {} ({:.6g}, {:.6g}, {:.6g}) to "
                      "({:.6g}, {:.6g}, {:.6g})",
                      what, a.x, a.y, a.z, b.x, b.y, b.z));
    };
    if (edge.face[1] < 0) complain("this one ends at the edge from");
    if (along(edge.face[0], edge) == along(edge.face[1], edge))
      complain("the faces of this one disagree about its outside at the edge from");
  }
}

/// A shape of the file, before its mesh is read.
struct ShapeKeys {
  Shape shape;
  Transform transform;
  Keys::Places places;
};

Mesh read_shape_mesh(const ShapeKeys& keys, bool solid, std::vector<Edge>& edges) {
  Mesh mesh;
  const std::string& path = keys.shape.file;
  const YamlValue& file = keys.places.at("file");
  try {
    const Mesh raw = read_mesh(path);
    try {
      mesh = clean_mesh(raw);
      edges = build_edges(mesh);
      if (solid) check_solid(mesh, edges);
    } catch (const InputError& error) {
      throw InputError(path + ": " + error.what());
    }
  } catch (const InputError& error) {
    file.fail(error.what());
  }
  const bool transformed = keys.places.contains("transform");
  if (transformed) transform_mesh(keys.transform, mesh);
  const YamlValue& cause = transformed ? keys.places.at("transform") : file;
  check_areas(cause, mesh);
  for (const Vec3& p : mesh.positions)
    if (!coordinates_fit(p))
      cause.fail("puts a vertex too far away", fmt::format("coordinates of at most {}", kLargestCoordinate));
  return mesh;
}

/// The shape with its mesh becomes part of the scene.
void add_shape(const ShapeKeys& keys, Scene& scene) {
  Shape shape = keys.shape;
  const bool transparent = scene.materials[shape.material].bsdf().transparent();
  if (transparent && shape.emission.emits())
    keys.places.at("emission")
        .fail(fmt::format("a shape of {} emits nothing", scene.materials[shape.material].kind()), "leave it out");
  const YamlValue& file = keys.places.at("file");
  std::vector<Edge> edges;
  const Mesh mesh = read_shape_mesh(keys, transparent, edges);
  constexpr std::size_t kMost = std::numeric_limits<int>::max() / 16;  // degrees of freedom are counted by int
  if (scene.positions.size() + mesh.positions.size() > kMost || scene.triangles.size() + mesh.faces.size() > kMost)
    file.fail("the scene has too many vertices or triangles", fmt::format("at most {} of each", kMost));
  const std::size_t stacked = scene.stacked.size();
  add_shape(scene, std::move(shape), mesh, edges);
  if (transparent && scene.stacked.size() > stacked) {
    const Vec3& p = scene.positions[scene.triangles[scene.stacked[stacked][0]].vertex[0]];
    file.fail(
        fmt::format("a transparent material needs a surface that lies nowhere on itself; this one does at the face "
                    "of ({:.6g}, {:.6g}, {:.6g})",
                    p.x, p.y, p.z));
  }
}

/// The name of one of the scene's materials.
Field material_name(const Scene& scene, int& index) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const Material& material : scene.materials) names.emplace_back(material.name, "");
  Field name = field::choice(
      names, [&index](int i) { index = i; }, [&scene, &index] { return yaml_text(scene.materials[index].name); });
  name.allowed = "a name of `materials`";
  return name;
}

void describe(Keys& keys, ShapeKeys& entry, Scene& scene) {
  Shape& shape = entry.shape;
  const auto check_name = [&](const YamlValue& value) {
    if (scene.find_shape(shape.name) >= 0)
      value.fail("'" + shape.name + "' is an earlier shape's name", "names differ");
  };
  const auto find_file = [&](const YamlValue& value) {
    shape.file = (std::filesystem::path(value.file()).parent_path() / shape.file).lexically_normal().string();
  };
  keys.remember(entry.places);
  keys.value("name", field::checked(field::text(shape.name), check_name), "unique", {.required = true});
  keys.value("file", field::checked(field::text(shape.file), find_file),
             "mesh (OBJ, PLY, OFF, STL), relative to the scene file", {.required = true});
  keys.value("material", material_name(scene, shape.material), "of all its faces", {.required = true});
  keys.value("emission", shape.emission.field(scene.grey), "radiance, on the normal's side");
  keys.map("transform", [&](Keys& inner) { describe(inner, entry.transform); }, "of the mesh", {.otherwise = "none"});
  keys.check([&](const YamlValue&) { add_shape(entry, scene); });
}

/// The size of a capture's images, and their place amid the sensor points.
Camera camera_of(const Capture& capture) {
  Camera camera;
  camera.width = capture.columns;
  camera.height = capture.image_rows();
  Vec3 sum;
  for (const WallPoint& s : capture.sensor) sum += s.p;
  camera.position = sum / static_cast<double>(capture.sensor.size());
  camera.look_at = camera.position + capture.sensor[0].n;
  camera.up = std::abs(capture.sensor[0].n.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  return camera;
}

/// Largest coordinate of all that the scene holds, and the diagonal of the box around it.
std::pair<double, double> reach_and_size(const Scene& scene) {
  Vec3 low = scene.camera.position, high = low;
  const auto add = [&](const Vec3& p) {
    for (int axis = 0; axis < 3; ++axis)
      low[axis] = std::min(low[axis], p[axis]), high[axis] = std::max(high[axis], p[axis]);
  };
  for (const Vec3& p : scene.positions) add(p);
  for (const PointLight& light : scene.lights) add(light.position);
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis) reach = std::max({reach, std::abs(low[axis]), std::abs(high[axis])});
  return {reach, length(high - low)};
}

/// Rays start 2^-20 of the largest coordinate off surfaces, as single precision cannot tell less: a thousandth of the scene is
/// too much.
void check_place(const Scene& scene, const YamlValue& shapes) {
  constexpr double kMost = 0x1p20 / 1000;
  const auto [reach, size] = reach_and_size(scene);
  if (reach > kMost * size)
    shapes.fail(
        fmt::format("the scene of size {:.3g} lies at coordinates of {:.3g}, where rays, in single precision, do not "
                    "see it",
                    size, reach),
        "at most a thousand times its size, as by `transform: {translate: ...}` of every shape");
}

void describe_light(Keys& keys, PointLight& light, Scene& scene) {
  const PointLight* first = scene.lights.data();
  describe(keys, light, scene.grey);
  keys.check([&, first](const YamlValue& value) {
    for (const PointLight* other = first; other != &light; ++other)
      if (other->name == light.name) value.fail("'" + light.name + "' is an earlier light's name", "names differ");
    if (!coordinates_fit(light.position))
      value.fail("lies too far away", fmt::format("coordinates of at most {}", kLargestCoordinate));
  });
}

void describe(Keys& keys, Scene& scene) {
  Keys::Places places;
  keys.remember(places);
  Capture capture;
  keys.map("capture", [&](Keys& inner) { describe(inner, capture); },
           "a wall that a detector looks at point by point, while a laser lights it; in place of a camera",
           {.otherwise = "a camera"});
  const bool captured = places.contains("capture");
  if (captured) {
    scene.camera = camera_of(capture);
    scene.capture = std::move(capture);
  }
  const Only of_camera{!captured, "cameras", "capture"};
  keys.map("camera", [&](Keys& inner) { describe(inner, scene.camera); }, "where the images are taken",
           {.required = true, .only = of_camera});
  const auto material = [&](Keys& inner, const std::string& name) {
    describe(inner, scene.materials.emplace_back(material_kinds()[0]->name, name), scene.grey);
  };
  keys.named("materials", {}, material, "what shapes are made of", {.required = true});
  if (places.contains("materials") && scene.materials.empty())
    places.at("materials").fail("has no material", "at least one");
  std::vector<ShapeKeys> shapes;
  keys.list("shapes", shapes, [&](Keys& inner, ShapeKeys& shape) { describe(inner, shape, scene); },
            "what the camera sees and what lights it", {.required = true});
  keys.list("lights", scene.lights, [&](Keys& inner, PointLight& light) { describe_light(inner, light, scene); },
            "lights without an extent", {.only = of_camera, .unset = scene.lights.empty()});
  keys.check([&](const YamlValue&) {
    const YamlValue& value = places.at("shapes");
    if (scene.shapes.empty()) value.fail("has no shape", "at least one");
    const bool emits = std::any_of(scene.shapes.begin(), scene.shapes.end(),
                                   [](const Shape& shape) { return shape.emission.emits(); });
    if (scene.capture && emits) value.fail("a shape emits light", "none in a capture: only its laser emits light");
    if (!scene.capture && !emits && scene.lights.empty())
      value.fail("no shape emits light", "emission above 0 on at least one, or `lights`");
    check_place(scene, value);
  });
}

}  // namespace

Scene load_scene(const std::string& file) {
  Scene scene;
  read_keys(open_yaml(file), [&](Keys& keys) { describe(keys, scene); });
  return scene;
}

std::string scene_reference() {
  Scene scene;
  return reference_tables([&](Keys& keys) { describe(keys, scene); });
}

}  // namespace isochron
