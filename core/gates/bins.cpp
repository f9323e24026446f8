// Bins of a histogram: contiguous boxcars, convolved with how much later than it arrived a detector counts light.
#include <fmt/format.h>

#include <cmath>

#include "core/base/error.h"
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

class Bins final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers& read_numbers) override {
    const std::string of_file = "that of the target's file";
    const auto key = [&](const char* name, const Field& field, const char* meaning, const char* unit) {
      if (keys.value(name, field, meaning, {.unit = unit, .unset = given_ == 0, .otherwise = of_file})) ++given_;
    };
    key("start", field::number(start_), "where the first bin begins; may be negative", "`unit`");
    key("width", field::positive(width_), "of a bin; each begins where the one before ends", "`unit`");
    key("count", field::integer(count_, 1, kMostGates), "how many", "");
    keys.value(
        "response", response(read_numbers),
        "the detector's: how much later than it arrives light is counted; piecewise linear, scaled to an integral of 1",
        {.unit = "`unit`", .unset = offsets_.empty(), .otherwise = "none: at once"});
  }
  void check(const YamlValue& gates) const override {
    if (given_ != 0 && given_ != kKeys)
      gates.fail("some of start, width and count are missing", "all three, or none: those of the target's file");
    // The difference of two integrals of the response, of which rounding would leave nothing.
    constexpr double kLeastOfResponse = 1e-9;
    const double length = offsets_.empty() ? 0 : offsets_.back() - offsets_.front();
    if (given_ != 0 && width_ < kLeastOfResponse * length)
      gates.fail(fmt::format("a bin's width of {} is too small beside a response as long as {}", width_, length),
                 fmt::format("at least {} of it", kLeastOfResponse));
  }
  GateShape shape(const GateUnits& units) const override {
    const double scale = units.length * stretch_;
    if (offsets_.empty()) return GateShape::boxcar(scale * width_);
    std::vector<double> scaled = offsets_;
    for (double& offset : scaled) offset *= scale;
    return GateShape::bin(scale * width_, scaled, values_);
  }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<Bins>(*this);
    copy->stretch_ *= factor;
    return copy;
  }

  bool has_centers() const override { return false; }
  GateMarks marks() const override {
    GateMarks middles;
    for (int i = 0; i < count_; ++i) middles.numbers.push_back(start_ + (i + 0.5) * width_);
    return middles;
  }
  std::vector<double> own_centers(const GateUnits& units) const override {
    std::vector<double> centers = marks().numbers;
    for (double& center : centers) center *= units.length;
    return centers;
  }
  bool needs_bins() const override { return given_ == 0; }
  std::optional<BinGrid> bins(const GateUnits& units) const override {
    return BinGrid{units.length * start_, units.length * width_, count_};
  }
  std::shared_ptr<GateDescription> with_bins(double start, double width, int count) const override {
    auto copy = std::make_shared<Bins>(*this);
    copy->given_ = kKeys;
    copy->start_ = start;
    copy->width_ = width;
    copy->count_ = count;
    return copy;
  }

 private:
  /// A file, or {offsets, values}, which is how a resolved file has it.
  Field response(const ReadNumbers& read_numbers) {
    const auto read = [this, &read_numbers](const YamlValue& value) {
      offsets_.clear();
      values_.clear();
      if (value.is_map()) {
        YamlMap map = value.map();
        offsets_ = map.require("offsets").numbers();
        values_ = map.require("values").numbers();
        map.reject_unknown();
      } else {
        for (const auto& row : read_numbers(value, {"offset", "value"})) {
          offsets_.push_back(row[0]);
          values_.push_back(row[1]);
        }
      }
      try {
        GateShape::bin(1, offsets_, values_);
      } catch (const InputError& error) {
        value.fail(error.what());
      }
    };
    const auto write = [this] {
      return fmt::format("{{offsets: {}, values: {}}}", yaml_list(offsets_), yaml_list(values_));
    };
    return {"file of numbers, or {offsets, values}", "rows of an offset and a value of at least 0, offsets rising",
            read, write};
  }

  static constexpr int kKeys = 3;
  int given_ = 0;  ///< how many of start, width and count
  double start_ = 0, width_ = 0;
  int count_ = 0;
  double stretch_ = 1;
  std::vector<double> offsets_, values_;  ///< of the response; empty: none
};

/// Measured responses come with zeros before and after, which would only make the gates' support longer: without them.
LinearDensity response_density(std::vector<double> offsets, std::vector<double> values) {
  if (offsets.size() == values.size()) {
    std::size_t first = 0, end = values.size();
    while (end > first + 2 && values[first] == 0 && values[first + 1] == 0) ++first;
    while (end > first + 2 && values[end - 1] == 0 && values[end - 2] == 0) --end;
    offsets = {offsets.begin() + first, offsets.begin() + end};
    values = {values.begin() + first, values.begin() + end};
  }
  return LinearDensity(offsets, values, "response");
}

}  // namespace

GateShape GateShape::bin(double width, const std::vector<double>& offsets, const std::vector<double>& values) {
  require_positive(width, "width");
  GateShape shape;
  shape.kind_ = GateKind::bin;
  shape.table_ = response_density(offsets, values);
  shape.begin_ = -0.5 * width;
  shape.end_ = 0.5 * width;
  shape.lower_ = shape.begin_ - shape.table_.upper();
  shape.upper_ = shape.end_ - shape.table_.lower();
  shape.detail_ = width / std::sqrt(12.0);
  shape.width_ = std::hypot(shape.detail_, shape.table_.deviation());
  shape.peak_ = 1 / width;
  shape.segments_.push_back(
      {shape.peak_, {Side::Form::delayed, shape.begin_, 0}, {Side::Form::delayed, shape.end_, 0}});
  shape.finish_parts();
  return shape;
}

extern const GateKindEntry kBins;
const GateKindEntry kBins{"bins", "the bins of a histogram of arrival times, with the detector's response",
                          make_gate<Bins>};

}  // namespace isochron
