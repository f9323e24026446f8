#include "core/scene/sensors/pinhole.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scene/coordinates.h"

namespace isochron {
namespace {

constexpr int kLargestResolution = 32768;  // so that the number of pixels fits an int

/// As `normalize`, for a vector so long or short that its length squared is no double.
Vec3 unit(const Vec3& v) {
  return normalize(v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
}

void check_camera(const Camera& camera, const Keys::Places& places) {
  const YamlValue &position = places.at("position"), &look_at = places.at("look_at");
  if (!coordinates_fit(camera.position))
    position.fail("lies too far away", fmt::format("coordinates of at most {}", kLargestCoordinate));
  if (camera.look_at == camera.position) look_at.fail("is the camera's position", "a point away from it");
  if (!std::isnormal(length_squared(camera.look_at - camera.position)))
    look_at.fail("lies too near the camera's position or too far away", "a distance whose square a double can hold");
  // What is left of the cross product of two parallel vectors is round-off of this relative size.
  constexpr double kParallel = 16 * std::numeric_limits<double>::epsilon();
  const Vec3 forward = unit(camera.look_at - camera.position);
  if (length(cross(forward, unit(camera.up))) <= kParallel)
    (places.contains("up") ? places.at("up") : look_at)
        .fail("up is parallel to the line of sight", "any other direction");
}

}  // namespace

Field unit_direction(Vec3& variable) {
  return field::checked(field::direction(variable), [&variable](const YamlValue&) { variable = unit(variable); });
}

void describe(Keys& keys, Camera& camera) {
  Keys::Places places;
  keys.remember(places);
  keys.value("position", field::vec3(camera.position), "the pinhole", {.required = true, .unit = "scene units"});
  keys.value("look_at", field::vec3(camera.look_at), "the point in the middle of the image",
             {.required = true, .unit = "scene units"});
  keys.value("up", unit_direction(camera.up), "the direction that is up in the image");
  keys.value("fov", field::number(camera.fov, {.low = 0, .high = 180, .low_open = true, .high_open = true}),
             "field of view, across the image's width", {.required = true, .unit = "degrees"});
  keys.value("resolution", resolution_field(camera.width, camera.height), "of the images",
             {.required = true, .unit = "pixels"});
  keys.check([&](const YamlValue&) { check_camera(camera, places); });
}

Field resolution_field(int& width, int& height) {
  const auto read = [&](const YamlValue& value) {
    const std::vector<YamlValue> sizes = value.list();
    if (sizes.size() != 2) value.fail(fmt::format("a list of {}", sizes.size()), "[width, height]");
    width = static_cast<int>(sizes[0].integer(1, kLargestResolution));
    height = static_cast<int>(sizes[1].integer(1, kLargestResolution));
  };
  return {"[width, height]", fmt::format("1 to {} each", kLargestResolution), read,
          [&] { return fmt::format("[{}, {}]", width, height); }};
}

}  // namespace isochron
