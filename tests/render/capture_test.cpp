// Readings of captures and their derivatives against quadrature: a tilted board, with and without an occluder before it, confocal
// and with one spot. Means over replicates with seeds of their own; a test has at most 408 comparisons, each of which fails
// by chance with a probability of 1.2e-6 (Student's law, 31 degrees of freedom, 6 standard errors): false alarms 5e-4 per test.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/render/renderer.h"
#include "scene_building.h"
#include "tests/render/shadow_quadrature.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

constexpr int kReplicates = 32;
constexpr double kStandardErrors = 6;

/// How far each unknown is from where the scene has it.
struct Offsets {
  double board_x = 0, board_z = 0, occluder_x = 0, occluder_z = 0, albedo = 0, length = 0;
};

/// How readings and differences are made by quadrature, and their error over the largest value.
struct Quadrature {
  int cells = 14;
  double step = 3e-4, error = 1e-6;
};

struct CaptureSetup {
  bool confocal = true, occluded = true;
  std::vector<Vec3> sensor{{-0.3, 0.25, 0}, {0.2, 0.3, 0}, {-0.15, -0.2, 0}, {0.35, -0.3, 0}};
  Vec3 spot{0.1, -0.2, 0}, normal{0, 0, 1};
  Quadrature quadrature = {};
  std::vector<int> hidden{0};  ///< of the board, 0, and the occluder, 1
  bool time_offset = true;     ///< is unknown, so that every path has a derivative

  BoardAndOccluder at(const Offsets& o) const {
    BoardAndOccluder b;
    b.board = {{{-0.2, -0.25, 0.4}, {0.25, -0.25, 0.55}, {0.25, 0.2, 0.55}, {-0.2, 0.2, 0.4}}};
    b.occluder = {{{-0.1, -0.05, 0.25}, {0.05, -0.05, 0.25}, {0.05, 0.15, 0.25}, {-0.1, 0.15, 0.25}}};
    for (Vec3& p : b.board) p += {o.board_x, 0, o.board_z};
    for (Vec3& p : b.occluder) p += {o.occluder_x, 0, o.occluder_z};
    b.occluded = occluded;
    b.albedo += o.albedo;
    return b;
  }
  /// Mean over sensor points, per gate.
  std::vector<double> readings(const GateSet& gates, const Offsets& o) const {
    std::vector<double> sums(gates.size(), 0.0);
    const BoardAndOccluder scene = at(o);
    for (const Vec3& s : sensor)
      for (int g = 0; g < gates.size(); ++g)
        sums[g] +=
            scene.reading(
                s, confocal ? s : spot, normal,
                [&](double l) { return gates.shape().value(l + o.length - gates.center(g)); }, quadrature.cells) /
            static_cast<double>(sensor.size());
    return sums;
  }
  std::vector<double> differences(const GateSet& gates, double Offsets::*unknown) const {
    Offsets up, down;
    const double step = quadrature.step;
    up.*unknown = step;
    down.*unknown = -step;
    std::vector<double> result = readings(gates, up);
    const std::vector<double> below = readings(gates, down);
    for (std::size_t g = 0; g < result.size(); ++g) result[g] = (result[g] - below[g]) / (2 * step);
    return result;
  }

  Scene scene() const {
    const BoardAndOccluder b = at({});
    Scene scene;
    scene.capture.emplace();
    Capture& capture = *scene.capture;
    capture.columns = static_cast<int>(sensor.size());
    capture.rows = 1;
    for (const Vec3& s : sensor) capture.sensor.push_back({s, normal});
    if (!confocal) capture.spots = {{spot, normal}};
    scene.camera.width = capture.columns;
    scene.camera.height = 1;
    scene.camera.look_at = {0, 0, 1};
    add_shape(scene, "board", quad(b.board[0], b.board[1], b.board[2], b.board[3]), diffuse(Rgb(b.albedo), true));
    if (occluded)
      add_shape(scene, "occluder", quad(b.occluder[0], b.occluder[1], b.occluder[2], b.occluder[3]),
                diffuse(Rgb(0.0), true));
    for (const int shape : hidden) scene.shapes[shape].hidden = true;
    return scene;
  }
};

