#include "optim/experiment/experiment.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <span>

#include "core/base/error.h"
#include "tests/optim/gate_spec.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

struct Refusal {
  std::string from, to;
  std::string message;  ///< after the file's name
};

/// The tiny experiment with each of the changes is refused with its message, of which the beginning is given.
void expect_messages(const TemporaryFolder& folder, std::span<const Refusal> cases) {
  for (const Refusal& c : cases) {
    const std::string file = folder.write("tiny.yaml", replaced(tiny_experiment(), c.from, c.to));
    try {
      load_experiment(file);
      ADD_FAILURE() << "accepted: " << c.to;
    } catch (const InputError& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.substr(0, file.size() + 1 + c.message.size()), file + ":" + c.message);
      EXPECT_EQ(what.find('\n'), std::string::npos);
    }
  }
}

TEST(Experiment, EveryErrorNamesItsPlaceAndWhatIsAllowed) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  folder.write("table.txt", "-1 0\n0, 1 # peak\n\n1 x\n");
  folder.write("wide.txt", "-1 0 3\n");
  folder.write("good.txt", "-1 0\n0 1\n");
  const std::string gates = "{kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}";
  const Refusal cases[] = {
      {"name: tiny", "nam: tiny", "1:1: name: is missing, is 'nam' a misspelling of it?"},
      {"name: tiny", "name: a/b", "1:7: name: 'a/b' is not a usable name (letters, digits, _ and -)"},
      {"scene.yaml", "none.yaml", "2:8: scene: there is no file 'none.yaml' (a path relative to the experiment file)"},
      {"scene.yaml", std::string(5000, 'x'), "2:8: scene: there is no file '" + std::string(40, 'x') + "...'"},
      {"type: translation, shape: block, direction: [0, 1, 0]", "type: rotation, shape: block, axis: [0, 1e200, 0]",
       "6:56: parameters[0].axis: is too long or too short (a length whose square a double can hold)"},
      {"max_bounces: 2", "max_bounces: -1", "3:14: max_bounces: -1 is out of range (an integer from 0 to 10000)"},
      {"max_bounces: 2", "max_bounces: 2.5", "3:14: max_bounces: '2.5' is not an integer that fits (an integer from 0"},
      {"max_bounces", "max_bounce",
       "3:1: max_bounce: is not a known key, did you mean 'max_bounces'? (allowed: name, "},
      {"kind: gaussian", "kind: boxcar, width: 1",
       "4:54: gates.sigma: belongs to gaussian and truncated_gaussian, not to boxcar (allowed: kind, "},
      {gates, "{kind: steady, centers: [4]}",
       "4:23: gates.centers: belongs to every kind but steady, bins and modulated (allowed: kind"},
      {"sigma: 0.3", "sigma: 1e-300",
       "4:8: gates: gates of a standard deviation of 1e-300 scene units are below the "
       "rounding of path lengths (at least 5.5e-12, 1e-12 of the longest centre)"},
      {"sigma: 0.3", "sigma: 1e-11, unit: scene, file: table.txt",
       "4:73: gates.file: belongs to tabulated, not to gau"},
      {"direction: [0, 1, 0],", "direction: [0, 1, 0], axis: [0, 1, 0],",
       "6:75: parameters[0].axis: belongs to rotation and camera_rotation, not to transl"},
      {"method: adam", "method: lbfgs, decay: {half_life: 3}",
       "10:28: optimizer.decay: belongs to adam, not to lbfgs (allowed: method"},
      {"kind: gaussian", "kind: gauss", "4:15: gates.kind: 'gauss' is not known"},
      {"centers: [4.5, 5.5]", "centers: []", "4:34: gates.centers: holds no gate (at least one number)"},
      {"centers: [4.5, 5.5]", "centers: [4.5, -1]", "4:40: gates.centers[1]: -1 is out of range (a number at least 0)"},
      {"centers: [4.5, 5.5]", "centers: {start: 5, stop: 4, count: 3}",
       "4:51: gates.centers.stop: 4 lies before start (at least 5)"},
      {"centers: [4.5, 5.5]", "centers: {start: 5, stop: 6, count: 0}", "4:61: gates.centers.count: 0 is out of range"},
      {"centers: [4.5, 5.5]", "centers: 5",
       "4:34: gates.centers: is neither (a list of numbers, or {start, stop, count})"},
      {"sigma: 0.3", "sigma: 0", "4:53: gates.sigma: 0 is out of range (a number above 0)"},
      {"sigma: 0.3", "sigma: 0.3, width: 1", "4:58: gates.width: belongs to boxcar and bins, not to gaussian"},
      {"sigma: 0.3", "sigma: 0.3, unit: ns", "4:8: gates.scene_unit_m: is missing"},
      {gates, "{kind: steady, centers: [1]}",
       "4:23: gates.centers: belongs to every kind but steady, bins and modulated"},
      {gates, "{kind: boxcar, centers: [1], width: .inf}", "4:44: gates.width: '.inf' is not a finite number"},
      {gates, "{kind: truncated_gaussian, centers: [1], sigma: 1}", "4:8: gates.half_width: is missing"},
      {gates, "{kind: tabulated, centers: [1], offsets: [0, 1], values: [1]}",
       "4:65: gates.values: 1 values are given (one for each of the 2 offsets)"},
      {gates, "{kind: tabulated, centers: [1], offsets: [1, 0], values: [1, 1]}",
       "4:8: gates: the table is not a gate (two rows or more, offsets in rising order, values at least 0"},
      {gates, "{kind: tabulated, centers: [1], file: good.txt, offsets: [0, 1]}",
       "4:56: gates.offsets: belongs to tables without a file (allowed: kind, file, centers, unit, scene_unit_m)"},
      {gates, "{kind: tabulated, centers: [1], file: gone.txt}", "4:46: gates.file: there is no file 'gone.txt'"},
      {"name: height", "name: target", "6:12: parameters[0].name: 'target' is the name of another output"},
      {"name: power", "name: height", "7:12: parameters[1].name: 'height' is given twice"},
      {"type: translation", "type: shift", "6:26: parameters[0].type: 'shift' is not known (allowed: translation, "},
      {"shape: block", "material: metal", "6:5: parameters[0].shape: is missing"},
      {"direction: [0, 1, 0]", "direction: [0, 0, 0]",
       "6:64: parameters[0].direction: the zero vector has no direction"},
      {"direction: [0, 1, 0]", "axis: [0, 1, 0]", "6:5: parameters[0].direction: is missing"},
      {"direction: [0, 1, 0]", "direction: [0, 1, 0], selection: {box: {min: [0, 0, 0]}}",
       "6:92: parameters[0].selection.box.max: is missing"},
      {"direction: [0, 1, 0]", "direction: [0, 1, 0], selection: 3",
       "6:86: parameters[0].selection: is neither (a list of vertex indices, or {box: {min, max}})"},
      {"type: translation, shape: block, direction: [0, 1, 0]", "type: vertices, shape: block, direction: inward",
       "6:61: parameters[0].direction: 'inward' is not known (allowed: normal, free)"},
      {"initial: 0.2", "initial: []", "6:84: parameters[0].initial: holds no number (at least one)"},
      {"initial: 0.2", "initial: [0.2, x]", "6:90: parameters[0].initial[1]: 'x' is not a finite number"},
      {"initial: 0.2", "initial: gone.txt", "6:84: parameters[0].initial: there is no file 'gone.txt'"},
      {", target: 0}", "}", "6:5: parameters[0].target: is missing"},
      {"target: 10}", "target: 10, lower: a}", "7:79: parameters[1].lower: there is no file 'a'"},
      {"samples: 64,", "samples: 0,", "8:19: target.samples: 0 is out of range (an integer from 1 to 1073741824)"},
      {"{samples: 64, seed: 7}", "{images: gone.exr}", "8:18: target.images: there is no file 'gone.exr'"},
      {"{samples: 64, seed: 7}", "{images: scene.yaml, seed: 7}",
       "8:30: target.seed: belongs to rendered targets, not to images (allowed: images, window, mask, "
       "histograms)"},
      {"primal: 16", "primal: 0", "9:19: samples.primal: 0 is out of range"},
      {"interior: 16", "interior: -2", "9:33: samples.interior: -2 is out of range"},
      {"path_length", "pathlength", "9:53: samples.pathlength: is not a known key, did you mean 'path_length'?"},
      {"iterations: 6", "iterations: 6, inner_iterations: 3",
       "10:63: optimizer.inner_iterations: belongs to lbfgs and quasi_newton, not to adam"},
      {"method: adam, learning_rate: 0.02, iterations: 6", "method: lbfgs, inner_iterations: 0",
       "10:46: optimizer.inner_iterations: 0 is out of range"},
      {"iterations: 6", "decay: {start: 5}", "10:55: optimizer.decay.half_life: is missing"},
      {"iterations: 6", "decay: {half_life: 0}",
       "10:67: optimizer.decay.half_life: 0 is out of range (a number above 0)"},
      {"method: adam, learning_rate: 0.02, iterations: 6", "method: lbfgs, decay: {half_life: 5}",
       "10:28: optimizer.decay: belongs to adam, not to l"},
      {"iterations: 6", "stop: {window: 1}", "10:54: optimizer.stop: a window of 1 has no standard error"},
      {"seed: 7}", "seed: 7, noise: {photons: -1}}", "8:49: target.noise.photons: -1 is out of range"},
      {"seed: 3", "loss: {kind: absolute}",
       "11:14: loss.kind: 'absolute' is not known (allowed: squared, huber, cauchy"},
      {"seed: 3", "loss: {kind: huber, scale: 0}", "11:28: loss.scale: 0 is out of range (a number above 0)"},
      {"method: adam", "method: sgd", "10:21: optimizer.method: 'sgd' is not known (allowed: adam, lbfgs, levenberg_"},
      {"learning_rate: 0.02", "learning_rate: 0",
       "10:42: optimizer.learning_rate: 0 is out of range (a number above 0)"},
      {"iterations: 6", "iterations: -1", "10:60: optimizer.iterations: -1 is out of range"},
      {"seed: 3", "seed: -3", "11:7: seed: -3 is out of range"},
      {"seed: 3", "resolution: [8]", "11:13: resolution: a list of 1 ([width, height], 1 to 32768 each)"},
      {"seed: 3", "resolution: 8x8", "11:13: resolution: is not a list ([width, height], 1 to 32768 each)"},
      {"seed: 3", "resolution: [8, 0]", "11:17: resolution[1]: 0 is out of range (an integer from 1 to 32768)"},
      {"seed: 7}", "max_bounces: -1}", "8:36: target.max_bounces: -1 is out of range"},
      {"seed: 3", "gradient: {method: exact}",
       "11:20: gradient.method: 'exact' is not known (allowed: analytic, finite"},
      {"seed: 3", "gradient: {step: 0}", "11:18: gradient.step: 0 is out of range (a number above 0)"},
      {"seed: 3", "estimator: {sampling: best}", "11:23: estimator.sampling: 'best' is not known (allowed: auto, stan"},
      {"seed: 3", "estimator: {hidden_shapes: []}", "11:28: estimator.hidden_shapes: holds no name (at least one)"},
      {"seed: 3", "estimator: {antithetic: 1}", "11:25: estimator.antithetic: '1' is neither (true or false)"},
      {"seed: 3", "estimator: {light: 1}", "11:20: estimator.light: 1 is out of range (a number at least 0, below 1)"},
      {"seed: 3", "estimator: {techniques: [standard, magic]}",
       "11:36: estimator.techniques[1]: there is no technique 'magic' (standard, ellipsoidal, light, wedge, "},
      {"seed: 3", "estimator: {techniques: [light, wedge]}",
       "11:25: estimator.techniques: leaves no technique that finds paths (standard, ellipsoidal or both)"},
      {"seed: 3", "estimator: {techniques: [standard], sampling: ellipsoidal}",
       "11:25: estimator.techniques: leaves out what `sampling` asks for (with sampling: auto, any)"},
      {"seed: 3", "estimator: {techniques: [standard, wedge], light: 0.5}",
       "11:25: estimator.techniques: leaves out light subpaths, which `light` asks for"},
  };
  expect_messages(folder, cases);
  const auto table_error = [&](const std::string& table) -> std::string {
    const std::string file = folder.write(
        "tiny.yaml", replaced(tiny_experiment(), gates, "{kind: tabulated, centers: [5], file: " + table + "}"));
    try {
      load_experiment(file);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string canonical = std::filesystem::canonical(folder.path()).string();
  EXPECT_EQ(table_error("table.txt"), canonical + "/table.txt:4:3: 'x' is not a finite number");
  EXPECT_EQ(table_error("wide.txt"), canonical + "/wide.txt:1:1: 3 numbers in this row (allowed: 2)");
}

TEST(Experiment, MessagesAboutMapsNameTheirKeys) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string gates = "gates: {kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}\n";
  const Refusal cases[] = {
      {"iterations: 6", "stop: 5", "10:54: optimizer.stop: is not a map (keys and values; its keys: window)"},
      {"iterations: 6", "stop: {}", "10:54: optimizer.stop.window: is missing"},
      {"iterations: 6", "decay: {start: 5}", "10:55: optimizer.decay.half_life: is missing"},
      {"seed: 7}", "noise: 100}", "8:30: target.noise: is not a map (keys and values; its keys: photons, counts)"},
      {"seed: 7}", "noise: {}}", "8:30: target.noise: has to say how many"},
      {"type: translation, shape: block, direction: [0, 1, 0]",
       "type: vertices, shape: block, direction: normal, smoothing: 3",
       "6:80: parameters[0].smoothing: is not a map (keys and values; its keys: diffusion, slopes, bending, variation, "
       "tangential, evidence)"},
      {"seed: 3", "loss: huber", "11:7: loss: is not a map (keys and values; its keys: kind, scale)"},
      {"seed: 3", "loss: {scale: 1}", "11:7: loss.kind: is missing"},
      {"  - {name: power, type: emission, shape: lamp, initial: 8, target: 10}", "  - power",
       "7:5: parameters[1]: is not a map (keys and values; its keys: name, type, per, light, shape"},
      {gates, "", "1:1: gates: is missing (a map with the keys kind, centers, unit, scene_unit_m"},
      {"name: tiny\n", "", "1:1: name: is missing"},
  };
  expect_messages(folder, cases);
}

