#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>

#include "optim/experiment/choices.h"
#include "optim/experiment/description.h"

namespace isochron {
namespace {

Field selection(Selection& variable) {
  const auto read = [&variable](const YamlValue& value) {
    if (value.is_list()) {
      variable.kind = Selection::Kind::list;
      for (const YamlValue& entry : value.list())
        variable.indices.push_back(static_cast<int>(entry.integer(0, std::numeric_limits<int>::max())));
      return;
    }
    if (!value.is_map()) value.fail("is neither", "a list of vertex indices, or {box: {min, max}}");
    variable.kind = Selection::Kind::box;
    YamlMap map = value.map(), box = map.require("box").map();
    variable.min = box.require("min").vec3();
    variable.max = box.require("max").vec3();
    box.reject_unknown();
    map.reject_unknown();
  };
  const auto write = [&variable] {
    if (variable.kind == Selection::Kind::list) return fmt::format("[{}]", fmt::join(variable.indices, ", "));
    return fmt::format("{{box: {{min: {}, max: {}}}}}", yaml_vector(variable.min), yaml_vector(variable.max));
  };
  return {"list of integers, or {box: {min, max}}", "indices from 0, or corners [x, y, z]", read, write};
}

Field direction(ParameterSpec& spec) {
  const auto read = [&spec](const YamlValue& value) {
    if (spec.type != ParameterType::vertices || value.is_list())
      spec.direction = value.direction();
    else if (value.is_scalar())
      field::choice(spec.direction_kind).read(value);
    else
      value.fail("is neither", "[x, y, z], normal or free");
  };
  const auto write = [&spec]() -> std::string {
    return spec.direction_kind == VertexDirection::fixed ? yaml_vector(spec.direction) : name_of(spec.direction_kind);
  };
  const Field words = field::choice(spec.direction_kind);
  return {"[x, y, z]; vertices: or a word", "not all zero; " + words.allowed, read, write, words.names};
}

Field pivot(ParameterSpec& spec) {
  const auto read = [&spec](const YamlValue& value) {
    if (value.is_list()) {
      spec.pivot = value.vec3();
    } else if (value.is_map()) {
      spec.pivot_kind = PivotKind::follow;
      read_keys(value, [&](Keys& keys) { keys.value("follow", field::vec3(spec.pivot), "", {.required = true}); });
    } else {
      value.choice({"center"});
      spec.pivot_kind = PivotKind::center;
    }
  };
  const auto write = [&spec]() -> std::string {
    if (spec.pivot_kind == PivotKind::center) return "center";
    const std::string point = yaml_vector(spec.pivot);
    return spec.pivot_kind == PivotKind::follow ? "{follow: " + point + "}" : point;
  };
  return {"[x, y, z], a word or {follow: [x, y, z]}", "`center`", read, write,
          "A list is a point of the world; `center`: the mean of the vertices that turn, as loaded, of all shapes; "
          "`follow`: "
          "a point of the shape, where it is in the scene file"};
}

/// The name of one shape, or several, which change alike.
Field shapes(ParameterSpec& spec) {
  const auto read = [&spec](const YamlValue& value) {
    spec.further_shapes.clear();
    if (!value.is_list()) {
      spec.shape = value.text();
      return;
    }
    using enum ParameterType;
    if (spec.type != translation && spec.type != rotation && spec.type != emission)
      value.fail(fmt::format("a parameter of type {} changes one shape", type_name(spec)),
                 "a name; lists for translation, rotation and emission");
    std::vector<std::string> names;
    field::names(names).read(value);
    std::set<std::string> known;
    for (const std::string& name : names)
      if (!known.insert(name).second) value.fail(fmt::format("'{}' is listed twice", name));
    spec.shape = names[0];
    spec.further_shapes.assign(names.begin() + 1, names.end());
  };
  const auto write = [&spec] {
    std::vector<std::string> names = spec.shapes();
    return spec.further_shapes.empty() ? field::text(spec.shape).write() : field::names(names).write();
  };
  return {"text, or a list of names", "a list: translation, rotation, emission", read, write};
}

/// The quantities of materials are types of their own.
Field type(ParameterSpec& spec) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const Choice<ParameterType>& each : kChoices<ParameterType>) names.emplace_back(each.name, each.meaning);
  const std::size_t fixed = names.size();
  for (const auto& [quantity, kinds] : material_quantities()) names.emplace_back(quantity, "of " + enumeration(kinds));
  const auto choose = [&spec, names, fixed](int i) {
    const bool of_material = static_cast<std::size_t>(i) >= fixed;
    spec.type = of_material ? ParameterType::material : kChoices<ParameterType>[i].value;
    spec.quantity = of_material ? names[i].first : "";
  };
  return field::choice(names, choose, [&spec] { return type_name(spec); });
}

