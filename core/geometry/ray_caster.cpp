#include "core/geometry/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace isochron {
namespace {

/// One Embree device for the process. Default threading: it shares the TBB pool with the renderer.
RTCDevice device() {
  static const RTCDevice shared = [] {
    RTCDevice created = rtcNewDevice("");
    if (!created) throw std::runtime_error("Embree: no device could be made");
    return created;
  }();
  return shared;
}

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("Embree: " + what);
}

}  // namespace

RayCaster::RayCaster(const Scene& scene, CasterUpdate update) : update_(update), offset_(ray_offset(scene)) {
  build(scene);
}

double ray_offset(const Scene& scene) {
  double largest = 0;
  for (const Vec3& p : scene.positions) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const Vec3& c = scene.camera.position;
  largest = std::max({largest, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
  return largest * 0x1p-20;
}

void RayCaster::build(const Scene& scene) {
  scene_.reset(rtcNewScene(device()));
  if (!scene_) fail("a scene could not be made");
  first_.clear();
  if (update_ == CasterUpdate::rebuild) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
    if (!scene.triangles.empty())
      attach(scene, 0, static_cast<int>(scene.positions.size()), 0, static_cast<int>(scene.triangles.size()));
  } else {  // two levels, of which Embree makes only what has changed
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW);
    for (const Shape& shape : scene.shapes)
      attach(scene, shape.first_vertex, shape.vertex_count, shape.first_triangle, shape.triangle_count);
  }
  commit();
}

void RayCaster::commit() {
  rtcGetDeviceError(device());  // what was before is no matter of this scene
  rtcCommitScene(scene_.get());
  const RTCError error = rtcGetDeviceError(device());
  if (error == RTC_ERROR_NONE) return;
  // What is left of the hierarchy would find some triangles, or those of before.
  const bool memory = error == RTC_ERROR_OUT_OF_MEMORY;
  fail(memory ? "out of memory for the hierarchy of the scene's triangles"
              : "the hierarchy of the scene's triangles could not be made (error " + std::to_string(error) + ")");
}

void RayCaster::attach(const Scene& scene, int first_vertex, int vertices, int first_triangle, int triangles) {
  const auto count = [](int n) { return static_cast<std::size_t>(n); };
  RTCGeometry mesh = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions =
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), count(vertices));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), count(triangles)));
  if (!positions || !indices) {
    rtcReleaseGeometry(mesh);
    fail("out of memory for the scene's triangles");
  }
  for (int i = 0; i < triangles; ++i)
    for (int corner = 0; corner < 3; ++corner)
      indices[3 * i + corner] =
          static_cast<unsigned>(scene.triangles[first_triangle + i].vertex[corner] - first_vertex);
  if (update_ == CasterUpdate::refit) rtcSetGeometryBuildQuality(mesh, RTC_BUILD_QUALITY_REFIT);
  const unsigned id = static_cast<unsigned>(first_.size());
  rtcAttachGeometryByID(scene_.get(), mesh, id);
  rtcReleaseGeometry(mesh);
  first_.push_back(first_triangle);
  fill_vertices(scene, id, first_vertex, vertices);
}

void RayCaster::fill_vertices(const Scene& scene, unsigned geometry, int first_vertex, int vertices) const {
  RTCGeometry mesh = rtcGetGeometry(scene_.get(), geometry);
  auto* to = static_cast<float*>(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0));
  for (int i = 0; i < vertices; ++i)
    for (int axis = 0; axis < 3; ++axis) to[3 * i + axis] = static_cast<float>(scene.positions[first_vertex + i][axis]);
  rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(mesh);
}

void RayCaster::update(const Scene& scene, const std::vector<char>& moved_shapes) {
  if (std::find(moved_shapes.begin(), moved_shapes.end(), 1) == moved_shapes.end()) return;
  offset_ = ray_offset(scene);
  if (update_ == CasterUpdate::rebuild) {
    build(scene);
    return;
  }
  for (std::size_t s = 0; s < moved_shapes.size(); ++s)
    if (moved_shapes[s])
      fill_vertices(scene, static_cast<unsigned>(s), scene.shapes[s].first_vertex, scene.shapes[s].vertex_count);
  commit();
}

}  // namespace isochron
