// Every derivative term against tests/data/reference: a diffuse box, three bounces, whose terms were computed by a slow
// independent program (see the README of the data). Columns: image I, interior, path_length, visibility (primary and
// secondary together here) and total.
//
// Statistics: 9 gates x 2 parameters x 5 rows per sampling, each a z-test at 4 standard errors of the difference
// (ours and the reference's): false alarms 90 x 6e-5 = 0.6 % per sampling if all were independent; seeds are fixed.
// The standard error must be below 4 % of the derivative's scale (the terms' root mean square over the gates; 6 % for
// the ellipsoidal runs, which have fewer samples, 8 % without coupling), so that a flipped sign, a dropped term or a
// factor of two in any term that matters fails. It is 0.5 to 0.7 of that.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

using Rows = std::map<std::string, std::map<std::string, Estimate>>;

Rows read_reference(const std::string& file) {
  Rows rows;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::string gate, term, mean, error;
    std::getline(fields, gate, ',');
    std::getline(fields, term, ',');
    std::getline(fields, mean, ',');
    std::getline(fields, error, ',');
    rows[gate][term] = {std::stod(mean), std::stod(error)};
  }
  return rows;
}

Estimate sum(const Estimate& a, const Estimate& b) {
  return {a.mean + b.mean, std::hypot(a.standard_error, b.standard_error)};
}

struct ReferenceCase {
  const char* kind;
  const char* names[3];
  GateShape shape;
  Sampling sampling;
  bool antithetic = true;
};
void PrintTo(const ReferenceCase& c, std::ostream* out) {
  *out << c.kind;
}

class Reference : public ::testing::TestWithParam<ReferenceCase> {};

TEST_P(Reference, EveryTerm) {
  const ReferenceCase& c = GetParam();
  const bool standard = c.sampling == Sampling::standard;
  const std::string folder = TEST_DATA "/reference/";
  const Scene scene = load_scene(folder + "scene.yaml");
  const Rows references[2] = {read_reference(folder + "block_rotation.csv"), read_reference(folder + "light_z.csv")};
  const TangentBasis basis =
      make_basis(scene, {rotate_y(scene, "block", {-0.2, -0.4, 0.15}), translate(scene, "light", {0, 0, 1})});
  const GateSet gates(c.shape, {5.0, 6.0, 7.0});
  EstimatorOptions options;
  options.max_bounces = 3;
  options.sampling = c.sampling;
  options.antithetic = c.antithetic;
  options.guiding_samples = 32;
  options.follow = options.follow_radius = 0;  // the reference's vertices follow nothing: other terms, of the same sum
  const Renderer renderer(scene, gates, options, &basis);

  constexpr int kBatches = 32;
  const Stream stream{21, 0, 0};
  const auto image = image_means(renderer, 3, standard ? 28 : 9, kBatches, stream);
  const auto interior = term_means(renderer, Term::interior, 2, 3, standard ? 140 : 30, kBatches, stream);
  const auto visibility =
      term_means(renderer, Term::visibility, 2, 3, samples_of(Term::visibility, standard ? 84 : 30), kBatches, stream);
  const auto path_length = term_means(renderer, Term::path_length, 2, 3, standard ? 28 : 22, kBatches, stream);
  for (int p = 0; p < 2; ++p) {
    double scale = 0;
    for (int g = 0; g < 3; ++g)
      scale = std::hypot(scale, std::hypot(interior[p][g].mean, visibility[p][g].mean, path_length[p][g].mean));
    scale /= std::sqrt(3);
    for (int g = 0; g < 3; ++g) {
      const auto& row = references[p].at(c.names[g]);
      const Estimate in = interior[p][g], vis = visibility[p][g], length = path_length[p][g];
      const auto agrees = [&](const char* what, const Estimate& ours, const Estimate& theirs) {
        EXPECT_LT(std::abs(z_score(ours, theirs)), 4)
            << c.names[g] << " parameter " << p << " " << what << ": " << ours.mean << " +- " << ours.standard_error
            << ", reference " << theirs.mean << " +- " << theirs.standard_error;
      };
      if (p == 0) agrees("image", image[g], row.at("I"));
      agrees("interior", in, row.at("interior"));
      agrees("visibility", vis, sum(row.at("visibility_primary"), row.at("visibility_secondary")));
      agrees("path_length", length, row.at("path_length"));
      const Estimate total = sum(sum(in, vis), length);
      agrees("total", total, row.at("total"));
      EXPECT_LT(total.standard_error, scatter_of_errors(kBatches) *
                                          (standard       ? 0.04
                                           : c.antithetic ? 0.06
                                                          : 0.08) *
                                          scale)
          << c.names[g] << " parameter " << p;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Gates, Reference,
    ::testing::Values(ReferenceCase{"gaussian_standard",
                                    {"gauss:5:0.3:0:0", "gauss:6:0.3:0:0", "gauss:7:0.3:0:0"},
                                    GateShape::gaussian(0.3),
                                    Sampling::standard},
                      ReferenceCase{"boxcar_standard",
                                    {"boxcar:5:0:4.7:5.3", "boxcar:6:0:5.7:6.3", "boxcar:7:0:6.7:7.3"},
                                    GateShape::boxcar(0.6),
                                    Sampling::standard},
                      ReferenceCase{"truncated_standard",
                                    {"tgauss:5:0.3:4.7:5.3", "tgauss:6:0.3:5.7:6.3", "tgauss:7:0.3:6.7:7.3"},
                                    GateShape::truncated_gaussian(0.3, 0.3),
                                    Sampling::standard},
                      ReferenceCase{"gaussian_ellipsoidal",
                                    {"gauss:5:0.3:0:0", "gauss:6:0.3:0:0", "gauss:7:0.3:0:0"},
                                    GateShape::gaussian(0.3),
                                    Sampling::ellipsoidal},
                      ReferenceCase{"truncated_ellipsoidal",
                                    {"tgauss:5:0.3:4.7:5.3", "tgauss:6:0.3:5.7:6.3", "tgauss:7:0.3:6.7:7.3"},
                                    GateShape::truncated_gaussian(0.3, 0.3),
                                    Sampling::ellipsoidal},
                      ReferenceCase{"truncated_uncoupled",
                                    {"tgauss:5:0.3:4.7:5.3", "tgauss:6:0.3:5.7:6.3", "tgauss:7:0.3:6.7:7.3"},
                                    GateShape::truncated_gaussian(0.3, 0.3),
                                    Sampling::ellipsoidal,
                                    false}),
    [](const auto& test) { return test.param.kind; });

}  // namespace
}  // namespace isochron::testing
