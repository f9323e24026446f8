#include "optim/reconstruct/start_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace isochron {
namespace {

constexpr int kCellLines = 2;         // voxels that make a lateral resolution
constexpr int kRings = 2;             // voxels beyond what is significant
constexpr int kSmoothings = 2;        // means over 3 x 3 voxels: about a lateral resolution wide
constexpr int kRoundings = 6;         // of borders, by the weights 1, 2, 1 each: steps of a grid are gone after that
constexpr double kSteepestJoint = 2;  // depth over distance, as of the first surface
/// A half, where the edge of a flat sheet is, takes steep parts, which send less light, for what is beyond: the rabbit's first level then
/// ends at 1.45 / 4.3 mm (median, 80 %) and a silhouette of 0.79; with this at 1.2 / 3.4 mm and 0.83.
constexpr double kOutline = 0.35;
/// What filtering leaves, far from all light and close to the wall, passes for specks of surfaces. Six of them before a wall of 2 m, where
/// the blob has all other light, had less than this each.
constexpr double kLeastLight = 0.01;
constexpr int kRoom = kRings + kCellLines;  // voxels about what is significant
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A depth for each line of sight; not a number where there is none.
struct DepthMap {
  int width, height;
  std::vector<double> depth;
  double& at(int a, int u) { return depth[u * width + a]; }
  double at(int a, int u) const { return a < 0 || u < 0 || a >= width || u >= height ? kNone : depth[u * width + a]; }
  bool has(int a, int u) const { return std::isfinite(at(a, u)); }
  /// Mean over those of the 3 x 3 lines about it that have one.
  double mean_around(int a, int u) const {
    double sum = 0;
    int count = 0;
    for (int du = -1; du <= 1; ++du)
      for (int da = -1; da <= 1; ++da)
        if (has(a + da, u + du)) {
          sum += at(a + da, u + du);
          ++count;
        }
    return count == 0 ? kNone : sum / count;
  }
  template <class Change>
  DepthMap changed(Change&& change) const {
    DepthMap result = *this;
    for (int u = 0; u < height; ++u)
      for (int a = 0; a < width; ++a) result.at(a, u) = change(a, u);
    return result;
  }
  DepthMap grown(const BackProjection& volume, double jump) const {
    DepthMap result = *this;
    for (int ring = 0; ring < kRings; ++ring)
      result = result.changed([&](int a, int u) {
        return result.has(a, u) ? result.at(a, u) : brightest(volume, a, u, result.mean_around(a, u), jump);
      });
    return result;
  }
  /// Where the line's albedo is greatest, no farther than `jump` from `depth`, which stays where nothing is known.
  static double brightest(const BackProjection& volume, int a, int u, double depth, double jump) {
    const int x = a - kRoom, y = u - kRoom;
    double best = depth;
    if (!std::isfinite(depth) || x < 0 || y < 0 || x >= static_cast<int>(volume.across.size()) ||
        y >= static_cast<int>(volume.up.size()))
      return best;
    float greatest = 0;
    for (std::size_t d = 0; d < volume.depth.size(); ++d) {
      const float albedo = volume.albedo[volume.index(d, y, x)];
      if (std::abs(volume.depth[d] - depth) > jump || albedo <= greatest) continue;
      greatest = albedo;
      best = volume.depth[d];
    }
    return best;
  }
  DepthMap smooth() const {
    DepthMap result = *this;
    for (int round = 0; round < kSmoothings; ++round)
      result = result.changed([&](int a, int u) { return result.has(a, u) ? result.mean_around(a, u) : kNone; });
    return result;
  }
};

/// The depths with room for the margin about them.
DepthMap padded(const BackProjection& volume, const std::vector<double>& depth) {
  const int width = static_cast<int>(volume.across.size()), height = static_cast<int>(volume.up.size());
  DepthMap map{width + 2 * kRoom, height + 2 * kRoom, {}};
  map.depth.assign(static_cast<std::size_t>(map.width) * map.height, kNone);
  for (int u = 0; u < height; ++u)
    for (int a = 0; a < width; ++a) map.at(a + kRoom, u + kRoom) = depth[u * width + a];
  return map;
}

/// The pieces of at least so many lines that hang together without jumps of more than `jump` from line to line, each alone.
std::vector<DepthMap> pieces(const DepthMap& map, double jump, double least_lines) {
  std::vector<DepthMap> result;
  DepthMap left = map;
  for (int start = 0; start < static_cast<int>(map.depth.size()); ++start) {
    if (!std::isfinite(left.depth[start])) continue;
    DepthMap piece = map.changed([](int, int) { return kNone; });
    std::vector<std::pair<int, int>> open{{start % map.width, start / map.width}};
    int lines = 0;
    piece.depth[start] = left.depth[start];
    left.depth[start] = kNone;
    while (!open.empty()) {
      const auto [a, u] = open.back();
      open.pop_back();
      ++lines;
      for (const auto& [da, du] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!left.has(a + da, u + du) || std::abs(left.at(a + da, u + du) - map.at(a, u)) > jump) continue;
        piece.at(a + da, u + du) = left.at(a + da, u + du);
        left.at(a + da, u + du) = kNone;
        open.emplace_back(a + da, u + du);
      }
    }
    if (lines >= least_lines) result.push_back(std::move(piece));
  }
  return result;
}

