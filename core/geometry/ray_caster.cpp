#include "core/geometry/ray_caster.h"

#include <cmath>
#include <stdexcept>

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

}  // namespace

RayCaster::RayCaster(const Scene& scene) {
  double largest = 0;
  for (const Vec3& p : scene.positions) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const Vec3& c = scene.camera.position;
  largest = std::max({largest, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
  offset_ = largest * 0x1p-20;

  RTCGeometry mesh = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), scene.positions.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), scene.triangles.size()));
  if (!vertices || !indices) throw std::runtime_error("Embree: out of memory for the scene's triangles");
  for (std::size_t i = 0; i < scene.positions.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) vertices[3 * i + axis] = static_cast<float>(scene.positions[i][axis]);
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    for (int corner = 0; corner < 3; ++corner)
      indices[3 * i + corner] = static_cast<unsigned>(scene.triangles[i].vertex[corner]);
  rtcCommitGeometry(mesh);

  scene_ = rtcNewScene(device());
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometry(scene_, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(scene_);
}

RayCaster::~RayCaster() {
  rtcReleaseScene(scene_);
}

}  // namespace isochron
