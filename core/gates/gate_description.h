// What an experiment says of its gates: the interface of a kind of gate. Each kind has a file of its own in this folder, with the
// shape that it stands for, and a line in registry.cpp.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/description.h"
#include "core/gates/gate.h"

namespace isochron {

/// Rows of numbers from the file, text or a NumPy array, that a value names, a number for each of these columns. The file may have their names as
/// its first row.
using ReadNumbers =
    std::function<std::vector<std::vector<double>>(const YamlValue&, const std::vector<std::string>& columns)>;

inline constexpr double kSpeedOfLight = 299792458;  ///< m/s
inline constexpr int kMostGates = 100000;

/// What turns lengths as written into others.
struct GateUnits {
  double length = 1;        ///< scene units in one unit of the gates' lengths
  double scene_unit_m = 0;  ///< metres in a scene unit; 0 where the file does not say
};

/// The number that tables and pictures label each gate with: its centre, a phase. None where gates do not differ.
struct GateMarks {
  std::vector<double> numbers;
  std::string unit;  ///< empty: the unit of the gates' lengths
};

/// Contiguous bins, in scene units.
struct BinGrid {
  double start, width;
  int count;
};

class GateDescription {
 public:
  virtual ~GateDescription() = default;
  /// Its keys. Lengths are in the unit of the gates.
  virtual void describe(Keys& keys, const ReadNumbers& read_numbers) = 0;
  /// Checks of several keys together; `gates` is the map that they stand in.
  virtual void check(const YamlValue& /*gates*/) const {}
  /// The shape in scene units. Throws InputError where there is none.
  virtual GateShape shape(const GateUnits& units) const = 0;
  /// The same kind with all lengths of a gate multiplied; centres stay.
  virtual std::shared_ptr<GateDescription> stretched(double factor) const = 0;

  /// Whether the key `centers` says where the gates are. Otherwise the kind has marks and centres of its own.
  virtual bool has_centers() const { return true; }
  virtual GateMarks marks() const { return {}; }
  /// In scene units.
  virtual std::vector<double> own_centers(const GateUnits&) const { return {0.0}; }
  /// Light of every length counts: GateShape::is_unbounded.
  virtual bool unbounded() const { return false; }
  /// Whether it must be known how long a scene unit is, whatever the unit of lengths.
  virtual bool needs_metres() const { return false; }

  /// Whether its bins were not given: they are those of the target's file. Until with_bins there is neither shape nor centre.
  virtual bool needs_bins() const { return false; }
  /// Those that it has.
  virtual std::optional<BinGrid> bins(const GateUnits&) const { return std::nullopt; }
  /// The same with `count` bins, each so wide, the first beginning at `start`, in the unit of lengths.
  virtual std::shared_ptr<GateDescription> with_bins(double /*start*/, double /*width*/, int /*count*/) const {
    throw std::logic_error("this kind of gate has no bins");
  }
};

/// A kind of gate, as registry.cpp lists it.
struct GateKindEntry {
  const char* name;  ///< in experiment files
  const char* meaning;
  std::shared_ptr<GateDescription> (*make)();
};
std::span<const GateKindEntry* const> gate_kinds();
template <class T>
std::shared_ptr<GateDescription> make_gate() {
  return std::make_shared<T>();
}

}  // namespace isochron
