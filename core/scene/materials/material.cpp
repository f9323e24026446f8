#include "core/scene/materials/material.h"

#include <algorithm>
#include <stdexcept>

namespace isochron {

std::vector<std::pair<std::string, std::vector<std::string>>> material_quantities() {
  std::vector<std::pair<std::string, std::vector<std::string>>> all;
  const auto add = [&](const std::string& name, const char* kind) {
    if (name.empty()) return;
    auto same = std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.first == name; });
    if (same == all.end()) same = all.insert(all.end(), {name, {}});
    same->second.push_back(kind);
  };
  for (const MaterialKind* kind : material_kinds())
    for (const Quantity& quantity : kind->make()->quantities()) {
      add(quantity.name, kind->name);
      add(quantity.other_name, kind->name);
    }
  return all;
}

Material::Material(const std::string& kind, std::string own_name) : name(std::move(own_name)) {
  for (const MaterialKind* each : material_kinds())
    if (kind == each->name) {
      kind_ = each->name;
      bsdf_ = each->make();
      return;
    }
  throw std::logic_error("no kind of material: " + kind);
}

int Material::numbers() const {
  int count = 0;
  for (const Quantity& quantity : quantities()) count += static_cast<int>(quantity.values.size());
  return count;
}

int Material::find(const std::string& name_of_quantity, Quantity* found) const {
  int first = 0;
  for (const Quantity& quantity : quantities()) {
    if (name_of_quantity == quantity.name || name_of_quantity == quantity.other_name) {
      if (found) *found = quantity;
      return first;
    }
    first += static_cast<int>(quantity.values.size());
  }
  return -1;
}

double Material::number(int k) const {
  for (const Quantity& quantity : quantities()) {
    const int count = static_cast<int>(quantity.values.size());
    if (k < count) return quantity.values[k];
    k -= count;
  }
  throw std::logic_error("no such number");
}

void Material::set_number(int k, double value) {
  for (const Quantity& quantity : quantities()) {
    const int count = static_cast<int>(quantity.values.size());
    if (k < count) {
      quantity.values[k] = value;
      bsdf_->numbers_changed();
      return;
    }
    k -= count;
  }
  throw std::logic_error("no such number");
}

void Material::set(const std::string& name_of_quantity, const Rgb& value) {
  Quantity quantity;
  if (find(name_of_quantity, &quantity) < 0) throw std::logic_error("no such quantity: " + name_of_quantity);
  for (std::size_t c = 0; c < quantity.values.size(); ++c) quantity.values[c] = value[static_cast<int>(c)];
  bsdf_->numbers_changed();
}

}  // namespace isochron
