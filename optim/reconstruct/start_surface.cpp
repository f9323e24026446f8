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

#include "core/base/self_weighted_mean.h"

namespace isochron {
namespace {

constexpr int kCellLines = 2;  // voxels from vertex to vertex
/// Voxels on either side of the brightest that count as the same surface: a depth resolution.
constexpr int kSameSurface = 4;
constexpr int kRoundings = 6;  // of borders, by the weights 1, 2, 1 each: steps of a grid are gone after that
/// How far borders move by that, diagonals of a cell: a part of one cell keeps half its width.
constexpr double kRounded = 0.25;
/// Depth over distance. Webs that this makes tear later, by their albedo; what is cut here does not grow together. With 2 the base of an ear of
/// the rabbit was cut off, and its silhouette missed 0.07 of it in place of 0.06.
constexpr double kSteepestJoint = 4;
/// Standard deviation of the weights that albedos are averaged with, resolutions. With 1.4 voxels in place of it, twice as much where points
/// are few, the blob under 8 x 8 spots ends at a silhouette of 0.862 and p = 2e-31, with this at 0.906 and 0.007.
constexpr double kBlurring = 0.35;
constexpr double kMargin = 0.5;     // resolutions
constexpr double kSmoothing = 0.5;  // standard deviation of the weights that depths are averaged with, resolutions
/// Of the albedo that light comes from on average, along a line. Flat sheets end where half is left, but steep parts send as little.
/// Silhouettes of seven shapes (rabbit, spots, blob, plates, one spot, bust, wide wall) with 0.1, 0.15 and 0.2: means of 0.787, 0.788, 0.768.
constexpr double kOutline = 0.15;
/// Before the parts are known, of all.
constexpr double kLeastOutline = 0.05;
/// Of the same: a margin has at least that, as gaps have less. The same silhouettes with a margin of two voxels, where at least 0, 0.05
/// and 0.08 are left: 0.743, 0.763, 0.780; but a fit extends a border less easily than it draws it back, and ends at the rabbit with p = 0.8,
/// 0.07, 0.001.
constexpr double kLeastMargin = 0.05;
/// What noise leaves, far from all light and close to the wall, passes for specks of surfaces. Six of them before a wall of 2 m, where
/// the blob has all other light, had less than this each.
constexpr double kLeastLight = 0.01;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Of each line of sight the albedo of its brightest surface, and that one's depth.
struct Lines {
  std::vector<double> albedo, depth;
};

/// A depth for each line of sight; not a number where there is none.
struct DepthMap {
  int width, height;
  std::vector<double> depth;
  std::size_t index(int a, int u) const { return static_cast<std::size_t>(u) * width + a; }
  double& at(int a, int u) { return depth[index(a, u)]; }
  double at(int a, int u) const { return a < 0 || u < 0 || a >= width || u >= height ? kNone : depth[index(a, u)]; }
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
  /// With the margin of a part, whose depths are those of its lines if they are no farther than `jump` from those nearby.
  DepthMap grown(const Lines& lines, int rings, double jump) const {
    const double least = kLeastMargin * mean_albedo(lines);
    DepthMap result = *this;
    for (int ring = 0; ring < rings; ++ring)
      result = result.changed([&](int a, int u) {
        if (result.has(a, u) || lines.albedo[index(a, u)] < least) return result.at(a, u);
        const double nearby = result.mean_around(a, u), own = lines.depth[index(a, u)];
        return std::abs(own - nearby) <= jump ? own : nearby;
      });
    return result;
  }
  /// That light of it comes from.
  double mean_albedo(const Lines& lines) const {
    SelfWeightedMean found;
    for (std::size_t i = 0; i < depth.size(); ++i)
      if (std::isfinite(depth[i])) found.add(lines.albedo[i]);
    return found.mean();
  }
  DepthMap smooth(int rounds) const {
    DepthMap result = *this;
    for (int round = 0; round < rounds; ++round)
      result = result.changed([&](int a, int u) { return result.has(a, u) ? result.mean_around(a, u) : kNone; });
    return result;
  }
};

/// Of averages that each add a `step` to the variance, at least one: so many make that standard deviation.
int rounds_of(double deviation, double step) {
  return std::max(1, static_cast<int>(std::lround(deviation * deviation / step)));
}

/// Along each axis, by the weights 1, 2, 1.
std::vector<float> blurred(const LikelyAlbedos& volume) {
  const int rounds = rounds_of(kBlurring * volume.resolution / (volume.across[1] - volume.across[0]), 0.5);
  std::vector<float> albedo = volume.albedo;
  const std::size_t across = volume.across.size(), up = volume.up.size(), depth = volume.depth.size();
  for (int round = 0; round < rounds; ++round)
    for (const auto& [step, count] : {std::pair{std::size_t{1}, across}, {across, up}, {across * up, depth}})
      for (std::size_t line = 0; line < albedo.size() / count; ++line) {
        float* first = &albedo[line % step + line / step * step * count];
        float before = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const float here = first[i * step], next = i + 1 < count ? first[(i + 1) * step] : 0;
          first[i * step] = 0.25f * before + 0.5f * here + 0.25f * next;
          before = here;
        }
      }
  return albedo;
}

Lines brightest(const LikelyAlbedos& volume) {
  const std::vector<float> albedo = blurred(volume);
  const std::size_t lines = volume.across.size() * volume.up.size();
  const int depths = static_cast<int>(volume.depth.size());
  Lines result{std::vector<double>(lines), std::vector<double>(lines, kNone)};
  for (std::size_t line = 0; line < lines; ++line) {
    int top = 0;
    for (int d = 1; d < depths; ++d)
      if (albedo[d * lines + line] > albedo[top * lines + line]) top = d;
    double moment = 0;
    for (int d = std::max(0, top - kSameSurface); d <= std::min(depths - 1, top + kSameSurface); ++d) {
      result.albedo[line] += albedo[d * lines + line];
      moment += albedo[d * lines + line] * volume.depth[d];
    }
    if (result.albedo[line] > 0) result.depth[line] = moment / result.albedo[line];
  }
  return result;
}

/// The pieces of at least so many lines that hang together without jumps of more than `jump` from line to line, each alone.
std::vector<DepthMap> pieces(const DepthMap& map, double jump, double least_lines) {
  std::vector<DepthMap> result;
  DepthMap left = map;
  for (int start = 0; start < static_cast<int>(map.depth.size()); ++start) {
    if (!std::isfinite(left.depth[start])) continue;
    std::vector<std::size_t> lines{static_cast<std::size_t>(start)};
    left.depth[start] = kNone;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const int a = static_cast<int>(lines[i]) % map.width, u = static_cast<int>(lines[i]) / map.width;
      for (const auto& [da, du] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!left.has(a + da, u + du) || std::abs(left.at(a + da, u + du) - map.at(a, u)) > jump) continue;
        left.at(a + da, u + du) = kNone;
        lines.push_back(map.index(a + da, u + du));
      }
    }
    if (static_cast<double>(lines.size()) < least_lines) continue;
    DepthMap piece{map.width, map.height, std::vector<double>(map.depth.size(), kNone)};
    for (const std::size_t line : lines) piece.depth[line] = map.depth[line];
    result.push_back(std::move(piece));
  }
  return result;
}

