#include "core/paths/path_differential.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/paths/length_flow.h"

namespace isochron {
namespace {

/// What the segments that meet at a vertex say about it.
struct Accumulated {
  Vec3 position;  ///< d ln F / d x_k, normals held
  Vec3 normal;    ///< d ln F / d n_k, as if n_k were free
  Vec3 length;    ///< d l / d x_k, l optical
};

/// d (unit direction of d) contracted with g: (g - (g.w) w) / |d|.
Vec3 through_normalize(const Vec3& g, const Vec3& w, double distance) {
  return (g - w * dot(g, w)) / distance;
}

/// Adds what the BSDF at vertex x says of x and its neighbours.
void add_bsdf(const BsdfDerivative::ByDirections& by, const Scattering& s, Accumulated& before, Accumulated& here,
              Accumulated& after) {
  const Vec3 to_after = through_normalize(by.w_i, s.w_i, s.distance_i);
  const Vec3 to_before = through_normalize(by.w_o, s.w_o, s.distance_o);
  after.position += to_after;
  before.position += to_before;
  here.position -= to_after + to_before;
  here.normal += by.n;
}

/// Adds what a scalar does to ln F, given by channel.
void add_scalar(int dof, const Rgb& log_f, LocalDifferential& out) {
  if (log_f == Rgb(log_f.r)) {
    if (log_f.r != 0) out.scalars.push_back({dof, -1, log_f.r});
    return;
  }
  for (int c = 0; c < 3; ++c)
    if (log_f[c] != 0) out.scalars.push_back({dof, c, log_f[c]});
}

/// Adds what the texture at x does to ln F.
void add_texture(const PreparedScene& scene, const SurfacePoint& x, LocalDifferential& out) {
  const auto b = scene.barycentrics(x);
  const double value = scene.texture(x);
  for (int i = 0; i < 3; ++i)
    if (const int v = scene.scene.triangles[x.triangle].vertex[i]; scene.differentiable.texture[v])
      out.scalars.push_back({scene.layout.texture(v), -1, b[i] / value});
}

/// Gradients that other vertices' flows pass to this material point: from neighbours that follow it, from x1 itself.
struct InheritedGradient {
  Vec3 position, length;
  double area = 0;  ///< counts d ln (area of its triangle)
};

/// Lets x_k follow its neighbours (theory section 8): passes its part of the gradients there on to what it follows.
/// `density` is d ln (sampling measure) / dx in the plane of x_k. Returns what is removed from its base flow.
InheritedGradient redirect_to_neighbours(const VertexFlow& flow, const SurfacePoint& x, const Accumulated& g,
                                         const Vec3& density, InheritedGradient* before, InheritedGradient* own,
                                         InheritedGradient* after) {
  InheritedGradient removed;
  const auto hand = [&](const Following& f, InheritedGradient* to) {
    if (!(f.weight > 0)) return;
    const Vec3 position = in_plane(x, (g.position + density) * f.weight + f.gradient);
    const Vec3 along = in_plane(x, g.length * f.weight);
    to->position += position;
    to->length += along;
    removed.position += position;
    removed.length += along;
    removed.area += f.weight;
  };
  hand(flow.before, before);
  hand(flow.after, after);
  hand(flow.own, own);
  return removed;
}

/// Carries the gradients of a light without an extent, the end of a path, to what can move there. `w`: unit, to the path's last
/// vertex but one. `channel`: see distribute_to_mesh_vertices.
void to_light(const PreparedScene& scene, const SurfacePoint& y, const Accumulated& g, const Vec3& w, bool length_only,
              int channel, LocalDifferential& out) {
  const int i = light_number(y.triangle);
  if (scene.captures() || !scene.differentiable.light[i]) return;
  for (int axis = 0; axis < 3; ++axis)
    out.scalars.push_back({scene.layout.light_position(i, axis), channel, g.position[axis], g.length[axis]});
  if (length_only || channel > 0) return;
  const PointLight& light = scene.lights[i];
  const Vec3 turn = light.derivative(w).direction;
  for (int axis = 0; axis < 3; ++axis)
    if (turn[axis] != 0) out.scalars.push_back({scene.layout.light_direction(i, axis), -1, turn[axis]});
  for (int c = 0; c < 3; ++c)
    if (light.intensity[c] > 0) out.scalars.push_back({scene.layout.light_intensity(i, c), c, 1 / light.intensity[c]});
}

/// Moves the emitter's point, the last vertex, so that the path keeps its length l: what the plain flow makes of l, by all
/// that `g` and `out` say of it, changes ln F by -dl (X . grad ln F + div X) - X . grad dl. For one channel of ln F, or all (-1).
void keep_length(const PreparedScene& scene, const LengthFlow& flow, const SurfacePoint* x, int count,
                 std::vector<Accumulated>& g, int channel, LocalDifferential& out) {
  const SurfacePoint& y = x[count - 1];
  const double rate = dot(flow.x, g[count - 1].position) + flow.spread;
  for (std::size_t i = 0, end = out.scalars.size(); i < end; ++i)
    if (const ScalarGradient s = out.scalars[i]; s.length != 0)
      out.scalars.push_back({s.dof, channel, -rate * s.length});
  const Vec3 of_y = g[count - 1].length;
  for (int k = 0; k < count; ++k) g[k].position -= std::exchange(g[k].length, {}) * rate;
  g[count - 1].position -= flow.turn;
  g[count - 2].position += flow.turn;
  // y crosses its triangle, whose corners may move differently.
  const auto& edge = scene.edges(y.triangle);
  const Vec3 opposite[3] = {edge[0] - edge[1], edge[1], -edge[0]};
  const Vec3 across = cross(y.n, flow.x) / (2 * scene.area(y.triangle));
  scene.for_each_moving_corner(y.triangle, [&](int i, int vertex) {
    out.vertices.push_back({vertex, of_y * -dot(across, opposite[i]), {}, channel});
  });
}

/// Carries position and normal gradients of a vertex to its triangle's vertices.
/// `area`: how often d ln (area of the triangle) counts (paper Eq. 11).
void to_triangle(const PreparedScene& scene, const SurfacePoint& x, const Accumulated& g, double area, bool length_only,
                 int channel, LocalDifferential& out) {
  if (!scene.has_moving_vertex(x.triangle)) return;
  // Both turn with the doubled area's vector.
  const Vec3 through_cross = (in_plane(x, g.normal) + x.n * area) / (2 * scene.area(x.triangle));
  const auto b = scene.barycentrics(x);
  const auto& edge = scene.edges(x.triangle);
  const Vec3 opposite[3] = {edge[0] - edge[1], edge[1], -edge[0]};  // from the next but one corner to the next
  scene.for_each_moving_corner(x.triangle, [&](int i, int vertex) {
    VertexGradient entry{vertex, g.position * b[i], g.length * b[i], channel};
    if (!length_only) entry.log_f += cross(opposite[i], through_cross);
    out.vertices.push_back(entry);
  });
}

/// Carries the gradients at the path's vertices, of one channel or of all (-1), through their flows to the vertices of the
/// mesh.
void distribute_to_mesh_vertices(const PreparedScene& scene, const SurfacePoint* x, int count,
                                 std::vector<Accumulated>& g, bool length_only, int channel, LocalDifferential& out) {
  thread_local std::vector<InheritedGradient> extra;
  extra.assign(count, {});
  // Every vertex except a camera path's x1 contributes d ln(area): x1 is fixed to its pixel.
  const bool held = !scene.captures();
  const int last_on_surface = is_light(x[count - 1].triangle) ? count - 2 : count - 1;
  for (int k = held ? 2 : 1; k <= last_on_surface; ++k) extra[k].area = 1;

  const Vec3 ray = x[1].p - x[0].p;
  const double height = dot(x[1].n, ray);
  // Gradient of what an area of the surface at x1 takes of the image, ln |n . ray| / (forward . ray)^3 (theory section 8).
  const auto log_density = [&] {
    const Vec3& forward = scene.camera.forward;
    return x[1].n / height - forward * (3 / dot(forward, ray));
  };
  // A vertex that does not move with its material crosses the texture there.
  const auto log_texture = [&](int k) {
    return scene.textured(x[k].triangle) && !length_only ? scene.texture_gradient(x[k]) / scene.texture(x[k]) : Vec3();
  };
  VertexFlows::Pair before, after;
  InheritedGradient removed_by_pixel;
  for (int k = 1; k <= last_on_surface; ++k) {
    const int rank = scene.flow_rank(k);
    after = k < last_on_surface ? scene.flows.pair(scene, x[k], x[k + 1], rank) : VertexFlows::Pair{};
    const VertexFlow flow = VertexFlows::at(before, after, rank);
    before = after;
    if (!flow.follows()) continue;
    const InheritedGradient removed =
        redirect_to_neighbours(flow, x[k], g[k], (rank == 1 ? log_density() : Vec3()) + log_texture(k), &extra[k - 1],
                               &extra[k], k + 1 < count ? &extra[k + 1] : nullptr);
    if (rank == 1) {
      removed_by_pixel = removed;
      extra[k].area = flow.own.weight;
    } else {
      extra[k].position -= removed.position;
      extra[k].length -= removed.length;
      extra[k].area -= removed.area;
    }
  }

  if (held) {
    // The pixel flow: along the ray, as far as the surface moves along its normal.
    const Vec3 texture = last_on_surface >= 1 ? log_texture(1) : Vec3();
    Vec3 through_ray = g[1].position + texture - removed_by_pixel.position;
    if (removed_by_pixel.area > 0) {
      through_ray += log_density() * removed_by_pixel.area;
      g[1].normal += ray * (removed_by_pixel.area / height);
    }
    g[1].position = x[1].n * (dot(ray, through_ray) / height) - texture;
    g[1].length = x[1].n * (dot(ray, g[1].length - removed_by_pixel.length) / height);
  }
  for (int k = 1; k <= last_on_surface; ++k) {
    g[k].position += extra[k].position;
    g[k].length += extra[k].length;
    to_triangle(scene, x[k], g[k], extra[k].area, length_only, channel, out);
  }
}

}  // namespace

void differentiate_path(const PreparedScene& scene, int pixel, const SurfacePoint* x, int count, bool length_only,
                        LocalDifferential& out) {
  out.clear();
  thread_local std::vector<Accumulated> g;
  g.assign(count, {});
  for (int k = 0; k + 1 < count; ++k) {
    const Vec3 d = x[k + 1].p - x[k].p;
    if (k == 0 && !scene.captures() && dot(x[1].n, d) == 0) return;  // edge-on: no light of x1 reaches the pixel
    const double squared = length_squared(d);
    const double inverse = 1 / std::sqrt(squared);
    const Vec3 w = d * inverse;
    const ShapeRecord* medium = scene.medium_between(x[k], x[k + 1]);
    const Vec3 g_length = medium ? w * medium->index : w;
    g[k].length -= g_length;
    g[k + 1].length += g_length;
    if (medium) {
      const int dof = scene.layout.number(medium->material, medium->bsdf->index_number());
      if (scene.differentiable.has_number(scene.layout, dof)) out.scalars.push_back({dof, -1, 0, squared * inverse});
    }
    if (length_only || (k == 0 && !scene.captures())) continue;
    const double cos_near = dot(x[k].n, d);
    const bool to_light = is_light(x[k + 1].triangle);
    const double cos_far = to_light ? 1 : dot(x[k + 1].n, d);
    if (cos_near == 0 || cos_far == 0) {
      out.clear();
      return;
    }
    Vec3 g_d = x[k].n / cos_near - d * (4 / squared);
    if (to_light) {
      // cos / r^2 x radiant intensity
      const Vec3 of_light = scene.lights[light_number(x[k + 1].triangle)].derivative(-w).w;
      g_d += d / squared - through_normalize(of_light, -w, 1 / inverse);
    } else {
      g_d += x[k + 1].n / cos_far;
      g[k + 1].normal += d / cos_far;
    }
    g[k].position -= g_d;
    g[k + 1].position += g_d;
    g[k].normal += d / cos_near;
  }
  if (scene.differentiable.time_offset) {
    const int offset = scene.scene.detector.time_offset_of(scene.scene.capture, pixel);
    out.scalars.push_back({scene.layout.time_offset(offset), -1, 0, 1});
  }
  if (scene.differentiable.gain && !length_only)
    out.scalars.push_back({scene.layout.gain(), -1, 1 / scene.scene.detector.gain});
  // Where colours differ: what belongs to single colours.
  thread_local std::array<std::vector<Accumulated>, 3> own;
  bool coloured = false;
  if (!length_only) {
    for (int k = 1; k + 1 < count; ++k) {
      const int m = scene.shape_of(x[k].triangle).material;
      const Bsdf& bsdf = scene.bsdf_of(x[k].triangle);
      if (scene.textured(x[k].triangle)) add_texture(scene, x[k], out);
      if (!bsdf.depends_on_directions() && !scene.differentiable.material[m]) continue;
      const Scattering s(x[k - 1].p, x[k], x[k + 1].p);
      const BsdfDerivative derivative = bsdf.derivative(s);
      if (derivative.coloured) {
        for (int c = 0; c < 3; ++c) {
          if (!coloured) own[c].assign(count, {});
          add_bsdf(derivative.by_directions[c], s, own[c][k - 1], own[c][k], own[c][k + 1]);
        }
        coloured = true;
      } else {
        add_bsdf(derivative.by_directions[0], s, g[k - 1], g[k], g[k + 1]);
      }
      if (!scene.differentiable.material[m]) continue;
      for (int i = 0; i < scene.layout.numbers(m); ++i)
        if (const int dof = scene.layout.number(m, i); scene.differentiable.has_number(scene.layout, dof))
          add_scalar(dof, derivative.by_number[i], out);
    }
    const int s = is_light(x[count - 1].triangle) ? -1 : scene.shape_index(x[count - 1].triangle);
    if (s >= 0 && scene.differentiable.emission[s])
      for (int c = 0; c < 3; ++c)
        if (const double radiance = scene.scene.shapes[s].emission.radiance[c]; radiance > 0)
          out.scalars.push_back({scene.layout.emission(s, c), c, 1 / radiance});
  }
  const SurfacePoint& y = x[count - 1];
  std::optional<LengthFlow> kept;
  if (!length_only && count > 2 && scene.flows.keep_length()) {
    kept.emplace(x[count - 2], y);
    if (!std::isfinite(dot(kept->x, kept->x))) {  // at the foot
      out.clear();
      return;
    }
  }
  const auto finish = [&](std::vector<Accumulated>& of_channel, int channel) {
    if (is_light(y.triangle))
      to_light(scene, y, of_channel[count - 1], normalize(x[count - 2].p - y.p), length_only, channel, out);
    if (kept) keep_length(scene, *kept, x, count, of_channel, channel, out);
    distribute_to_mesh_vertices(scene, x, count, of_channel, length_only, channel, out);
  };
  if (!coloured) {
    finish(g, -1);
    return;
  }
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < count; ++k) {
      own[c][k].position += g[k].position;
      own[c][k].normal += g[k].normal;
      if (c == 0 || kept) own[c][k].length = g[k].length;  // changes of the length: once for all channels
    }
    finish(own[c], c);
  }
}

void add_material_flow(const PreparedScene& scene, const SurfacePoint& x, const Vec3& g, LocalDifferential& out) {
  if (!scene.has_moving_vertex(x.triangle)) return;
  if (is_light(x.triangle)) {
    for (int axis = 0; axis < 3; ++axis)
      out.scalars.push_back({scene.layout.light_position(light_number(x.triangle), axis), -1, g[axis]});
    return;
  }
  const auto b = scene.barycentrics(x);
  scene.for_each_moving_corner(x.triangle, [&](int i, int vertex) { out.vertices.push_back({vertex, g * b[i], {}}); });
}

}  // namespace isochron
