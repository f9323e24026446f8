#include "optim/reconstruct/histograms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/base/error.h"

namespace isochron {
namespace {

struct Rectangle {
  double low[2] = {0, 0}, high[2] = {0, 0};

  explicit Rectangle(const std::vector<Histograms::Row>& rows) {
    for (int axis = 0; axis < 2; ++axis) {
      const auto [first, last] = std::minmax_element(
          rows.begin(), rows.end(), [axis](const auto& a, const auto& b) { return a.sensor[axis] < b.sensor[axis]; });
      low[axis] = first->sensor[axis];
      high[axis] = last->sensor[axis];
    }
  }
  double side(int axis) const { return high[axis] - low[axis]; }
};

/// Of single points or spots the numbers of the squares that they lie in, and the mean places of those.
struct Squares {
  std::vector<int> of;
  std::vector<Vec3> middle;

  Squares(const std::vector<Vec3>& places, double side) {
    std::map<std::pair<long, long>, int> numbers;
    std::vector<int> members;
    for (const Vec3& p : places) {
      const std::pair key{std::lround(std::floor(p.x / side)), std::lround(std::floor(p.y / side))};
      const int number = numbers.emplace(key, static_cast<int>(numbers.size())).first->second;
      if (number == static_cast<int>(middle.size())) middle.emplace_back(), members.push_back(0);
      middle[number] += p;
      ++members[number];
      of.push_back(number);
    }
    for (std::size_t i = 0; i < middle.size(); ++i) middle[i] = middle[i] / static_cast<double>(members[i]);
  }
};

bool finite(const double* values, int count) {
  return std::all_of(values, values + count, [](double v) { return std::isfinite(v); });
}

}  // namespace

double Histograms::half_side() const {
  const Rectangle rectangle(rows);
  return 0.5 * std::max(rectangle.side(0), rectangle.side(1));
}

double Histograms::spacing() const {
  const Rectangle rectangle(rows);
  const double points = static_cast<double>(rows.size()) / static_cast<double>(std::max<std::size_t>(1, spots.size()));
  return std::max(std::sqrt(rectangle.side(0) * rectangle.side(1) / points), 2 * half_side() / points);
}

Histograms histograms(const CaptureFile& capture, const WallFrame& frame, const std::vector<std::uint8_t>& used) {
  const CaptureGeometry& geometry = capture.geometry;
  const int points = static_cast<int>(geometry.sensor.size());
  if (!used.empty() && static_cast<int>(used.size()) != points)
    throw InputError("the mask has " + std::to_string(used.size()) + " values for " + std::to_string(points) +
                     " points");
  Histograms result;
  result.bin = capture.delta_t;
  result.bins = capture.counts.gates;
  // Light goes both ways alike: one point that looks while the laser scans is a spot, and the spots are points.
  const bool swapped = points == 1 && geometry.spots() > 1;
  for (const Vec3& spot : swapped ? geometry.sensor : geometry.laser) result.spots.push_back(frame.to_wall(spot));
  for (int spot = 0; spot < geometry.spots(); ++spot) {
    for (int point = 0; point < points; ++point) {
      const double* counts = &capture.counts.data[capture.counts.index(spot * points + point, 0)];
      if ((!used.empty() && !used[point]) || !finite(counts, result.bins)) continue;
      const Vec3& lit = geometry.confocal ? geometry.sensor[point] : geometry.laser[spot];
      const double before =
          geometry.accounts_first_and_last
              ? length(geometry.laser_origin - lit) + length(geometry.sensor[point] - geometry.sensor_origin)
              : 0;
      result.rows.push_back({frame.to_wall(swapped ? lit : geometry.sensor[point]),
                             geometry.confocal ? -1
                             : swapped         ? 0
                                               : spot,
                             capture.t_start + 0.5 * capture.delta_t - before});
      result.counts.insert(result.counts.end(), counts, counts + result.bins);
    }
  }
  if (result.rows.empty()) throw InputError("no point of the capture has counts that can be used");
  return result;
}

Histograms grouped(const Histograms& histograms, double side) {
  std::vector<Vec3> places;
  for (const Histograms::Row& row : histograms.rows) places.push_back(row.sensor);
  const Squares sensors(places, side), spots(histograms.spots, side);

  Histograms result;
  result.bin = histograms.bin;
  result.bins = histograms.bins;
  result.spots = spots.middle;
  std::map<std::pair<int, int>, std::size_t> numbers;  // (spot, square of sensor points), so that rows are by spot
  for (std::size_t i = 0; i < histograms.rows.size(); ++i) {
    const int spot = histograms.rows[i].spot;
    numbers.emplace(std::pair{spot < 0 ? -1 : spots.of[spot], sensors.of[i]}, 0);
  }
  for (auto& [key, number] : numbers) {
    number = result.rows.size();
    result.rows.push_back({Vec3(), key.first, 0});
  }
  result.counts.resize(result.rows.size() * result.bins);
  std::vector<int> members(result.rows.size());
  std::vector<double> begin(result.rows.size());
  for (std::size_t i = 0; i < histograms.rows.size(); ++i) {
    const Histograms::Row& row = histograms.rows[i];
    const std::size_t number = numbers.at({row.spot < 0 ? -1 : spots.of[row.spot], sensors.of[i]});
    if (members[number]++ == 0) begin[number] = row.start;
    const int shift = static_cast<int>(std::lround((row.start - begin[number]) / result.bin));
    for (int bin = std::max(0, -shift); bin < std::min(result.bins, result.bins - shift); ++bin)
      result.counts[number * result.bins + bin + shift] += histograms.of(i)[bin];
    result.rows[number].sensor += row.sensor;
    result.rows[number].start += row.start - shift * result.bin;
  }
  for (std::size_t i = 0; i < result.rows.size(); ++i) {
    result.rows[i].sensor = result.rows[i].sensor / static_cast<double>(members[i]);
    result.rows[i].start /= members[i];
  }
  return result;
}

}  // namespace isochron