/// Without lines of less than `share` of its albedo: what lies beyond its outline looks as if it had less, as the outline is blurred.
DepthMap within_outline(const DepthMap& piece, const Lines& lines, double share) {
  const double least = share * piece.mean_albedo(lines);
  DepthMap result = piece;
  for (std::size_t i = 0; i < piece.depth.size(); ++i)
    if (!(lines.albedo[i] >= least)) result.depth[i] = kNone;
  return result;
}

/// What the wall gets of a part at right angles to it, up to a factor.
double light_of(const DepthMap& part, const LikelyAlbedos& volume, const Lines& lines) {
  double light = 0;
  for (int u = 0; u < part.height; ++u)
    for (int a = 0; a < part.width; ++a)
      if (part.has(a, u))
        light +=
            lines.albedo[part.index(a, u)] / std::pow(length(Vec3{volume.across[a], volume.up[u], part.at(a, u)}), 4);
  return light;
}

/// Without those that have hardly any part in the light of all.
std::vector<DepthMap> lit(std::vector<DepthMap> parts, const LikelyAlbedos& volume, const Lines& lines) {
  std::vector<double> lights;
  for (const DepthMap& part : parts) lights.push_back(light_of(part, volume, lines));
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
std::vector<DepthMap> joined(std::vector<DepthMap> parts, const Lines& lines, int rings, double step, double jump) {
  std::vector<DepthMap> grown;
  for (const DepthMap& part : parts) grown.push_back(part.grown(lines, rings, step));
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      if (!meet(grown[i], grown[k], jump)) continue;
      parts[i] =
          parts[i].changed([&](int a, int u) { return parts[i].has(a, u) ? parts[i].at(a, u) : parts[k].at(a, u); });
      grown[i] = parts[i].grown(lines, rings, step);
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(k));
      grown.erase(grown.begin() + static_cast<std::ptrdiff_t>(k));
      k = i;  // what is larger now may meet others
    }
  return grown;
}