/// board x, board z, [occluder x, occluder z,] albedo[, time offset]
TangentBasis basis_of(const Scene& scene, bool occluded, bool time_offset = true) {
  const DofLayout layout(scene);
  std::vector<std::vector<TangentBasis::Entry>> rows(layout.size());
  int column = 0;
  for (int s = 0; s < (occluded ? 2 : 1); ++s)
    for (const int axis : {0, 2}) {
      const Shape& shape = scene.shapes[s];
      for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
        rows[layout.vertex(v, axis)].push_back({column, 1.0});
      ++column;
    }
  for (int c = 0; c < 3; ++c) rows[layout.number(0, c)].push_back({column, 1.0});
  if (time_offset) rows[layout.time_offset(0)].push_back({column + 1, 1.0});
  TangentBasis basis;
  basis.columns = column + (time_offset ? 2 : 1);
  for (const auto& row : rows) {
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
    basis.entries.insert(basis.entries.end(), row.begin(), row.end());
  }
  basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  return basis;
}

struct Means {
  std::vector<double> mean, error;  // per gate
};

Means over_replicates(int gates, const std::function<GatedImage(int)>& image_of) {
  Means m{std::vector<double>(gates, 0.0), std::vector<double>(gates, 0.0)};
  std::vector<std::vector<double>> all;
  for (int r = 0; r < kReplicates; ++r) {
    const GatedImage image = image_of(r);
    std::vector<double>& row = all.emplace_back();
    for (int g = 0; g < gates; ++g) {
      row.push_back(image.mean(g));
      m.mean[g] += row[g] / kReplicates;
    }
  }
  for (int g = 0; g < gates; ++g) {
    for (const auto& row : all) m.error[g] += (row[g] - m.mean[g]) * (row[g] - m.mean[g]);
    m.error[g] = std::sqrt(m.error[g] / (kReplicates * (kReplicates - 1.0)));
  }
  return m;
}

void expect_means(const Means& m, const std::vector<double>& expected, double reference_error, double precision,
                  const std::string& what) {
  double scale = 0;
  for (const double e : expected) scale = std::max(scale, std::abs(e));
  ASSERT_GT(scale, 0) << what;
  for (std::size_t g = 0; g < expected.size(); ++g) {
    EXPECT_NEAR(m.mean[g], expected[g], kStandardErrors * m.error[g] + reference_error * scale)
        << what << ", gate " << g;
    EXPECT_LT(m.error[g], scatter_of_errors(kReplicates) * precision * scale) << what << ", gate " << g;
  }
}

void expect_readings_and_derivatives(const CaptureSetup& setup, const GateSet& gates, EstimatorOptions options,
                                     int samples, double precision) {
  options.max_bounces = 1;
  const Scene scene = setup.scene();
  const TangentBasis basis = basis_of(scene, setup.occluded, setup.time_offset);
  const Renderer renderer(scene, gates, options, &basis);
  const SampleRange range{0, samples};
  const auto seed = [](int r) { return static_cast<std::uint64_t>(r + 1); };
  expect_means(over_replicates(gates.size(),
                               [&](int r) {
                                 return renderer.render({seed(r), 0, 0}, range);
                               }),
               setup.readings(gates, {}), setup.quadrature.error, precision, "readings");
  std::vector<std::vector<GatedImage>> derivatives;
  for (int r = 0; r < kReplicates; ++r) {
    std::vector<GatedImage> sum;
    for (const Term term : kTerms) {
      const auto part = renderer.derive(term, {seed(r), 0, 1 + static_cast<std::uint32_t>(term)}, range);
      if (sum.empty()) {
        sum = part;
        continue;
      }
      for (std::size_t i = 0; i < sum.size(); ++i)
        for (std::size_t k = 0; k < sum[i].data.size(); ++k) sum[i].data[k] += part[i].data[k];
    }
    derivatives.push_back(std::move(sum));
  }
  std::vector<std::pair<const char*, double Offsets::*>> unknowns{{"board x", &Offsets::board_x},
                                                                  {"board z", &Offsets::board_z}};
  if (setup.occluded) {
    unknowns.emplace_back("occluder x", &Offsets::occluder_x);
    unknowns.emplace_back("occluder z", &Offsets::occluder_z);
  }
  unknowns.emplace_back("albedo", &Offsets::albedo);
  if (setup.time_offset) unknowns.emplace_back("time offset", &Offsets::length);
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    expect_means(over_replicates(gates.size(), [&](int r) { return derivatives[r][i]; }),
                 setup.differences(gates, unknowns[i].second), setup.quadrature.error, 10 * precision,
                 unknowns[i].first);
}

