#include "core/scene/emitters/point.h"

#include "core/scene/sensors/pinhole.h"

namespace isochron {

void describe(Keys& keys, PointLight& light, bool& grey) {
  using Kind = PointLight::Kind;
  keys.value("name", field::text(light.name), "unique", {.required = true});
  const auto choose = [&](int i) { light.kind = i == 0 ? Kind::point : Kind::spot; };
  keys.value("type",
             field::choice({{"point", "shines in all directions"}, {"spot", "shines within a cone"}}, choose,
                           [&] { return light.kind == Kind::point ? "point" : "spot"; }),
             "how it shines", {.required = true});
  keys.value("position", field::vec3(light.position), "where it is", {.required = true, .unit = "scene units"});
  const Only spot{light.kind == Kind::spot, "spot", "point"};
  keys.value("direction", unit_direction(light.direction), "the middle of the cone", {.required = true, .only = spot});
  keys.value("cone", field::number(light.cone, {.low = 0, .high = 180, .low_open = true}),
             "angle from the direction to the edge, where it is dark", {.only = spot, .unit = "degrees"});
  keys.value("blend", field::number(light.blend, {.low = 0, .high = 1, .low_open = true}),
             "the outer part of the cone over which it fades, by smoothstep in the angle", {.only = spot});
  const auto shines = [&light](const YamlValue& value) {
    if (light.intensity.is_black()) value.fail("is black", "a colour with a component above 0");
  };
  keys.value("intensity", field::checked(field::color(light.intensity, NumberRange::non_negative(), grey), shines),
             "radiant intensity, not black; of a spot, inside of its cone", {.required = true});
}

}  // namespace isochron