TEST(Experiment, ASceneIsNotAnExperiment) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  try {
    load_experiment(folder.file("scene.yaml"));
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(),
              folder.file("scene.yaml") +
                  ":1:1: this is a scene, an experiment is needed (a file beside it with scene: scene.yaml "
                  "and gates, such as those in experiments/)");
  }
}

TEST(Experiment, OverridesAreCheckedLikeTheFile) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const Experiment changed =
      load_experiment(file, {"optimizer.iterations=9", "parameters[1].initial=[5]", "gates.centers=[1, 2, 3]",
                             "estimator={sampling: standard, antithetic: false, pick: uniform, numbers: independent, "
                             "guiding: false, follow: 0.5, follow_radius: 0}"});
  EXPECT_EQ(changed.optimizer.iterations, 9);
  EXPECT_EQ(changed.parameters[1].initial, std::vector<double>{5});
  EXPECT_EQ(changed.gates.centers.size(), 3u);
  EXPECT_EQ(changed.estimator.sampling, Sampling::standard);
  EXPECT_FALSE(changed.estimator.antithetic);
  EXPECT_EQ(changed.estimator.pick, ArcPick::uniform);
  EXPECT_EQ(changed.estimator.numbers, Numbers::independent);
  EXPECT_FALSE(changed.guiding);
  EXPECT_EQ(changed.estimator.follow, 0.5);
  EXPECT_EQ(changed.estimator.follow_radius, 0);
  const EstimatorOptions few = load_experiment(file, {"estimator.techniques=[standard, wedge]"}).estimator;
  EXPECT_EQ(few.sampling, Sampling::standard);
  EXPECT_EQ(few.light, 0);
  EXPECT_EQ(few.boundary, (BoundaryTechniques{true, false, false, false, false}));
  const EstimatorOptions most =
      load_experiment(file, {"estimator.techniques=[standard, ellipsoidal, light, aimed]", "estimator.light=0.4"})
          .estimator;
  EXPECT_EQ(most.sampling, Sampling::automatic);
  EXPECT_EQ(most.light, 0.4);
  EXPECT_EQ(load_experiment(file, {"optimizer.iterations="}).optimizer.iterations, OptimizerSpec().iterations);
  EXPECT_EQ(load_experiment(file, {"parameters[0]="}).parameters.size(), 1u);
  for (const char* wrong : {"optimizer.iterations=-9", "parameters[7].initial=1", "nothing=1", "gates.sigma=x",
                            "gates.sigma", "optimizer.method=newton"}) {
    try {
      load_experiment(file, {wrong});
      ADD_FAILURE() << "accepted: " << wrong;
    } catch (const InputError& error) {
      const std::string key = std::string(wrong).substr(0, std::string(wrong).find('='));
      EXPECT_EQ(std::string(error.what()).rfind("--set " + key, 0), 0u) << error.what();
    }
  }
}