constexpr Quadrature kFine{.cells = 48, .step = 6e-5, .error = 1e-5};
const GateSet kWide(GateShape::gaussian(0.02), {0.9, 1.0, 1.1, 1.2});

TEST(CaptureReadings, Confocal) {
  expect_readings_and_derivatives({.confocal = true, .occluded = false}, kWide, {}, 1024, 0.003);
}

TEST(CaptureReadings, OneSpot) {
  expect_readings_and_derivatives({.confocal = false, .occluded = false}, kWide, {}, 1024, 0.003);
}

TEST(CaptureReadings, ConfocalWithOccluder) {
  expect_readings_and_derivatives({.confocal = true, .occluded = true}, kWide, {}, 2048, 0.006);
}

TEST(CaptureReadings, OneSpotWithOccluder) {
  expect_readings_and_derivatives({.confocal = false, .occluded = true}, kWide, {}, 2048, 0.006);
}

/// Whichever shapes hidden geometry is, whatever its share: of the board and the occluder, without any named, and where paths
/// that miss the board have no derivative.
TEST(CaptureReadings, AnyHiddenGeometry) {
  for (const bool time_offset : {true, false})
    for (const std::vector<int>& hidden : {std::vector<int>{0}, {1}, {0, 1}, {}}) {
      SCOPED_TRACE("shapes " + ::testing::PrintToString(hidden) + (time_offset ? ", time offset" : ""));
      const CaptureSetup setup{.confocal = time_offset, .hidden = hidden, .time_offset = time_offset};
      expect_readings_and_derivatives(setup, kWide, {}, 1024, 0.02);
      expect_readings_and_derivatives(setup, kWide, {.hidden = 0.3}, 1024, 0.02);
    }
}

TEST(CaptureReadings, NarrowGates) {
  const GateSet narrow(GateShape::gaussian(0.004), {1.0, 1.1});
  const CaptureSetup setup{.confocal = true, .occluded = true, .quadrature = kFine};
  expect_readings_and_derivatives(setup, narrow, {}, 8192, 0.06);
}

TEST(CaptureReadings, BinsWithResponse) {
  std::vector<double> centers;
  for (int i = 0; i < 8; ++i) centers.push_back(0.9 + 0.06 * i);
  // Rises at once, then decays: light is counted later than it comes.
  const GateSet bins(GateShape::bin(0.06, {0, 0.03, 0.1}, {1, 0.4, 0}), centers);
  expect_readings_and_derivatives({.confocal = true, .occluded = false}, bins, {}, 1024, 0.003);
}

TEST(CaptureReadings, BinsWithoutResponseHaveDiracParts) {
  const GateSet bins(GateShape::boxcar(0.08), {0.91, 0.99, 1.07});
  // The light of a length jumps where an ellipse leaves a corner of the board; differences smooth that.
  CaptureSetup setup{.confocal = true, .occluded = false, .quadrature = {.cells = 160, .step = 1e-3, .error = 0.05}};
  expect_readings_and_derivatives(setup, bins, {}, 256, 0.02);
  setup.confocal = false;
  expect_readings_and_derivatives(setup, bins, {}, 256, 0.02);
}

TEST(CaptureReadings, EllipsoidalSampling) {
  EstimatorOptions options;
  options.sampling = Sampling::ellipsoidal;
  const GateSet narrow(GateShape::gaussian(0.004), {1.0, 1.1});
  CaptureSetup setup{.confocal = true, .occluded = false, .quadrature = kFine};
  expect_readings_and_derivatives(setup, narrow, options, 1024, 0.006);
  setup.confocal = false;
  expect_readings_and_derivatives(setup, narrow, options, 1024, 0.006);
}

