// A material of a scene, and the kinds that there are.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/materials/bsdf.h"

namespace isochron {

/// A kind of material, as registry.cpp lists it.
struct MaterialKind {
  const char* name;  ///< in scene files
  const char* meaning;
  std::unique_ptr<Bsdf> (*make)();
};
std::span<const MaterialKind* const> material_kinds();
template <class T>
std::unique_ptr<Bsdf> make_bsdf() {
  return std::make_unique<T>();
}
/// The names of all that can be differentiated in any of them, each with the names of the kinds that have it.
std::vector<std::pair<std::string, std::vector<std::string>>> material_quantities();

/// What a surface is made of. Copies are deep.
class Material {
 public:
  /// Of a kind by its name; all its values are the defaults. Throws std::logic_error where there is none.
  explicit Material(const std::string& kind, std::string name = "");
  Material(const Material& other) : name(other.name), kind_(other.kind_), bsdf_(other.bsdf_->clone()) {}
  Material(Material&&) = default;
  Material& operator=(Material other) {
    name = std::move(other.name);
    kind_ = other.kind_;
    bsdf_ = std::move(other.bsdf_);
    return *this;
  }

  const Bsdf& bsdf() const { return *bsdf_; }
  Bsdf& bsdf() { return *bsdf_; }
  const char* kind() const { return kind_; }

  /// Its differentiable scalars.
  int numbers() const;
  /// Where the quantity of this name, or other name, stands among its numbers, and what it is; -1: it has none.
  int find(const std::string& quantity, Quantity* found = nullptr) const;
  double number(int k) const;
  void set_number(int k, double value);
  /// All values of a quantity. Throws std::logic_error where it has none.
  void set(const std::string& quantity, const Rgb& value);
  void set(const std::string& quantity, double value) { set(quantity, Rgb(value)); }

  std::string name;

 private:
  /// They point at the numbers of the Bsdf, also of a constant Material, whose functions only read them.
  std::vector<Quantity> quantities() const { return bsdf_->quantities(); }

  const char* kind_;
  std::unique_ptr<Bsdf> bsdf_;
};

}  // namespace isochron
