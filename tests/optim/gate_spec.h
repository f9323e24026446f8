// Gates of experiments from their text.
#pragma once
#include <string>

#include "optim/experiment/description.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {

/// `text` is a map in YAML.
inline GateSpec gate_spec(const std::string& text) {
  const TemporaryFolder folder;
  GateSpec spec;
  ExperimentFolder none{folder.file("")};
  read_keys(open_yaml(folder.write("gates.yaml", text)), [&](Keys& keys) { describe(keys, spec, none); });
  return spec;
}

}  // namespace isochron