/// The gradient for some adjoint is the weighted sum of derivative images. Its standard error is a few per cent of that sum, of
/// each unknown and term, so that another sign shows however much cancels among readings.
TEST(CaptureReadings, GradientsAreSumsOfDerivatives) {
  const CaptureSetup setup{.confocal = false, .occluded = true};
  const Scene scene = setup.scene();
  const TangentBasis basis = basis_of(scene, true);
  const Renderer renderer(scene, kWide, {.max_bounces = 2}, &basis);
  GatedImage weights(scene.camera.width, scene.camera.height, kWide.size(), 1);
  for (std::size_t i = 0; i < weights.data.size(); ++i) weights.data[i] = 1.0 + 0.1 * static_cast<double>(i % 7);
  const SampleRange range{0, 1024};
  for (const Term term : {Term::interior, Term::visibility}) {
    std::vector<Batches> difference(basis.columns), expected(basis.columns);
    for (int r = 0; r < kReplicates; ++r) {
      const auto stream = [&](std::uint32_t pass) { return Stream{5u + static_cast<std::uint32_t>(r), 0, pass}; };
      std::vector<double> dofs(DofLayout(scene).size(), 0.0);
      renderer.add_gradient(term, weights, stream(0), range, dofs);
      const std::vector<double> gradient = basis.transpose_apply(dofs);
      const auto images = renderer.derive(term, stream(1), range);
      for (int column = 0; column < basis.columns; ++column) {
        const double sum =
            std::inner_product(weights.data.begin(), weights.data.end(), images[column].data.begin(), 0.0);
        difference[column].add(gradient[column] - sum);
        expected[column].add(sum);
      }
    }
    for (int column = 0; column < basis.columns; ++column) {
      const Estimate found = difference[column].estimate();
      EXPECT_LE(std::abs(found.mean), kStandardErrors * found.standard_error) << name(term) << ", column " << column;
      // The occluder is black and only hides; albedo and time offset change no visibility.
      const bool of_board = column < 2, of_occluder = column == 2 || column == 3;
      const double size = std::abs(expected[column].estimate().mean);
      ASSERT_EQ(size > 0, of_board || of_occluder == (term == Term::visibility)) << name(term) << ", column " << column;
      EXPECT_LE(found.standard_error, 0.05 * size) << name(term) << ", column " << column;
    }
  }
}

/// Light is counted later by the time offset: as if every path were longer.
TEST(CaptureReadings, TimeOffset) {
  const CaptureSetup setup{.confocal = true, .occluded = false};
  Scene scene = setup.scene();
  scene.detector.time_offset = {0.07};
  const Renderer renderer(scene, kWide, {.max_bounces = 1});
  expect_means(over_replicates(kWide.size(),
                               [&](int r) {
                                 return renderer.render({static_cast<std::uint64_t>(r + 1), 0, 0}, {0, 1024});
                               }),
               setup.readings(kWide, {.length = 0.07}), setup.quadrature.error, 0.003, "readings");
}