/// Of a voxel, 0 where there is none.
double albedo_at(const BackProjection& volume, int a, int u, double depth) {
  const int x = a - kRoom, y = u - kRoom;
  if (x < 0 || y < 0 || x >= static_cast<int>(volume.across.size()) || y >= static_cast<int>(volume.up.size()))
    return 0;
  const auto behind = std::lower_bound(volume.depth.begin(), volume.depth.end(), depth);
  const std::size_t d = std::min<std::size_t>(behind - volume.depth.begin(), volume.depth.size() - 1);
  const std::size_t nearest = d > 0 && depth - volume.depth[d - 1] < volume.depth[d] - depth ? d - 1 : d;
  return volume.albedo[volume.index(nearest, y, x)];
}

/// Without lines of less than kOutline of the albedo that light of the piece comes from on average: what lies beyond its outline looks
/// as if it had less, as the outline is blurred.
DepthMap within_outline(const DepthMap& piece, const BackProjection& volume) {
  double sum = 0, squares = 0;
  for (int u = 0; u < piece.height; ++u)
    for (int a = 0; a < piece.width; ++a) {
      if (!piece.has(a, u)) continue;
      const double albedo = albedo_at(volume, a, u, piece.at(a, u));
      sum += albedo;
      squares += albedo * albedo;
    }
  const double least = sum > 0 ? kOutline * squares / sum : 0;
  return piece.changed([&](int a, int u) {
    return piece.has(a, u) && albedo_at(volume, a, u, piece.at(a, u)) >= least ? piece.at(a, u) : kNone;
  });
}

/// What the wall gets of a part at right angles to it, up to a factor.
double light_of(const DepthMap& part, const BackProjection& volume) {
  double light = 0;
  for (int u = 0; u < part.height; ++u)
    for (int a = 0; a < part.width; ++a)
      if (const double albedo = part.has(a, u) ? albedo_at(volume, a, u, part.at(a, u)) : 0; albedo > 0)
        light += albedo / std::pow(length(Vec3{volume.across[a - kRoom], volume.up[u - kRoom], part.at(a, u)}), 4);
  return light;
}

/// Without those that have hardly any part in the light of all.
std::vector<DepthMap> lit(std::vector<DepthMap> parts, const BackProjection& volume) {
  std::vector<double> lights;
  for (const DepthMap& part : parts) lights.push_back(light_of(part, volume));
  const double least = kLeastLight * std::accumulate(lights.begin(), lights.end(), 0.0);
  std::vector<DepthMap> result;
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (lights[i] >= least) result.push_back(std::move(parts[i]));
  return result;
}

bool meet(const DepthMap& one, const DepthMap& other, double jump) {
  for (std::size_t i = 0; i < one.depth.size(); ++i)
    if (std::abs(one.depth[i] - other.depth[i]) <= jump) return true;
  return false;
}

/// The parts with their margins, those together that meet then.
std::vector<DepthMap> joined(std::vector<DepthMap> parts, const BackProjection& volume, double step, double jump) {
  std::vector<DepthMap> grown;
  for (const DepthMap& part : parts) grown.push_back(part.grown(volume, step));
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      if (!meet(grown[i], grown[k], jump)) continue;
      parts[i] =
          parts[i].changed([&](int a, int u) { return parts[i].has(a, u) ? parts[i].at(a, u) : parts[k].at(a, u); });
      grown[i] = parts[i].grown(volume, step);
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(k));
      grown.erase(grown.begin() + static_cast<std::ptrdiff_t>(k));
      k = i;  // what is larger now may meet others
    }
  return grown;
}

/// Which cells, of kCellLines x kCellLines lines, have triangles: those with all corners and no jump between them, no two of which touch at a
/// corner alone.
std::set<std::pair<int, int>> cells(const DepthMap& map, double jump) {
  std::set<std::pair<int, int>> result;
  for (int u = 0; u + kCellLines < map.height; u += kCellLines)
    for (int a = 0; a + kCellLines < map.width; a += kCellLines) {
      const auto [low, high] = std::minmax(
          {map.at(a, u), map.at(a + kCellLines, u), map.at(a, u + kCellLines), map.at(a + kCellLines, u + kCellLines)});
      const bool whole = map.has(a, u) && map.has(a + kCellLines, u) && map.has(a, u + kCellLines) &&
                         map.has(a + kCellLines, u + kCellLines);
      if (whole && high - low <= jump) result.emplace(a, u);
    }
  for (bool touching = true; touching;) {
    touching = false;
    for (const auto& [a, u] : result) {
      for (const int side : {-kCellLines, kCellLines})
        touching = touching || (result.contains({a + side, u + kCellLines}) && !result.contains({a + side, u}) &&
                                !result.contains({a, u + kCellLines}));
      if (touching) {
        result.erase({a, u});
        break;
      }
    }
  }
  return result;
}

