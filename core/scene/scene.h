// The scene as the user describes it: what the loader fills, what parameters move, what the renderer prepares from.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/coordinates.h"
#include "core/scene/emitters/area.h"
#include "core/scene/emitters/point.h"
#include "core/scene/materials/material.h"
#include "core/scene/sensors/capture.h"
#include "core/scene/sensors/pinhole.h"

namespace isochron {

/// Vertex indices into Scene::positions, counter-clockwise seen from the side the normal points to.
struct Triangle {
  std::array<int, 3> vertex;
  int shape;
};

/// Faces whose normals differ by less than this angle are one plane: a file in single precision cannot tell.
inline constexpr double kCoplanarAngle = 1e-6;

/// Whether faces of these unit normals are parallel, and face the same way.
inline bool face_alike(const Vec3& n, const Vec3& m) {
  return dot(n, m) > 0 && length_squared(cross(n, m)) <= kCoplanarAngle * kCoplanarAngle;
}

/// Mesh edge between welded vertices. `face[1]` is -1 on an open border. Where more than two faces meet there are as many
/// entries, one after the other, each for the sector between two faces that are next to each other: from face[0]
/// counter-clockwise about the direction from vertex[0] to vertex[1] to face[1], as the file has them.
struct Edge {
  std::array<int, 2> vertex;
  std::array<int, 2> face;
  bool sector = false;  ///< one of several with these vertices
};

/// The vertices of a mesh file, where they are not one by one those of the shape: some have no face, or lie at one position.
struct FileVertices {
  std::vector<int> vertex;  ///< of the shape, for each of the file; -1: without a face
  std::vector<Vec3> loose;  ///< where those are, in their order; they never move
};

/// Whether a face that has both vertices runs from the first to the second. Of two consistently oriented faces, one does.
inline bool runs_along(const std::array<int, 3>& face, int from, int to) {
  return face[0] == from ? face[1] == to : face[1] == from ? face[2] == to : face[0] == to;
}

/// One mesh: contiguous ranges of Scene::positions, Scene::triangles and Scene::edges.
struct Shape {
  std::string name;
  std::string file;
  int material = 0;
  AreaEmitter emission;
  int first_vertex = 0, vertex_count = 0;
  int first_triangle = 0, triangle_count = 0;
  int first_edge = 0, edge_count = 0;
  bool deforms = false;   ///< parameters may move its vertices otherwise than as a rigid body
  bool textured = false;  ///< what Scene::texture says multiplies its material's BSDF
  bool hidden = false;    ///< points of paths are drawn on it, see HiddenGeometry
  std::shared_ptr<const FileVertices> file_vertices = {};  ///< none: the shape's

  int file_vertex_count() const {
    return file_vertices ? static_cast<int>(file_vertices->vertex.size()) : vertex_count;
  }
  /// The shape's vertex of a number in the file; -1 where it has no face.
  int vertex_of_file(int number) const { return file_vertices ? file_vertices->vertex[number] : number; }
  /// The first number in the file of each of the shape's vertices.
  std::vector<int> numbers_in_file() const;
  /// Of all vertices of the file.
  std::vector<Vec3> file_positions(const std::vector<Vec3>& scene_positions) const;
};

/// What becomes of the light that a pixel receives: a reading is gain x light + background.
struct Detector {
  double gain = 1;
  std::vector<double> background{0};  ///< of every pixel, or one for each sensor point of a capture
  /// Light is counted later by it: as if paths were longer; scene units. Of every pixel, or one for each sensor point.
  std::vector<double> time_offset{0};

  /// Which of the backgrounds is the pixel's.
  int background_of(const std::optional<Capture>& capture, int pixel) const {
    return background.size() == 1 ? 0 : capture->sensor_index(pixel);
  }
  /// Which of the time offsets.
  int time_offset_of(const std::optional<Capture>& capture, int pixel) const {
    return time_offset.size() == 1 ? 0 : capture->sensor_index(pixel);
  }
};

struct Scene {
  /// Where there is a capture only its size, in pixels, and its position, the mean of the sensor points, are used.
  Camera camera;
  std::optional<Capture> capture;  ///< in place of the camera
  Detector detector;
  std::vector<PointLight> lights;
  std::vector<Material> materials;
  std::vector<Shape> shapes;
  std::vector<Vec3> positions;  ///< welded per shape: vertices of one shape at one position are one vertex
  std::vector<double> texture;  ///< per vertex, linear over triangles; empty: no shape is textured
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;
  std::vector<std::array<int, 2>> stacked;  ///< triangles of one shape that lie on each other, see StackedFaces
  bool grey = true;  ///< every albedo, reflectance and emission in the file was given as a single number

  int find_shape(const std::string& name) const;     ///< -1 when there is none
  int find_material(const std::string& name) const;  ///< -1 when there is none
  int find_light(const std::string& name) const;     ///< -1 when there is none
};

/// Of all vertices: sums of their faces' normals, each as long as twice the area; zero where no face of positive area meets.
std::vector<Vec3> vertex_normals(const Scene& scene);

/// Of the camera, lights and all vertices.
bool coordinates_fit(const Scene& scene);

/// Numbers every scalar of the scene that can be differentiated ("degree of freedom"): three per vertex, then those of
/// each material (Bsdf::quantities), three per shape (emission r g b), the texture of each vertex where shapes are textured, nine
/// per light (position, direction, intensity), and what the detector has: gain, time offsets, backgrounds.
struct DofLayout {
  int vertices = 0, shapes = 0, textured = 0, lights = 0, time_offsets = 1, backgrounds = 1;
  std::vector<int> first_number;  ///< of each material, and where emissions begin
  explicit DofLayout(const Scene& scene);
  int materials() const { return static_cast<int>(first_number.size()) - 1; }
  int vertex(int v, int axis) const { return 3 * v + axis; }
  int number(int m, int k) const { return first_number[m] + k; }
  int numbers(int m) const { return first_number[m + 1] - first_number[m]; }
  int emission(int s, int channel) const { return first_number.back() + 3 * s + channel; }
  int texture(int v) const { return emission(shapes, 0) + v; }
  int light_position(int i, int axis) const { return texture(textured) + 9 * i + axis; }
  int light_direction(int i, int axis) const { return light_position(i, 3 + axis); }
  int light_intensity(int i, int channel) const { return light_position(i, 6 + channel); }
  int gain() const { return light_position(lights, 0); }
  int time_offset(int i) const { return gain() + 1 + i; }
  int background(int i) const { return time_offset(time_offsets) + i; }
  int size() const { return background(backgrounds); }
};

/// Sets a degree of freedom that is no vertex's coordinate. Emissions, intensities and the like: of one channel.
void set_value(Scene& scene, int dof, double value);

/// Sparse matrix d(dof)/d(column) in compressed rows: how fast each degree of freedom moves per unit of each column.
/// A column is one scalar unknown. Rows without entries are static. Entries of a row are sorted by column.
struct TangentBasis {
  struct Entry {
    int column;
    double coefficient;
  };
  int columns = 0;
  std::vector<int> row_begin;  ///< size: dofs + 1
  std::vector<Entry> entries;

  bool differentiates(int dof) const { return row_begin[dof] != row_begin[dof + 1]; }
  /// Transpose product: gradient over dofs -> gradient over columns.
  std::vector<double> transpose_apply(const std::vector<double>& dof_gradient) const;
  /// One column: the sum of all, each times its coefficient. Degrees of freedom that only columns of coefficient 0 change are
  /// static in it.
  TangentBasis combined(const std::vector<double>& coefficients) const;
};

}  // namespace isochron
