// What an experiment says of its gates: the interface of a kind of gate. Each kind has a file of its own in this folder, with the
// shape that it stands for, and a line in registry.cpp.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/description.h"
#include "core/gates/gate.h"

namespace isochron {

/// Rows of numbers from the text file that a value names, and how many each row has.
using ReadNumbers = std::function<std::vector<std::vector<double>>(const YamlValue&, std::size_t)>;

class GateDescription {
 public:
  virtual ~GateDescription() = default;
  /// Its keys. Lengths are in the unit of the gates.
  virtual void describe(Keys& keys, const ReadNumbers& read_numbers) = 0;
  /// Checks of several keys together; `gates` is the map that they stand in.
  virtual void check(const YamlValue& /*gates*/) const {}
  /// The shape in scene units, `unit` of which make one of its own. Throws InputError where there is none.
  virtual GateShape shape(double unit) const = 0;
  /// The same kind with all lengths multiplied.
  virtual std::shared_ptr<GateDescription> stretched(double factor) const = 0;
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