/// Cells of kCellLines x kCellLines lines, of the grid that begins at these lines: those with all corners and no jump between them.
std::set<std::pair<int, int>> whole_cells(const DepthMap& map, double jump, int first_a, int first_u) {
  std::set<std::pair<int, int>> result;
  for (int u = first_u; u + kCellLines < map.height; u += kCellLines)
    for (int a = first_a; a + kCellLines < map.width; a += kCellLines) {
      const auto [low, high] = std::minmax(
          {map.at(a, u), map.at(a + kCellLines, u), map.at(a, u + kCellLines), map.at(a + kCellLines, u + kCellLines)});
      const bool whole = map.has(a, u) && map.has(a + kCellLines, u) && map.has(a, u + kCellLines) &&
                         map.has(a + kCellLines, u + kCellLines);
      if (whole && high - low <= jump) result.emplace(a, u);
    }
  return result;
}

/// Which cells have triangles: no two of them touch at a corner alone.
std::set<std::pair<int, int>> cells(const DepthMap& map, double jump) {
  // A part that is no larger than a cell may lie between those of a grid.
  std::set<std::pair<int, int>> result;
  for (int begin = 0; result.empty() && begin < kCellLines * kCellLines; ++begin)
    result = whole_cells(map, jump, begin % kCellLines, begin / kCellLines);
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

/// Vertices of borders move towards the middle of their two neighbours there, no further than kRounded, but where a face would turn away from
/// the wall or reach over more than `jump` in depth.
void round_borders(Mesh& mesh, double jump) {
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
  const auto spoilt = [&](int f) {
    const auto& [a, b, c] = mesh.faces[f];
    const std::vector<Vec3>& at = mesh.positions;
    const auto [low, high] = std::minmax({at[a].z, at[b].z, at[c].z});
    return !(cross(at[b] - at[a], at[c] - at[a]).z < 0) || high - low > jump;
  };
  const std::vector<Vec3> before = mesh.positions;
  const double farthest = kRounded * std::numbers::sqrt2 * kCellLines;
  for (int round = 0; round < kRoundings; ++round)
    for (const auto& [v, beside] : neighbours) {
      Vec3& place = mesh.positions[v];
      const Vec3 old = place;
      place = 0.5 * old + 0.25 * (mesh.positions[beside[0]] + mesh.positions[beside[1]]);
      const Vec3 moved = place - before[v];
      const double far = std::hypot(moved.x, moved.y);
      if (far > farthest) place = before[v] + moved * (farthest / far);
      if (std::any_of(faces[v].begin(), faces[v].end(), spoilt)) place = old;
    }
}

}  // namespace

Mesh start_surface(const LikelyAlbedos& volume) {
  Mesh result;
  if (volume.albedo.empty()) return result;
  const double voxel = volume.across[1] - volume.across[0], resolution = volume.resolution / voxel;
  const Lines lines = brightest(volume);
  const DepthMap map = within_outline(
      {static_cast<int>(volume.across.size()), static_cast<int>(volume.up.size()), lines.depth}, lines, kLeastOutline);
  // Half of a disc as wide as the resolution: a single point looks larger.
  const double least_lines = 0.125 * std::numbers::pi * resolution * resolution;
  const double step = kSteepestJoint * voxel;
  std::vector<DepthMap> parts;
  for (const DepthMap& piece : pieces(map, step, least_lines))
    for (DepthMap& part : pieces(within_outline(piece, lines, kOutline), step, least_lines))
      parts.push_back(std::move(part));
  const double jump = kSteepestJoint * std::numbers::sqrt2 * kCellLines * voxel;
  const int rings = std::max(1, static_cast<int>(std::lround(kMargin * resolution)));
  const int smoothings = rounds_of(kSmoothing * resolution, 2.0 / 3);
  for (const DepthMap& part : joined(lit(std::move(parts), volume, lines), lines, rings, step, jump)) {
    Mesh mesh = meshed(part.smooth(smoothings), jump);
    round_borders(mesh, jump);
    for (Vec3& p : mesh.positions)
      p = volume.frame.to_capture({volume.across[0] + p.x * voxel, volume.up[0] + p.y * voxel, p.z});
    const int before = static_cast<int>(result.positions.size());
    result.positions.insert(result.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const auto& face : mesh.faces) result.faces.push_back({face[0] + before, face[1] + before, face[2] + before});
  }
  return result;
}

}  // namespace isochron
