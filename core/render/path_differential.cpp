#include "core/render/path_differential.h"

#include <array>

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

/// Adds the scattering lobe's part at vertex x between its neighbours; returns the lobe's derivative.
LobeDerivative add_lobe(const Material& material, const SurfacePoint& x, const Scattering& s, Accumulated& before,
                        Accumulated& here, Accumulated& after) {
  const LobeDerivative lobe = lobe_derivative(material, s.cos_i, s.cos_o, s.cos_io);
  const Vec3 to_after = through_normalize(x.n * lobe.d_cos_i + s.w_o * lobe.d_cos_io, s.w_i, s.distance_i);
  const Vec3 to_before = through_normalize(x.n * lobe.d_cos_o + s.w_i * lobe.d_cos_io, s.w_o, s.distance_o);
  after.position += to_after;
  before.position += to_before;
  here.position -= to_after + to_before;
  here.normal += s.w_i * lobe.d_cos_i + s.w_o * lobe.d_cos_o;
  return lobe;
}

/// Turns the gradients at x1 into those of its material point, for x1 slides along its pixel ray and follows
/// x2, which takes its part of them.
void let_flow(const CameraFlow::Follow& follow, const Vec3& ray, const Vec3& forward, const SurfacePoint& x1,
              Accumulated& g1, Accumulated& g2) {
  const double height = dot(x1.n, ray);
  const auto in_plane = [&](const Vec3& g) { return g - x1.n * dot(g, x1.n); };
  Vec3 position, length;  // what multiplies the flow in the plane of x1
  double squeezed = 0;
  if (follow.weight > 0) {
    // As it leaves the pixel ray, what it sees per area counts: du/dA = (n . ray) / (forward . ray)^3, up to
    // a factor. That the normal turns and the flow spreads adds up to the last line.
    const Vec3 log_density = x1.n / height - forward * (3 / dot(forward, ray));
    position = in_plane(g1.position * follow.weight + follow.gradient);
    length = in_plane(g1.length * follow.weight);
    squeezed = follow.weight * dot(x1.n, log_density);
    g2.position += position + in_plane(log_density) * follow.weight;
    g2.length += length;
    g1.normal += ray * (follow.weight / height);
  }
  g1.position = x1.n * (dot(ray, g1.position - position) / height + squeezed);
  g1.length = x1.n * (dot(ray, g1.length - length) / height);
}

/// Carries position and normal gradients of a vertex to its triangle's vertices.
void to_triangle(const PreparedScene& scene, const SurfacePoint& x, const Accumulated& g, bool material,
                 bool length_only, LocalDifferential& out) {
  if (!scene.has_moving_vertex(x.triangle)) return;
  // Rotation of the face normal, and d ln A of material points (paper Eq. 11).
  Vec3 through_cross = g.normal - x.n * dot(g.normal, x.n);
  if (material) through_cross += x.n;
  through_cross = through_cross / (2 * scene.area(x.triangle));
  const auto b = scene.barycentrics(x);
  const auto& edge = scene.edges(x.triangle);
  const Vec3 opposite[3] = {edge[0] - edge[1], edge[1], -edge[0]};  // from the next but one corner to the next
  scene.for_each_moving_corner(x.triangle, [&](int i, int vertex) {
    VertexGradient entry{vertex, g.position * b[i], g.length * b[i]};
    if (!length_only) entry.log_f += cross(opposite[i], through_cross);
    out.vertices.push_back(entry);
  });
}

}  // namespace

void differentiate_path(const PreparedScene& scene, const SurfacePoint* x, int count, bool length_only,
                        LocalDifferential& out) {
  out.clear();
  thread_local std::vector<Accumulated> g;
  g.assign(count, {});
  for (int k = 0; k + 1 < count; ++k) {
    const Vec3 d = x[k + 1].p - x[k].p;
    const double squared = length_squared(d);
    const double inverse = 1 / std::sqrt(squared);
    const Vec3 w = d * inverse;
    const Material* medium = scene.medium_between(x[k], x[k + 1]);
    const Vec3 g_length = medium ? w * medium->ior : w;
    g[k].length -= g_length;
    g[k + 1].length += g_length;
    if (medium) {
      const int m = static_cast<int>(medium - scene.scene.materials.data());
      if (scene.moving.ior[m]) out.scalars.push_back({scene.layout.ior(m), -1, 0, squared * inverse});
    }
    if (length_only || k == 0) continue;
    const double cos_near = dot(x[k].n, d), cos_far = dot(x[k + 1].n, d);
    if (cos_near == 0 || cos_far == 0) {
      out.clear();
      return;
    }
    const Vec3 g_d = x[k].n / cos_near + x[k + 1].n / cos_far - d * (4 / squared);
    g[k].position -= g_d;
    g[k + 1].position += g_d;
    g[k].normal += d / cos_near;
    g[k + 1].normal += d / cos_far;
  }
  if (!length_only) {
    for (int k = 1; k + 1 < count; ++k) {
      const int m = scene.shape_of(x[k].triangle).material;
      const Material& material = scene.scene.materials[m];
      if (material.type != MaterialType::diffuse) {
        const Scattering s(x[k - 1].p, x[k], x[k + 1].p);
        const LobeDerivative lobe = add_lobe(material, x[k], s, g[k - 1], g[k], g[k + 1]);
        if (scene.moving.roughness[m]) out.scalars.push_back({scene.layout.roughness(m), -1, lobe.d_roughness});
        if (scene.moving.ior[m]) out.scalars.push_back({scene.layout.ior(m), -1, lobe.d_ior});
      }
      if (scene.moving.albedo[m])
        for (int c = 0; c < 3; ++c)
          if (material.albedo[c] > 0) out.scalars.push_back({scene.layout.albedo(m, c), c, 1 / material.albedo[c]});
    }
    const int s = scene.shape_index(x[count - 1].triangle);
    if (scene.moving.emission[s])
      for (int c = 0; c < 3; ++c)
        if (const double radiance = scene.scene.shapes[s].emission[c]; radiance > 0)
          out.scalars.push_back({scene.layout.emission(s, c), c, 1 / radiance});
  }
  CameraFlow::Follow follow;
  if (count > 2) follow = scene.camera_flow.follow(x[1].p, x[2].p);
  let_flow(follow, x[1].p - x[0].p, scene.camera.forward, x[1], g[1], g[count > 2 ? 2 : 0]);
  for (int k = 1; k < count; ++k) to_triangle(scene, x[k], g[k], k > 1, length_only, out);
}

void add_material_flow(const PreparedScene& scene, const SurfacePoint& x, const Vec3& g, LocalDifferential& out) {
  if (!scene.has_moving_vertex(x.triangle)) return;
  const auto b = scene.barycentrics(x);
  scene.for_each_moving_corner(x.triangle, [&](int i, int vertex) { out.vertices.push_back({vertex, g * b[i], {}}); });
}

}  // namespace isochron
