#include "core/paths/flat_patches.h"

#include <algorithm>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/base/parallel.h"
#include "core/paths/prepared_scene.h"

namespace isochron {
namespace {

/// Whether the two faces of the edge lie in one plane, on either side of the edge.
bool is_flat(const PreparedScene& scene, const Edge& edge) {
  if (edge.face[1] < 0 || !face_alike(scene.normal(edge.face[0]), scene.normal(edge.face[1]))) return false;
  const auto along = [&](int i) {
    return runs_along(scene.scene.triangles[edge.face[i]].vertex, edge.vertex[0], edge.vertex[1]);
  };
  return along(0) != along(1);  // else they lie on each other
}

}  // namespace

void FlatPatches::update(const PreparedScene& prepared, const std::vector<int>& body_of_vertex,
                         std::vector<char> near_bodies) {
  const Scene& scene = prepared.scene;
  bool differs = near_bodies != near_bodies_, moved = false;
  near_bodies_ = std::move(near_bodies);
  flat_.resize(scene.edges.size());
  for (int s = 0; s < static_cast<int>(scene.shapes.size()); ++s) {
    if (prepared.shape_changed(s) <= flat_revision_) continue;
    moved = true;
    differs |= update_flat_edges(prepared, body_of_vertex, s);
  }
  flat_revision_ = prepared.revision();
  if (differs) make_patches(scene, body_of_vertex);
  if (!differs && !moved) return;
  for (Patch& patch : patches_) {
    if (patch.triangles < 2) continue;
    patch.area = 0;
    for (int i = patch.first_triangle; i < patch.first_triangle + patch.triangles; ++i)
      patch.area += prepared.area(triangles_[i]);
  }
}

bool FlatPatches::update_flat_edges(const PreparedScene& prepared, const std::vector<int>& body_of_vertex, int shape) {
  const Scene& scene = prepared.scene;
  const int first = scene.shapes[shape].first_edge, count = scene.shapes[shape].edge_count;
  constexpr int kChunk = 4096, kAhead = 8;
  std::vector<char> differs(static_cast<std::size_t>((count + kChunk - 1) / kChunk), 0);
  parallel(static_cast<int>(differs.size()), [&](int chunk) {
    const int begin = first + chunk * kChunk, end = std::min(begin + kChunk, first + count);
    for (int e = begin; e < end; ++e) {
      const Edge& edge = scene.edges[e];
      if (e + kAhead < end)
        for (const int t : scene.edges[e + kAhead].face) prepared.prefetch(std::max(t, 0));
      const char flat = is_flat(prepared, edge);
      differs[chunk] |= std::exchange(flat_[e], flat) != flat && near_bodies_[body_of_vertex[edge.vertex[0]]];
    }
  });
  return std::find(differs.begin(), differs.end(), 1) != differs.end();
}

void FlatPatches::make_patches(const Scene& scene, const std::vector<int>& body_of_vertex) {
  DisjointSets sets(scene.triangles.size());
  const auto near = [&](std::size_t vertex) { return near_bodies_[body_of_vertex[vertex]] != 0; };
  for (std::size_t e = 0; e < flat_.size(); ++e)
    if (flat_[e] && near(scene.edges[e].vertex[0])) sets.join(scene.edges[e].face[0], scene.edges[e].face[1]);
  int count;
  patch_ = sets.numbered(count);
  patches_.assign(static_cast<std::size_t>(count), {});
  for (std::size_t t = 0; t < patch_.size(); ++t) {
    if (!near(scene.triangles[t].vertex[0])) patch_[t] = -1;
    if (patch_[t] < 0) continue;
    patches_[patch_[t]].body = body_of_vertex[scene.triangles[t].vertex[0]];
    ++patches_[patch_[t]].triangles;
  }
  int first_triangle = 0;
  for (Patch& patch : patches_) {
    patch.first_triangle = first_triangle;
    first_triangle += std::exchange(patch.triangles, 0);
  }
  triangles_.resize(static_cast<std::size_t>(first_triangle));
  for (std::size_t t = 0; t < patch_.size(); ++t) {
    if (patch_[t] < 0) continue;
    Patch& patch = patches_[patch_[t]];
    triangles_[patch.first_triangle + patch.triangles++] = static_cast<int>(t);
  }
  const auto for_each_crease = [&](auto&& f) {
    for (std::size_t e = 0; e < scene.edges.size(); ++e) {
      const auto& face = scene.edges[e].face;
      if (patch_[face[0]] < 0 || (face[1] >= 0 && patch_[face[0]] == patch_[face[1]])) continue;
      for (int i = 0; i < 2 && face[i] >= 0; ++i) f(patches_[patch_[face[i]]], static_cast<int>(e));
    }
  };
  for_each_crease([](Patch& patch, int) { ++patch.creases; });
  int first = 0;
  for (Patch& patch : patches_) {
    patch.first_crease = first;
    first += std::exchange(patch.creases, 0);
  }
  creases_.resize(static_cast<std::size_t>(first));
  for_each_crease([&](Patch& patch, int edge) { creases_[patch.first_crease + patch.creases++] = edge; });
}

double FlatPatches::area(const PreparedScene& prepared, int triangle) const {
  const Patch& patch = patches_[patch_[triangle]];
  return patch.triangles < 2 ? prepared.area(triangle) : patch.area;
}

}  // namespace isochron