TEST(Experiment, DefaultsAreFilledIn) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const Experiment e = load_experiment(folder.write("e.yaml", "name: e\nscene: scene.yaml\ngates: {kind: steady}\n"));
  EXPECT_EQ(e.estimator.max_bounces, 8);
  EXPECT_EQ(e.samples.visibility, 64);
  EXPECT_EQ(e.target.samples, 4096);
  EXPECT_EQ(e.target.seed, 7u);
  EXPECT_EQ(e.target.max_bounces, 8);
  EXPECT_EQ(e.resolution, (std::array<int, 2>{0, 0}));
  EXPECT_EQ(e.seed, 1u);
  EXPECT_EQ(make_gates(e.gates).size(), 1);
  EXPECT_TRUE(make_gates(e.gates).shape().is_steady());
}

TEST(Experiment, TimesBecomeLengths) {
  // A scene unit is half of what light travels in a nanosecond.
  GateSpec spec = gate_spec("{kind: boxcar, unit: ns, scene_unit_m: 0.149896229, centers: [1, 3], width: 0.25}");
  const GateSet gates = make_gates(spec);
  EXPECT_NEAR(gates.center(0), 2, 1e-14);
  EXPECT_NEAR(gates.center(1), 6, 1e-14);
  EXPECT_NEAR(gates.shape().upper() - gates.shape().lower(), 0.5, 1e-14);
  spec.unit = LengthUnit::ps;
  EXPECT_NEAR(make_gates(spec).center(1), 6e-3, 1e-16);
}

