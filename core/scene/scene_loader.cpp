#include "core/scene/scene_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "core/scene/mesh.h"

namespace isochron {
namespace {

constexpr int kLargestResolution = 32768;  // so that the number of pixels fits an int

const std::string kCoordinates = fmt::format("coordinates of at most {}", kLargestCoordinate);

/// As `normalize`, for a vector so long or short that its length squared is no double.
Vec3 unit(const Vec3& v) {
  return normalize(v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
}

Camera read_camera(const YamlValue& value) {
  YamlMap map = value.map();
  Camera camera;
  const YamlValue position = map.require("position");
  camera.position = position.vec3();
  const YamlValue look_at = map.require("look_at");
  camera.look_at = look_at.vec3();
  const std::optional<YamlValue> up = map.find("up");
  if (up) camera.up = unit(up->direction());
  camera.fov = map.require("fov").number({.low = 0, .high = 180, .low_open = true, .high_open = true});
  const auto [width, height] = read_resolution(map.require("resolution"));
  camera.width = width;
  camera.height = height;
  map.reject_unknown();

  if (!coordinates_fit(camera.position)) position.fail("lies too far away", kCoordinates);
  if (camera.look_at == camera.position) look_at.fail("is the camera's position", "a point away from it");
  if (!std::isnormal(length_squared(camera.look_at - camera.position)))
    look_at.fail("lies too near the camera's position or too far away", "a distance whose square a double can hold");
  // What is left of the cross product of two parallel vectors is round-off of this relative size.
  constexpr double kParallel = 16 * std::numeric_limits<double>::epsilon();
  const Vec3 forward = unit(camera.look_at - camera.position);
  if (length(cross(forward, unit(camera.up))) <= kParallel)
    (up ? *up : look_at).fail("up is parallel to the line of sight", "any other direction");
  return camera;
}

Material read_material(const std::string& name, const YamlValue& value, bool& grey) {
  const NumberRange unit = NumberRange::closed(0, 1);
  YamlMap map = value.map();
  Material material;
  material.name = name;
  const YamlValue type = map.require("type");
  material.type = static_cast<MaterialType>(type.choice({"diffuse", "rough_conductor", "rough_dielectric"}));
  if (material.type == MaterialType::diffuse) material.albedo = map.require("albedo").color(unit, grey);
  if (material.type == MaterialType::rough_conductor) material.albedo = map.require("reflectance").color(unit, grey);
  if (material.type != MaterialType::diffuse)
    material.roughness = map.require("roughness").number({.low = 0, .high = 1, .low_open = true});
  if (material.type == MaterialType::rough_dielectric) {
    material.albedo = Rgb(1);
    const YamlValue ior = map.require("ior");
    material.ior = ior.number(NumberRange::positive());
    if (material.ior == 1) ior.fail("1 is no boundary", "a number above 0 other than 1");
  } else if (const auto two_sided = map.find("two_sided")) {
    material.two_sided = two_sided->boolean();
  }
  map.reject_unknown();
  return material;
}

std::vector<Material> read_materials(const YamlValue& value, bool& grey) {
  std::vector<Material> materials;
  YamlMap map = value.map();
  for (const auto& [name, entry] : map.entries()) materials.push_back(read_material(name, entry, grey));
  if (materials.empty()) value.fail("has no material", "at least one");
  return materials;
}

/// Scale, then rotation, then translation.
void transform_mesh(const YamlValue& value, Mesh& mesh) {
  YamlMap map = value.map();
  double scale = 1, angle = 0;
  Vec3 axis{0, 0, 1}, translation;
  if (const auto factor = map.find("scale")) scale = factor->number(NumberRange::positive());
  if (const auto rotate = map.find("rotate")) {
    YamlMap rotation = rotate->map();
    axis = unit(rotation.require("axis").direction());
    angle = rotation.require("degrees").number() * kPi / 180;
    rotation.reject_unknown();
  }
  if (const auto translate = map.find("translate")) translation = translate->vec3();
  map.reject_unknown();

  const double cosine = std::cos(angle), sine = std::sin(angle);
  for (Vec3& p : mesh.positions) {
    const Vec3 q = p * scale;
    const Vec3 rotated = angle == 0 ? q : q * cosine + cross(axis, q) * sine + axis * (dot(axis, q) * (1 - cosine));
    p = rotated + translation;
  }
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

/// Throws InputError unless the mesh bounds a solid: every edge has two faces, which run along it in opposite directions.
void check_solid(const Mesh& mesh, const std::vector<Edge>& edges) {
  const auto runs_along = [&](int face, const Edge& edge) {
    const auto& f = mesh.faces[face];
    for (int i = 0; i < 3; ++i)
      if (f[i] == edge.vertex[0]) return f[(i + 1) % 3] == edge.vertex[1];
    return false;
  };
  for (const Edge& edge : edges) {
    const auto complain = [&](const char* what) {
      const Vec3 &a = mesh.positions[edge.vertex[0]], &b = mesh.positions[edge.vertex[1]];
      throw InputError(
          fmt::format("a rough_dielectric needs a closed surface; {} ({:.6g}, {:.6g}, {:.6g}) to "
                      "({:.6g}, {:.6g}, {:.6g})",
                      what, a.x, a.y, a.z, b.x, b.y, b.z));
    };
    if (edge.face[1] < 0) complain("this one ends at the edge from");
    if (runs_along(edge.face[0], edge) == runs_along(edge.face[1], edge))
      complain("the faces of this one disagree about its outside at the edge from");
  }
}

Mesh read_shape_mesh(const YamlValue& file, const std::string& path, const std::optional<YamlValue>& transform,
                     bool solid, std::vector<Edge>& edges) {
  Mesh mesh;
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
  if (transform) transform_mesh(*transform, mesh);
  const YamlValue& cause = transform ? *transform : file;
  check_areas(cause, mesh);
  for (const Vec3& p : mesh.positions)
    if (!coordinates_fit(p)) cause.fail("puts a vertex too far away", kCoordinates);
  return mesh;
}

void read_shape(const YamlValue& value, Scene& scene) {
  YamlMap map = value.map();
  Shape shape;
  const YamlValue name = map.require("name");
  shape.name = name.text();
  if (scene.find_shape(shape.name) >= 0) name.fail("'" + shape.name + "' is an earlier shape's name", "names differ");

  const YamlValue file = map.require("file");
  shape.file = (std::filesystem::path(value.file()).parent_path() / file.text()).lexically_normal().string();

  const YamlValue material = map.require("material");
  std::vector<std::string> known;
  for (const Material& m : scene.materials) known.push_back(m.name);
  shape.material = material.choice(known);

  if (const auto emission = map.find("emission"))
    shape.emission = emission->color(NumberRange::non_negative(), scene.grey);
  const bool dielectric = scene.materials[shape.material].type == MaterialType::rough_dielectric;
  if (dielectric && !shape.emission.is_black())
    map.find("emission")->fail("a shape of rough_dielectric emits nothing", "leave it out");
  const std::optional<YamlValue> transform = map.find("transform");
  map.reject_unknown();

  std::vector<Edge> edges;
  const Mesh mesh = read_shape_mesh(file, shape.file, transform, dielectric, edges);
  constexpr std::size_t kMost = std::numeric_limits<int>::max() / 16;  // degrees of freedom are counted by int
  if (scene.positions.size() + mesh.positions.size() > kMost || scene.triangles.size() + mesh.faces.size() > kMost)
    file.fail("the scene has too many vertices or triangles", fmt::format("at most {} of each", kMost));

  shape.first_vertex = static_cast<int>(scene.positions.size());
  shape.vertex_count = static_cast<int>(mesh.positions.size());
  shape.first_triangle = static_cast<int>(scene.triangles.size());
  shape.triangle_count = static_cast<int>(mesh.faces.size());
  const int index = static_cast<int>(scene.shapes.size());
  const int v = shape.first_vertex, t = shape.first_triangle;
  scene.positions.insert(scene.positions.end(), mesh.positions.begin(), mesh.positions.end());
  for (const auto& f : mesh.faces) scene.triangles.push_back({{f[0] + v, f[1] + v, f[2] + v}, index});
  for (const Edge& e : edges) {
    const int other = e.face[1] < 0 ? -1 : e.face[1] + t;
    scene.edges.push_back({{e.vertex[0] + v, e.vertex[1] + v}, {e.face[0] + t, other}});
  }
  scene.shapes.push_back(std::move(shape));
}

}  // namespace

std::array<int, 2> read_resolution(const YamlValue& value) {
  const std::vector<YamlValue> sizes = value.list();
  if (sizes.size() != 2) value.fail(fmt::format("a list of {}", sizes.size()), "[width, height]");
  const auto size = [&](int i) { return static_cast<int>(sizes[i].integer(1, kLargestResolution)); };
  return {size(0), size(1)};
}

Scene load_scene(const std::string& file) {
  Scene scene;
  YamlMap map = open_yaml(file).map();
  scene.camera = read_camera(map.require("camera"));
  scene.materials = read_materials(map.require("materials"), scene.grey);
  const YamlValue shapes = map.require("shapes");
  const std::vector<YamlValue> entries = shapes.list();
  map.reject_unknown();
  if (entries.empty()) shapes.fail("has no shape", "at least one");
  for (const YamlValue& entry : entries) read_shape(entry, scene);
  const bool lit = std::any_of(scene.shapes.begin(), scene.shapes.end(),
                               [](const Shape& shape) { return !shape.emission.is_black(); });
  if (!lit) shapes.fail("no shape emits light", "emission above 0 on at least one");
  return scene;
}

}  // namespace isochron
