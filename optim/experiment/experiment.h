// The experiment file: what a user writes, checked and with every default filled in.
// Its keys are described in description.cpp, their defaults are those of the structs below; experiments/README.md has both in
// tables.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/description.h"
#include "core/base/yaml_reader.h"
#include "core/gates/gate_description.h"
#include "core/image/image.h"
#include "core/render/renderer.h"
#include "optim/experiment/optimizer_spec.h"
#include "optim/experiment/output_spec.h"
#include "optim/experiment/parameter_spec.h"

namespace isochron {

enum class LengthUnit { scene, ns, ps };
const char* name(LengthUnit unit);  ///< "scene units", "ns", "ps"

/// Gates as written. All lengths are in `unit`; a time t is the length c t / scene_unit_m in scene units.
struct GateSpec {
  std::string kind = "steady";
  std::shared_ptr<GateDescription> shape = gate_kinds()[0]->make();  ///< of that kind
  LengthUnit unit = LengthUnit::scene;
  double scene_unit_m = 0;      ///< metres per scene unit; > 0 where unit is a time or gates are modulated, else unused
  std::vector<double> centers;  ///< as the key says; empty for kinds that have centres of their own, see gate_marks

  bool steady() const { return kind == "steady"; }
  /// Light of every length counts, whatever the gate: there is no width, and no lengths can be drawn.
  bool unbounded() const { return shape->unbounded(); }
  /// Becomes another kind, with its defaults.
  void choose(const std::string& other_kind);
  /// Whether the bins of the kind `bins` are still to be set: those of the target's file.
  bool needs_bins() const { return shape->needs_bins(); }
  /// `count` bins, each `width` scene units wide, the first beginning at `start` scene units. check_gates tells whether they
  /// can be used.
  void set_bins(double start, double width, int count);
};

/// Scene units per unit of the gates' lengths.
double length_unit(const GateSpec& spec);

/// Gates in scene units. Throws std::invalid_argument when the shape cannot be made (for example a table of
/// zeros).
GateSet make_gates(const GateSpec& spec);

/// A number for each gate, by which people know it, and its unit (scene units, ns, ps, degrees): centres, middles of bins,
/// phases. No numbers where steady.
GateMarks gate_marks(const GateSpec& spec);

/// What an EXR file says of its gates, so that it can be drawn by itself: isochron.gateCenters (numbers of gate_marks,
/// separated by spaces; none where steady), isochron.gateUnit (their unit), isochron.quantity (what a
/// pixel's value is).
ExrNotes exr_notes(const GateSpec& spec);

struct TargetSpec {
  std::string images;   ///< absolute path of an EXR
  std::string capture;  ///< absolute path of an HDF5 file of counts
  int samples = 4096;
  std::uint64_t seed = 7;
  int max_bounces = 8;  ///< of the rendered target; the experiment's own where the file does not say
  double photons = 0;   ///< of add_photon_noise; 0: no noise
  bool counts = false;  ///< rendered values are expected counts, the target Poisson numbers of them
  /// Gates whose centre lies outside are not used, in scene units; [-infinity, infinity]: all are.
  std::array<double, 2> window{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  std::string mask;  ///< absolute path of a .npy file [columns, rows]: pixels with a zero are not used; empty: all are
  int histograms = 0;  ///< of a capture, so many of the pixels left are used, spread evenly; 0: all are
  /// Whether it is read from a file; else it is rendered at the target values.
  bool measured() const { return !images.empty() || !capture.empty(); }
  bool windowed() const { return std::isfinite(window[0]) || std::isfinite(window[1]); }
};

/// Samples per pixel. A derivative term with 0 samples is left out; primal is at least 1, for runs 2.
struct SampleSpec {
  int primal = 64, interior = 64, visibility = 64, path_length = 64;
  int term(Term t) const { return t == Term::interior ? interior : t == Term::visibility ? visibility : path_length; }
  /// Sets every term to n, but leaves out what is left out already.
  void set_all(int n);
};

enum class GradientMethod { analytic, finite_difference };

struct GradientSpec {
  GradientMethod method = GradientMethod::analytic;
  double step = 0.01;       ///< finite_difference: half the distance of the two images, in units of the parameter
  bool step_given = false;  ///< whether the file gives it
  /// finite_difference: whether both images take the same random numbers, so that most of their noise cancels.
  bool common_numbers = true;
};

enum class LossKind { squared, huber, cauchy, poisson };

/// What is minimised: see ReadingLoss.
struct LossSpec {
  LossKind kind = LossKind::squared;
  double scale = 1;  ///< in units of the root mean square of a typical pixel of the target
};

struct Experiment {
  std::string file;  ///< absolute path, for messages
  std::string name;
  std::string scene;                      ///< absolute path
  std::vector<std::string> number_files;  ///< absolute paths of the files that gates and parameters were read from
  /// Pixels, {width, height}, in place of the scene's; {0, 0}: as the scene says. The field of view stays across the
  /// width.
  std::array<int, 2> resolution{0, 0};
  GateSpec gates;
  EstimatorOptions estimator;
  /// The area-sampled shapes (Shape::hidden), by name; none: those that parameters change.
  std::vector<std::string> hidden_shapes;
  Keys::Places estimator_keys;  ///< where the file has them
  bool guiding = true;          ///< of the visibility term; see Problem::estimator
  std::vector<ParameterSpec> parameters;
  TargetSpec target;
  SampleSpec samples;
  GradientSpec gradient;
  LossSpec loss;
  OptimizerSpec optimizer;
  OutputSpec output;
  std::uint64_t seed = 1;
};

/// Reads and checks an experiment file, all that can be checked without the scene. `overrides` are
/// KEY.PATH=VALUE strings, applied before the checks (see open_yaml). Throws InputError: one line that names
/// file, line, column, key and what is allowed. `target_values`: whether parameters must have them where the target is
/// rendered; who renders no target can do without.
Experiment load_experiment(const std::string& file, const std::vector<std::string>& overrides = {},
                           bool target_values = true);

/// The experiment with everything resolved, as YAML that load_experiment reads back to the same values when
/// it lies in `folder`: paths are written relative to it, tables and value files inline, numbers with all
/// their digits.
std::string resolved_yaml(const Experiment& experiment, const std::string& folder);
/// The same key by key, without the program's version.
std::vector<WrittenKey> resolved_keys(Experiment experiment, const std::string& folder);

/// Tables of all keys, in Markdown.
std::string experiment_reference();

/// Version of this program, as written into experiment.yaml and checkpoints.
const char* program_version();

}  // namespace isochron