/// Offsets of single points, exactly: each pixel is that of an offset which all have, and so is its derivative by its own.
TEST(CaptureReadings, TimeOffsetsOfSinglePoints) {
  for (const bool confocal : {true, false}) {
    Scene scene = CaptureSetup{.confocal = confocal, .occluded = false}.scene();
    const int points = static_cast<int>(scene.capture->sensor.size());
    const SampleRange range{0, 64};
    const GateSet boxes(GateShape::boxcar(0.1), {1.0, 1.1});
    const auto all_terms = [&](const Renderer& renderer, int columns) {
      std::vector<GatedImage> sum;
      for (const Term term : {Term::interior, Term::path_length}) {
        const auto part = renderer.derive(term, {3, 0, 0}, range);
        for (int i = 0; i < columns; ++i) {
          if (static_cast<int>(sum.size()) <= i)
            sum.push_back(part[i]);
          else
            for (std::size_t k = 0; k < part[i].data.size(); ++k) sum[i].data[k] += part[i].data[k];
        }
      }
      return sum;
    };
    for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
      const EstimatorOptions options{.max_bounces = 1, .sampling = sampling};
      std::vector<double> offsets;
      for (int i = 0; i < points; ++i) offsets.push_back(0.03 * (i + 1) - 0.05);
      Scene own = scene;
      own.detector.time_offset = offsets;
      std::vector<int> dofs;
      for (int i = 0; i < points; ++i) dofs.push_back(DofLayout(own).time_offset(i));
      const TangentBasis basis = free_dofs(own, dofs);
      const Renderer renderer(own, boxes, options, &basis);
      const GatedImage image = renderer.render({3, 0, 0}, range);
      const auto derivatives = all_terms(renderer, points);
      for (int i = 0; i < points; ++i) {
        Scene common = scene;
        common.detector.time_offset = {offsets[i]};
        const TangentBasis one = free_dofs(common, {DofLayout(common).time_offset(0)});
        const Renderer of_all(common, boxes, options, &one);
        const GatedImage expected = of_all.render({3, 0, 0}, range);
        const GatedImage slope = all_terms(of_all, 1)[0];
        for (int g = 0; g < boxes.size(); ++g) {
          EXPECT_NEAR(image.at(i, g, 0), expected.at(i, g, 0), 1e-9 * expected.mean(g));
          for (int column = 0; column < points; ++column)
            EXPECT_NEAR(derivatives[column].at(i, g, 0), column == i ? slope.at(i, g, 0) : 0,
                        1e-9 * std::abs(slope.at(i, g, 0)));
        }
      }
    }
  }
}

/// Gain and backgrounds of single points, exactly: readings are gain x light + background. The parts of a gradient add up to it.
TEST(CaptureReadings, GainAndBackground) {
  Scene scene = CaptureSetup{.confocal = true, .occluded = false}.scene();
  const Renderer plain(scene, kWide, {.max_bounces = 1});
  scene.detector.gain = 3;
  scene.detector.background = {0.1, 0.2, 0.3, 0.4};
  const DofLayout layout(scene);
  std::vector<int> dofs{layout.gain()};
  for (int i = 0; i < 4; ++i) dofs.push_back(layout.background(i));
  const TangentBasis basis = free_dofs(scene, dofs);
  const Renderer renderer(scene, kWide, {.max_bounces = 1}, &basis);
  const SampleRange range{0, 64};
  const GatedImage light = plain.render({3, 0, 0}, range), image = renderer.render({3, 0, 0}, range);
  const auto derivatives = renderer.derive(Term::interior, {3, 0, 0}, range);
  GatedImage weights = light;
  for (int pixel = 0; pixel < 4; ++pixel)
    for (int g = 0; g < kWide.size(); ++g) {
      EXPECT_NEAR(image.at(pixel, g, 0), 3 * light.at(pixel, g, 0) + 0.1 * (pixel + 1), 1e-14);
      EXPECT_NEAR(derivatives[0].at(pixel, g, 0), light.at(pixel, g, 0), 1e-14);
      for (int i = 0; i < 4; ++i) EXPECT_EQ(derivatives[1 + i].at(pixel, g, 0), i == pixel ? 1 : 0);
      weights.at(pixel, g, 0) = 1 + pixel + 0.5 * g;
    }
  std::vector<double> dof_gradient(layout.size(), 0.0);
  std::vector<std::vector<double>> parts;
  renderer.add_gradient(Term::interior, weights, {3, 0, 0}, range, dof_gradient, &parts);
  const std::vector<double> gradient = basis.transpose_apply(dof_gradient);
  for (int column = 0; column < basis.columns; ++column) {
    double sum = 0;
    for (const auto& part : parts) sum += part[column];
    EXPECT_NEAR(sum, gradient[column], 1e-12 * std::abs(sum));
    if (column > 0) {
      EXPECT_DOUBLE_EQ(gradient[column], 4.0 * column + 0.5 * 6);
    }
  }
}

}  // namespace
}  // namespace isochron::testing