TEST(Experiment, ResolvedFileReadsBackTheSame) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  folder.write("values.txt", "0.1\n0.2 0.3\n0.4\n");
  folder.write("table.txt", "-1 0\n0 1\n0 0.5\n1.5 0\n");
  const std::string vertices =
      "seed: 9007199254740993\nestimator: {sampling: ellipsoidal, antithetic: false, pick: uniform, "
      "numbers: independent, hidden: 0.3, hidden_shapes: [block, lamp], techniques: [ellipsoidal, aimed, at_length], "
      "guiding: false, follow: 0.25, follow_radius: "
      "2.5}\n"
      "gradient: {method: finite_difference, step: 0.003, common_numbers: false}\nresolution: [12, 9]\n";
  const std::string gates = "{kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}";
  for (const char* other : {"{kind: gaussian, centers: [0.1, 0.30000000000000004], sigma: 1e-3}", "{kind: steady}",
                            "{kind: boxcar, centers: {start: 1, stop: 2, count: 4}, width: 0.7}",
                            "{kind: truncated_gaussian, centers: [3], sigma: 0.2, half_width: 0.6, unit: ps, "
                            "scene_unit_m: 0.33}",
                            "{kind: tabulated, centers: [3], file: table.txt}"}) {
    std::string text = replaced(replaced(tiny_experiment(), gates, other), "seed: 3\n", vertices);
    text = replaced(text, "seed: 7}", "seed: 7, max_bounces: 3}");
    text = replaced(
        text, "  - {name: power",
        "  - {name: dent, type: vertices, shape: block, direction: normal, initial: values.txt, target: "
        "[0, 0, 0, 0.1], lower: -1, upper: [1, 2, 3, 4]}\n"
        "  - {name: turn, type: rotation, shape: block, axis: [0, 3, 4], pivot: [1, 0.1, 0], selection: "
        "{box: {min: [-1, 0, -1], max: [0, 1, 0.1]}}, initial: 5, target: 0}\n"
        "  - {name: spin, type: rotation, shape: block, axis: [0, 1, 0], pivot: center, initial: 5, target: 0, "
        "scale: 12.5}\n"
        "  - {name: hinge, type: rotation, shape: block, axis: [0, 1, 0], pivot: {follow: [0.5, 0.25, 1]}, "
        "initial: 5, target: 0}\n"
        "  - {name: pull, type: vertices, shape: block, direction: [1, 1, 0], selection: [2, 0], initial: "
        "0, target: [0.1, -0.1]}\n"
        "  - {name: shine, type: roughness, material: metal, initial: 0.2, target: 0.3}\n"
        "  - {name: bend, type: ior, material: glass, initial: 1.4, target: 1.6}\n"
        "  - {name: power");
    text = replaced(text, "max_bounces: 3}", "max_bounces: 3, noise: {photons: 12.5}}");
    text = replaced(text, "method: adam", "method: lbfgs, inner_iterations: 3, stop: {window: 7}");
    text += "loss: {kind: cauchy, scale: 0.3}\n";
    const Experiment original = load_experiment(folder.write("tiny.yaml", text));
    const std::string out = folder.file("runs/deep");
    std::filesystem::create_directories(out);
    const std::string resolved = resolved_yaml(original, out);
    const Experiment back = load_experiment(folder.write("runs/deep/experiment.yaml", resolved));
    EXPECT_EQ(resolved_yaml(back, out), resolved);
    for (std::size_t i = 0; i < original.parameters.size(); ++i) {
      EXPECT_EQ(back.parameters[i].scale, original.parameters[i].scale);
      EXPECT_EQ(back.parameters[i].pivot_kind, original.parameters[i].pivot_kind);
    }
    EXPECT_EQ(back.scene, original.scene);
    EXPECT_EQ(back.seed, 9007199254740993u);
    EXPECT_EQ(back.gates.kind, original.gates.kind);
    EXPECT_EQ(back.gates.centers, original.gates.centers);
    EXPECT_EQ(make_gates(back.gates).shape().value(0.0004), make_gates(original.gates).shape().value(0.0004));
    EXPECT_EQ(back.gates.scene_unit_m, original.gates.scene_unit_m);
    EXPECT_EQ(back.gates.unit, original.gates.unit);
    EXPECT_EQ(back.estimator.sampling, Sampling::ellipsoidal);
    EXPECT_FALSE(back.estimator.antithetic);
    EXPECT_EQ(back.estimator.pick, ArcPick::uniform);
    EXPECT_EQ(back.estimator.numbers, Numbers::independent);
    EXPECT_FALSE(back.guiding);
    EXPECT_EQ(back.estimator.hidden, 0.3);
    EXPECT_EQ(back.estimator.boundary, (BoundaryTechniques{false, true, false, true, false}));
    EXPECT_EQ(back.estimator.light, 0);
    EXPECT_EQ(back.hidden_shapes, (std::vector<std::string>{"block", "lamp"}));
    EXPECT_EQ(back.estimator.follow, 0.25);
    EXPECT_EQ(back.estimator.follow_radius, 2.5);
    EXPECT_EQ(back.gradient.step, 0.003);
    EXPECT_FALSE(back.gradient.common_numbers);
    EXPECT_EQ(back.resolution, (std::array<int, 2>{12, 9}));
    EXPECT_EQ(back.target.max_bounces, 3);
    ASSERT_EQ(back.parameters.size(), 9u);
    EXPECT_EQ(back.parameters[7].quantity, "ior");
    EXPECT_EQ(back.parameters[7].material, "glass");
    EXPECT_EQ(back.parameters[3].scale, 12.5);
    EXPECT_EQ(back.parameters[3].pivot_kind, PivotKind::center);
    EXPECT_EQ(back.parameters[4].pivot, (Vec3{0.5, 0.25, 1}));
    EXPECT_EQ(back.target.photons, 12.5);
    EXPECT_EQ(back.loss.kind, LossKind::cauchy);
    EXPECT_EQ(back.loss.scale, 0.3);
    EXPECT_EQ(back.optimizer.method, OptimizerMethod::lbfgs);
    EXPECT_EQ(back.optimizer.inner_iterations, 3);
    EXPECT_EQ(back.optimizer.stop_window, 7);
    EXPECT_EQ(back.parameters[1].initial, (std::vector<double>{0.1, 0.2, 0.3, 0.4}));
    EXPECT_EQ(back.parameters[1].upper, (std::vector<double>{1, 2, 3, 4}));
    EXPECT_EQ(back.parameters[1].direction_kind, VertexDirection::normal);
    EXPECT_EQ(back.parameters[2].axis, (Vec3{0, 3, 4}));
    EXPECT_EQ(back.parameters[2].pivot, (Vec3{1, 0.1, 0}));
    EXPECT_EQ(back.parameters[2].selection.max, (Vec3{0, 1, 0.1}));
    EXPECT_EQ(back.parameters[5].selection.indices, (std::vector<int>{2, 0}));
    EXPECT_EQ(back.parameters[6].material, "metal");
    const std::string decaying =
        replaced(text, "method: lbfgs, inner_iterations: 3", "decay: {start: 20, half_life: 12.5}");
    const Experiment adam = load_experiment(folder.write("adam.yaml", decaying));
    const Experiment again = load_experiment(folder.write("runs/deep/adam.yaml", resolved_yaml(adam, out)));
    EXPECT_EQ(again.optimizer.decay.start, 20);
    EXPECT_EQ(again.optimizer.decay.half_life, 12.5);
  }
}

}  // namespace
}  // namespace isochron
