// Bins and modulated gates as experiments give them: keys, units, resolved files, messages, what is said of them.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "optim/analysis/stability.h"
#include "tests/optim/gate_spec.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

const std::string kGaussian = "{kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}";
constexpr double kPicosecond = 299792458e-12;  // metres

class GateKinds : public ::testing::Test {
 protected:
  GateKinds() { write_tiny_scene(folder_); }
  /// The tiny experiment with other gates.
  Experiment load(const std::string& gates, const std::vector<std::string>& overrides = {}) {
    return load_experiment(folder_.write("tiny.yaml", replaced(tiny_experiment(), kGaussian, gates)), overrides);
  }
  /// What is said of it, without the file's name.
  std::string refusal(const std::string& gates, const std::vector<std::string>& overrides = {}) {
    try {
      load(gates, overrides);
    } catch (const InputError& error) {
      const std::string what = error.what(), file = folder_.file("tiny.yaml") + ":";
      EXPECT_EQ(what.find('\n'), std::string::npos);
      return what.starts_with(file) ? what.substr(file.size()) : what;
    }
    return "accepted";
  }
  /// The gates of the resolved file.
  Experiment resolved(const Experiment& experiment) {
    std::filesystem::create_directories(folder_.file("runs/deep"));
    return load_experiment(
        folder_.write("runs/deep/experiment.yaml", resolved_yaml(experiment, folder_.file("runs/deep"))));
  }
  void expect_same(const Experiment& a, const Experiment& b) {
    EXPECT_EQ(resolved_yaml(a, folder_.path()), resolved_yaml(b, folder_.path()));
    const GateSet one = make_gates(a.gates), other = make_gates(b.gates);
    ASSERT_EQ(one.size(), other.size());
    for (int g = 0; g < one.size(); ++g) {
      EXPECT_EQ(one.center(g), other.center(g));
      for (const double x : {-0.1, 0.0, 0.01}) EXPECT_EQ(one.shape().value(x), other.shape().value(x));
    }
  }

  TemporaryFolder folder_;
};

TEST_F(GateKinds, BinsInPicoseconds) {
  folder_.write("irf.csv", "offset,value\n0,0\n8,2\n16,1\n40,0\n");
  const Experiment e =
      load("{kind: bins, start: -16, width: 16, count: 3, unit: ps, scene_unit_m: 0.5, response: irf.csv}");
  const GateSet gates = make_gates(e.gates);
  const double unit = kPicosecond / 0.5;
  ASSERT_EQ(gates.size(), 3);
  for (int g = 0; g < 3; ++g) EXPECT_NEAR(gates.center(g), (16 * g - 8) * unit, 1e-15);
  EXPECT_NEAR(gates.shape().lower(), (-8 - 40) * unit, 1e-15);
  EXPECT_NEAR(gates.shape().upper(), 8 * unit, 1e-15);
  // Light that arrives 4 ps before the bin begins: of the response's area of 8 + 12 + 12, what lies from 4 to 20.
  EXPECT_NEAR(gates.shape().value(-12 * unit) * 16 * unit, (32 - 0.5 * 4 * 1 - 0.5 * 20 * (20 / 24.0)) / 32, 1e-12);
  EXPECT_EQ(e.number_files.size(), 1u);
  const GateMarks marks = gate_marks(e.gates);
  EXPECT_EQ(marks.numbers, (std::vector<double>{-8, 8, 24}));
  EXPECT_EQ(marks.unit, "ps");
  const ExrNotes notes = exr_notes(e.gates);
  EXPECT_EQ(notes[0].second, "-8 8 24");
  EXPECT_EQ(notes[1].second, "ps");
  EXPECT_EQ(notes[2].second, "radiance per scene unit of path length");
  expect_same(resolved(e), e);
}

TEST_F(GateKinds, BinsWithoutAResponseAreBoxcars) {
  const Experiment e = load("{kind: bins, start: 4, width: 0.25, count: 8}");
  const GateSet gates = make_gates(e.gates);
  EXPECT_EQ(gates.shape().kind(), GateKind::boxcar);
  EXPECT_EQ(gates.shape().pair_mass(PairPart::dirac), 4);
  EXPECT_EQ(gates.center(7), 5.875);
  EXPECT_EQ(gates.lower(), 4);
  EXPECT_EQ(gates.upper(), 6);
  expect_same(resolved(e), e);
}

TEST_F(GateKinds, ResponseInPlace) {
  const std::string bins = "{kind: bins, start: 4, width: 0.25, count: 8, response: ";
  folder_.write("plain.txt", "0 1\n0.5 0.3  # no header\n1.5 0\n");
  expect_same(load(bins + "{offsets: [0, 0.5, 1.5], values: [1, 0.3, 0]}}"), load(bins + "plain.txt}"));
}

TEST_F(GateKinds, BinsMayBeSetLater) {
  GateSpec gates = gate_spec("{kind: bins, unit: ps, scene_unit_m: 1, response: {offsets: [0, 50], values: [1, 0]}}");
  EXPECT_TRUE(gates.needs_bins());
  const GateSpec copy = gates;
  gates.set_bins(-0.3, 0.0048, 12);
  EXPECT_FALSE(gates.needs_bins());
  EXPECT_TRUE(copy.needs_bins());
  const GateSet set = make_gates(gates);
  EXPECT_EQ(set.size(), 12);
  EXPECT_NEAR(set.center(0), -0.3 + 0.0024, 1e-15);
  EXPECT_NEAR(set.center(11), -0.3 + 11.5 * 0.0048, 1e-15);
  Experiment e = load("{kind: bins, unit: ps, scene_unit_m: 1, start: 0, width: 1, count: 1}");
  e.gates = gates;
  expect_same(resolved(e), e);
}