/// Vertices in the wall's frame, as if a voxel were 1 wide across and up.
Mesh meshed(const DepthMap& map, double jump) {
  Mesh mesh;
  std::map<std::pair<int, int>, int> numbers;
  const auto vertex = [&](int a, int u) {
    const auto [entry, is_new] = numbers.emplace(std::pair{a, u}, static_cast<int>(mesh.positions.size()));
    if (is_new) mesh.positions.push_back({static_cast<double>(a), static_cast<double>(u), map.at(a, u)});
    return entry->second;
  };
  for (const auto& [a, u] : cells(map, jump)) {
    const std::array corners{vertex(a, u), vertex(a, u + kCellLines), vertex(a + kCellLines, u + kCellLines),
                             vertex(a + kCellLines, u)};
    const auto depth = [&](int k) { return mesh.positions[corners[k]].z; };
    // Along the diagonal over which the sheet bends less.
    const int first = std::abs(depth(1) - depth(3)) < std::abs(depth(0) - depth(2)) ? 1 : 0;
    const auto corner = [&](int k) { return corners[(first + k) % 4]; };
    mesh.faces.push_back({corner(0), corner(1), corner(2)});
    mesh.faces.push_back({corner(0), corner(2), corner(3)});
  }
  return mesh;
}

/// Vertices of borders move towards the middle of their two neighbours there, but where a face would turn away from the wall.
void round_borders(Mesh& mesh) {
  std::set<std::pair<int, int>> sides;
  std::vector<std::vector<int>> faces(mesh.positions.size());
  for (int f = 0; f < static_cast<int>(mesh.faces.size()); ++f)
    for (int k = 0; k < 3; ++k) {
      sides.emplace(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]);
      faces[mesh.faces[f][k]].push_back(f);
    }
  std::map<int, std::array<int, 2>> neighbours;  // of border vertices, before and after
  for (const auto& [from, to] : sides) {
    if (sides.contains({to, from})) continue;
    neighbours[from][1] = to;
    neighbours[to][0] = from;
  }
  const auto turned = [&](int f) {
    const auto& [a, b, c] = mesh.faces[f];
    const std::vector<Vec3>& at = mesh.positions;
    return !(cross(at[b] - at[a], at[c] - at[a]).z < 0);
  };
  for (int round = 0; round < kRoundings; ++round)
    for (const auto& [v, beside] : neighbours) {
      Vec3& place = mesh.positions[v];
      const Vec3 old = place;
      place = 0.5 * old + 0.25 * (mesh.positions[beside[0]] + mesh.positions[beside[1]]);
      if (std::any_of(faces[v].begin(), faces[v].end(), turned)) place = old;
    }
}

}  // namespace

Mesh start_surface(const BackProjection& volume, const FirstSurface& first) {
  Mesh result;
  if (volume.depth.empty() || volume.across.size() < 2) return result;
  const double voxel = volume.across[1] - volume.across[0];
  const DepthMap map = padded(volume, first.depth);
  // Half of a disc as wide as the resolution: a single point looks larger.
  const double least_lines = 0.125 * std::numbers::pi * std::pow(volume.lateral_resolution / voxel, 2);
  const double step = kSteepestJoint * voxel;
  std::vector<DepthMap> parts;
  for (const DepthMap& piece : pieces(map, step, least_lines))
    for (DepthMap& part : pieces(within_outline(piece, volume), step, least_lines)) parts.push_back(std::move(part));
  const double jump = kSteepestJoint * std::numbers::sqrt2 * kCellLines * voxel;
  const double left = volume.across[0] - 0.5 * voxel * (map.width - static_cast<int>(volume.across.size())),
               bottom = volume.up[0] - 0.5 * voxel * (map.height - static_cast<int>(volume.up.size()));
  for (const DepthMap& part : joined(lit(std::move(parts), volume), volume, step, jump)) {
    Mesh mesh = meshed(part.smooth(), jump);
    round_borders(mesh);
    const int before = static_cast<int>(result.positions.size());
    for (const Vec3& p : mesh.positions)
      result.positions.push_back(volume.frame.to_capture({left + p.x * voxel, bottom + p.y * voxel, p.z}));
    for (const auto& face : mesh.faces) result.faces.push_back({face[0] + before, face[1] + before, face[2] + before});
  }
  return result;
}

}  // namespace isochron