Only of_materials(const ParameterSpec& spec) {
  std::vector<std::string> names;
  for (const auto& [quantity, kinds] : material_quantities()) names.push_back(quantity);
  return {spec.type == ParameterType::material, enumeration(names), type_name(spec)};
}

/// `per` makes an albedo that of a shape.
Field per(ParameterSpec& spec) {
  const auto choose = [&spec](const YamlValue& value) {
    const bool albedo = spec.type == ParameterType::material;
    if (spec.per == Per::all) return;
    if ((spec.per == Per::vertex) != albedo)
      value.fail(fmt::format("a {} is not given per {}", type_name(spec), name_of(spec.per)),
                 albedo ? "all, vertex" : "all, pixel");
    if (albedo) spec.type = ParameterType::texture;
  };
  return field::checked(field::choice(spec.per), choose);
}

constexpr int kMostLevels = 24;  // each may have four times the triangles of the one before

void check_name(const YamlValue& value) {
  for (const char* reserved : {"render", "target", "initial", "final"})
    if (value.text() == reserved) value.fail(fmt::format("'{}' is the name of another output", reserved));
}

}  // namespace

std::string type_name(const ParameterSpec& spec) {
  if (spec.type == ParameterType::texture) return "albedo";
  return spec.type == ParameterType::material ? spec.quantity : name_of(spec.type);
}

std::vector<std::string> ParameterSpec::shapes() const {
  std::vector<std::string> all;
  if (!shape.empty()) all.push_back(shape);
  all.insert(all.end(), further_shapes.begin(), further_shapes.end());
  return all;
}

