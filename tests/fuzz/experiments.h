// An experiment, down to the point where rendering would begin.
#pragma once
#include "optim/problem/problem.h"
#include "tests/fuzz/scenes.h"

namespace isochron::fuzz {

inline Folder folder_of_experiments() {
  Folder folder;
  write_meshes(folder);
  folder.write("scene.yaml",
               "camera: {position: [0, 3, 3], look_at: [0, 0, 0], fov: 40, resolution: [4, 4]}\n"
               "materials:\n"
               "  white: {type: diffuse, albedo: 0.6}\n"
               "  metal: {type: rough_conductor, roughness: 0.3, reflectance: 0.9}\n"
               "shapes:\n"
               "  - {name: quad, file: quad.obj, material: metal}\n"
               "  - {name: lamp, file: lamp.off, material: white, emission: 10}\n");
  folder.write("numbers.txt", "0.1, 0.2\n0.3 0.4\n");
  folder.write("table.txt", "-1 0\n0 2\n0 1\n1 0\n");
  return folder;
}

inline void check_experiment(const Folder& folder, const std::string& file) {
  const Problem problem(load_experiment(file));
  const Parameters& parameters = problem.parameters();
  check_scene(parameters.apply(std::vector<double>(parameters.initial())));
  for (const auto& entry : parameters.tangent(parameters.initial()).entries)
    require(std::isfinite(entry.coefficient), "tangents are finite");
  const GateShape& gate = problem.gates().shape();
  require(std::isfinite(gate.value(0)) && !std::isnan(gate.width()), "gates have values");
  // What the program writes for a later `resume` reads back.
  const std::string path = std::filesystem::path(file).parent_path().string();
  load_experiment(folder.write("resolved.yaml", resolved_yaml(problem.experiment(), path)));
}

}  // namespace isochron::fuzz
