// The files that the fuzzed scenes and experiments may name.
#pragma once
#include "core/scene/scene.h"
#include "core/scene/sensors/pinhole.h"
#include "tests/fuzz/harness.h"

namespace isochron::fuzz {

inline void write_meshes(const Folder& folder) {
  folder.write("quad.obj", "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n");
  folder.write("lamp.off", "OFF\n3 1 0\n0 2 0\n1 2 0\n0 2 1\n3 0 1 2\n");
  folder.write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
}

inline void check_scene(const Scene& scene) {
  const CameraModel camera(scene.camera);
  require(is_finite(camera.direction(0, 0)) && is_finite(camera.direction(camera.width, camera.height)),
          "the camera has directions");
  for (const Vec3& p : scene.positions) require(is_finite(p), "positions are finite");
  for (const Triangle& t : scene.triangles) {
    const Vec3& a = scene.positions.at(t.vertex[0]);
    const Vec3 normal = normalize(cross(scene.positions.at(t.vertex[1]) - a, scene.positions.at(t.vertex[2]) - a));
    require(is_finite(normal), "triangles have normals");
  }
  for (const Shape& s : scene.shapes) scene.materials.at(s.material);
}

}  // namespace isochron::fuzz
