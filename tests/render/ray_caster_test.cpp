// What becomes of a scene that Embree has no memory for.
#include "core/geometry/ray_caster.h"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/render/scene_building.h"

namespace isochron {
namespace {

/// Refuses one of Embree's requests for memory.
struct Refusal {
  std::atomic<int> requests{0};
  int refused;
  static bool grants(void* refusal, ssize_t bytes, bool) {
    auto& self = *static_cast<Refusal*>(refusal);
    return bytes <= 0 || self.requests++ != self.refused;
  }
};

TEST(RayCaster, SaysThatThereIsTooLittleMemory) {
  Scene scene;
  testing::add_shape(scene, "field", testing::height_field(30, 30, -1, 1, [](double x, double z) { return x * z; }),
                     testing::diffuse(Rgb(0.5)));
  const RayCaster first(scene);
  const RTCDevice device = rtcGetSceneDevice(first.embree_scene());
  for (const CasterUpdate update : {CasterUpdate::rebuild, CasterUpdate::refit}) {
    Refusal none{.refused = -1};
    rtcSetDeviceMemoryMonitorFunction(device, &Refusal::grants, &none);
    { const RayCaster enough(scene, update); }
    ASSERT_GT(none.requests, 0);
    for (int i = 0; i < none.requests; ++i) {
      Refusal refusal{.refused = i};
      rtcSetDeviceMemoryMonitorFunction(device, &Refusal::grants, &refusal);
      try {
        const RayCaster caster(scene, update);
        // The blocks that a build takes differ from one to the next: the last may not have been asked for.
        EXPECT_LE(refusal.requests, i);
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()).substr(0, 21), "Embree: out of memory") << error.what();
      }
    }
  }
  rtcSetDeviceMemoryMonitorFunction(device, nullptr, nullptr);
  rtcReleaseDevice(device);
  const RayCaster after(scene);
  EXPECT_GE(after.closest_hit({0.1, 2, 0.2}, {0, -1, 0}), 0) << "what was refused is no matter of later scenes";
}

}  // namespace
}  // namespace isochron