TEST_F(GateKinds, ModulatedInMetres) {
  const Experiment e = load("{kind: modulated, frequency_mhz: 20, scene_unit_m: 2}");
  const GateSet gates = make_gates(e.gates);
  ASSERT_EQ(gates.size(), 4);
  gates.for_each_derivative(1.7, [&](int g, double w, double slope) {
    const double k = kTwoPi * 20e6 / 299792458.0 * 2, phase = g * kPi / 2;
    EXPECT_NEAR(w, std::cos(k * 1.7 - phase), 1e-13);
    EXPECT_NEAR(slope, -k * std::sin(k * 1.7 - phase), 1e-13);
  });
  EXPECT_TRUE(e.gates.unbounded());
  EXPECT_FALSE(sampling_mix(e.estimator, gates, Scene()).image_connections);
  const ExrNotes notes = exr_notes(e.gates);
  EXPECT_EQ(notes[0].second, "0 90 180 270");
  EXPECT_EQ(notes[1].second, "degrees");
  EXPECT_EQ(notes[2].second, "radiance");
  expect_same(resolved(e), e);
  const Experiment other = load("{kind: modulated, frequency_mhz: 13.5, phases: [-30], unit: ns, scene_unit_m: 0.1}");
  EXPECT_EQ(make_gates(other.gates).size(), 1);
  expect_same(resolved(other), other);
}

TEST_F(GateKinds, Messages) {
  const std::string bins = "{kind: bins, start: 0, width: 2, count: 3";
  EXPECT_EQ(refusal("{kind: bins}"),
            "4:8: gates: start, width and count are missing (required without a target's file of bins)");
  EXPECT_EQ(refusal("{kind: bins, start: 0, count: 3}"),
            "4:8: gates: some of start, width and count are missing (all three, or none: those of the target's file)");
  EXPECT_EQ(refusal("{kind: bins, start: 0, width: 0, count: 3}"),
            "4:38: gates.width: 0 is out of range (a number above 0)");
  EXPECT_EQ(refusal("{kind: bins, start: 0, width: 1, count: 0}"),
            "4:48: gates.count: 0 is out of range (an integer from 1 to 100000)");
  EXPECT_EQ(refusal(bins + ", centers: [1]}").substr(0, 75),
            "4:51: gates.centers: belongs to every kind but steady, bins and modulated (");
  EXPECT_EQ(refusal(bins + ", response: gone.csv}"),
            "4:61: gates.response: there is no file 'gone.csv' (a path relative to the experiment file)");
  EXPECT_EQ(refusal(bins + ", response: {offsets: [0, 1], values: [1, -1]}}"),
            "4:61: gates.response: row 2 of the response: negative value");
  EXPECT_EQ(refusal(bins + ", response: {offsets: [0, 1]}}"), "4:61: gates.response.values: is missing");
  EXPECT_EQ(
      refusal(bins + ", response: {offsets: [0, 1e10], values: [1, 0]}}"),
      "4:8: gates: a bin's width of 2 is too small beside a response as long as 10000000000 (at least 1e-09 of it)");
  EXPECT_EQ(refusal("{kind: bins, start: 1e9, width: 1e-6, count: 3}").substr(0, 42),
            "4:8: gates: gates of a standard deviation ");
  folder_.write("swapped.csv", "value,offset\n1,2\n");
  EXPECT_EQ(refusal(bins + ", response: swapped.csv}"),
            std::filesystem::canonical(folder_.path()).string() + "/swapped.csv:1:1: 'value' is not a finite number");

  const std::string modulated = "{kind: modulated, frequency_mhz: 20, scene_unit_m: 1";
  EXPECT_EQ(refusal("{kind: modulated, frequency_mhz: 20}"), "4:8: gates.scene_unit_m: is missing");
  EXPECT_EQ(refusal("{kind: modulated, scene_unit_m: 1}"), "4:8: gates.frequency_mhz: is missing");
  EXPECT_EQ(refusal(modulated + ", phases: []}"), "4:70: gates.phases: holds no gate (at least one number)");
  EXPECT_EQ(refusal(modulated + "}", {"estimator={sampling: ellipsoidal}"}),
            "--set estimator:1:12: estimator.sampling: modulated gates let light of every length through, so that no "
            "lengths can be "
            "drawn (allowed: auto, standard)");
  EXPECT_EQ(refusal(modulated + "}", {"target.noise={photons: 10}"}),
            "--set target.noise:1:1: target.noise: readings under modulated gates may be negative, which no count is");
}

TEST_F(GateKinds, WidthsToVary) {
  const GateSpec bins =
      gate_spec("{kind: bins, start: 3, width: 0.5, count: 4, response: {offsets: [0, 1], values: [1, 0]}}");
  const GateSet narrow = make_gates(with_relative_width(bins, 0.01));
  EXPECT_NEAR(narrow.relative_width(), 0.01, 1e-15);
  EXPECT_EQ(narrow.center(3), 4.75);
  EXPECT_NEAR(make_gates(bins).shape().upper() / narrow.shape().upper(),
              make_gates(bins).shape().width() / narrow.shape().width(), 1e-12);
  const GateSpec none = with_relative_width(bins, 0);
  EXPECT_TRUE(make_gates(none).shape().is_dirac());
  EXPECT_EQ(make_gates(none).center(3), 4.75);
  EXPECT_EQ(make_gates(none).relative_width(), 0);
  EXPECT_THROW(with_relative_width(none, 0.01), InputError);
  EXPECT_THROW(with_relative_width(gate_spec("{kind: modulated, frequency_mhz: 20, scene_unit_m: 1}"), 0.01),
               InputError);
}

}  // namespace
}  // namespace isochron