void describe(Keys& keys, ParameterSpec& spec, ExperimentFolder& folder, bool target_required) {
  using enum ParameterType;
  const auto of = [&](std::initializer_list<ParameterType> types) {
    Only result{false, "", type_name(spec)};
    std::vector<std::string> names;
    for (const ParameterType type : types) {
      names.push_back(type == texture ? "albedo (per: vertex)" : name_of(type));
      result.here |= type == spec.type;
    }
    result.to = enumeration(names);
    return result;
  };
  const char* const own = "the parameter's";
  keys.remember(spec.where);
  keys.value("name", field::checked(file_name(spec.name), check_name), "names columns and files", {.required = true});
  keys.value("type", type(spec), "what changes, in which unit", {.required = true});
  const bool albedo = (spec.type == material && spec.quantity == "albedo") || spec.type == texture;
  keys.value("per", per(spec), "how many unknowns there are",
             {.only = {albedo || spec.type == background || spec.type == time_offset,
                       "albedo, background and time_offset", type_name(spec)},
              .unset = spec.per == Per::all});
  keys.value("light", field::text(spec.light), "which moves, turns about its position or changes; in place of a shape",
             {.required = spec.type == intensity,
              .only = of({translation, rotation, intensity}),
              .unset = spec.light.empty()});
  const bool of_light = !spec.light.empty();
  Only with_shape = of({translation, rotation, vertices, emission, texture});
  if (of_light && with_shape.here) with_shape = {false, "parameters of shapes", "one of a light"};
  keys.value("shape", shapes(spec), "whose vertices, emission or albedo changes; those of a list change alike",
             {.required = true, .only = with_shape});
  keys.value("material", field::text(spec.material), "which changes", {.required = true, .only = of_materials(spec)});
  const auto check_selection = [&](const YamlValue& value) {
    if (spec.selection.kind == Selection::Kind::list && !spec.further_shapes.empty())
      value.fail("counts the vertices of one shape, and there are several", "a box");
  };
  keys.value("selection", field::checked(selection(spec.selection), check_selection),
             "the vertices that move: by number, or inside a box of the world",
             {.only = of({translation, rotation, vertices}),
              .unset = spec.selection.kind == Selection::Kind::all,
              .otherwise = "all"});
  keys.value("direction", direction(spec), "the motion per unit of the parameter; not normalised",
             {.required = true, .only = of({translation, vertices, camera_translation}), .unit = "scene units"});
  const auto check_axis = [&](const YamlValue& value) {
    if (!std::isnormal(length_squared(spec.axis)))
      value.fail("is too long or too short", "a length whose square a double can hold");
  };
  keys.value("axis", field::checked(field::direction(spec.axis), check_axis),
             "of the turn, by the right-hand rule; its length does not matter",
             {.required = true, .only = of({rotation, camera_rotation})});
  Only with_pivot = of({rotation});
  if (of_light && with_pivot.here) with_pivot = {false, "rotations of shapes", "one of a light"};
  keys.value("pivot", pivot(spec), "what the axis goes through", {.only = with_pivot, .unit = "scene units"});
  const auto smoothing = [&](Keys& inner) {
    inner.value("diffusion", field::non_negative(spec.diffusion),
                "adam only: gradients diffuse over the mesh, over about the root of this many edges; 0: not");
    inner.value("slopes", field::non_negative(spec.slopes), "weight of a penalty on uneven offsets or albedos; 0: none",
                {.unit = "mean square of the target"});
    inner.value("bending", field::non_negative(spec.bending),
                "for `loss: {kind: poisson}`: a prior whose negative logarithm is this times the integral of the "
                "surface's squared curvature (twice the mean one), 50 for a sphere of any size; 0: none",
                {.only = of({vertices})});
    inner.value("variation", field::non_negative(spec.variation),
                "for `loss: {kind: poisson}`: a prior whose negative logarithm is this times the integral of the "
                "squared slope of that curvature, times the squared radius of the sphere of the surface's area, 0 for "
                "any sphere; not in the early ones of `remesh.coarse_levels`; 0: none",
                {.only = of({vertices})});
    inner.value(
        "tangential", field::non_negative(spec.tangential),
        "for `loss: {kind: poisson}`: a prior whose negative logarithm is this times the squared motion of inner "
        "vertices within the surface, over the area of each; 0: none",
        {.only = of({vertices})});
    inner.value(
        "evidence", field::boolean(spec.evidence),
        "for counts, in a run in levels: each finer level takes the weight of variation (without variation, that of "
        "bending; without both, that of slopes) that makes the data of the level before most probable. A weight "
        "changes "
        "by ten at most");
  };
  keys.map("smoothing", smoothing, "so that vertices move, or albedos change, in patches",
           {.only = of({vertices, texture}),
            .unset = spec.diffusion == 0 && spec.slopes == 0 && !spec.bends() && spec.tangential == 0});
  const auto remesh = [&](Keys& inner) {
    inner.value("levels", field::integer(spec.remesh.levels, 1, kMostLevels), "optimisations one after the other",
                {.required = true});
    inner.value("more_levels", field::integer(spec.remesh.more_levels, 0, kMostLevels),
                "that may follow, as long as the fit of a capture's counts is `unexplained`",
                {.unset = spec.remesh.more_levels == 0});
    inner.value("edge_length", field::positive(spec.remesh.edge_length),
                "of the first level's triangles; those of each further level that is not coarse have half of it",
                {.unit = "scene units", .unset = spec.remesh.edge_length == 0, .otherwise = "the mesh as it is"});
    inner.value(
        "coarse_levels", field::integer(spec.remesh.coarse_levels, 1, kMostLevels),
        "number of levels with the first one's edge length, so that a surface that moves far keeps triangles of "
        "even size; with `adam` the last two of them have half the edges already",
        {.unset = spec.remesh.coarse_levels == 1});
    const auto outline = [&spec](Keys& keys_of_outline) {
      keys_of_outline.value(
          "albedo", field::number(spec.remesh.outline, {.low = 0, .high = 1, .low_open = true, .high_open = true}),
          "share of the mean albedo of each part, by what light comes from, below which there is no surface",
          {.required = true});
      keys_of_outline.value("slopes", field::non_negative(spec.remesh.outline_slopes),
                            "weight of the albedos' slopes in that level, in place of their own `smoothing`",
                            {.unit = "mean square of the target"});
    };
    inner.map("outline", outline,
              "the first level leaves the shape's albedos by vertex free to become dark; the surface ends where they "
              "are, so that gaps open and webs tear; strips that become narrower than an edge are cut",
              {.unset = spec.remesh.outline == 0});
    inner.value("coarse_histograms", field::integer(spec.remesh.coarse_histograms, 0, std::numeric_limits<int>::max()),
                "the coarse levels but the last one are fitted to so many of a capture's histograms, spread "
                "evenly, those by adam to half as many, others in each iteration; 0: to all",
                {.unset = spec.remesh.coarse_histograms == 0});
    const auto adam = [&spec](Keys& keys_of_adam) {
      keys_of_adam.value("iterations", field::integer(spec.remesh.adam_iterations, 1, kMostIterations),
                         "of each such level", {.required = true});
      keys_of_adam.value(
          "last", field::integer(spec.remesh.adam_last, 0, kMostIterations),
          "iterations of the last such level, whose steps shrink after a third of them; 0: as many as others",
          {.unset = spec.remesh.adam_last == 0});
      keys_of_adam.value("learning_rate", field::positive(spec.remesh.adam_rate),
                         "see `optimizer`; half of it in the last such level",
                         {.required = true, .unit = "the parameter's `scale`"});
      keys_of_adam.value("slopes", field::non_negative(spec.remesh.adam_slopes),
                         "weight of the offsets' slopes in these levels, in place of their own `smoothing`",
                         {.unit = "mean square of the target"});
    };
    inner.map(
        "adam", adam,
        "coarse levels are fitted by adam, with steps that shrink towards the end of the last of them, so that borders "
        "go all of their way, and with twice `samples.interior`. The first coarse level (with `outline` two) and the "
        "last are not. Albedos by vertex move together in them; without `lower` they begin 12 % lower",
        {.unset = spec.remesh.adam_iterations == 0});
  };
  keys.map("remesh", remesh,
           "a run in levels: the surface that a level has found gets finer triangles for the next. One parameter may "
           "have it",
           {.only = of({vertices}), .unset = spec.remesh.levels == 0});
  keys.value(
      "prior_width", field::non_negative(spec.prior_width),
      "standard deviation of a normal prior about `initial`, for `loss: {kind: poisson}`. Offsets of single sensor "
      "points need one, as depth explains their common part as well; 0: none",
      {.only = of({time_offset}), .unit = own});
  keys.value(
      "initial", folder.values(spec.initial),
      "where the optimisation starts; for motions, offsets from the scene file. Backgrounds per sensor point of a "
      "measurement's counts start at their dark bins unless a list is given",
      {.required = spec.type != background,
       .unit = own,
       .unset = spec.initial.empty(),
       .otherwise = "required; backgrounds of a measurement's counts: its dark bins"});
  keys.value("target", folder.values(spec.target), "where the target is rendered, or known to be",
             {.required = target_required,
              .unit = own,
              .unset = spec.target.empty(),
              .otherwise = "required to render a target"});
  keys.value("lower", folder.values(spec.lower),
             "bound. In any case ior stays on its side of 1, emission, intensity and gain above 0, background at 0 or "
             "above, other quantities of materials between 0 and 1",
             {.unit = own, .unset = spec.lower.empty()});
  keys.value("upper", folder.values(spec.upper), "bound. An ior above 1 has no upper bound unless given",
             {.unit = own, .unset = spec.upper.empty()});
  keys.value("scale", field::positive(spec.scale),
             "the unit in which optimisers see the parameter. Default: 1; of a "
             "rotation 180 / pi; of an emission, intensity or gain its largest initial component",
             {.unit = own, .unset = spec.scale == 0, .otherwise = "by `type`"});
}

}  // namespace isochron
