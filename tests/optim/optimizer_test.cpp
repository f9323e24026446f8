#include "optim/solvers/optimizer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/error.h"
#include "optim/experiment/files.h"
#include "optim/run/checkpoint.h"
#include "optim/run/log.h"
#include "optim/solvers/adam.h"
#include "tests/optim/synthetic_objective.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Adam, FollowsTheHandComputedSequence) {
  const AdamOptions options{.learning_rate = 0.1};
  AdamState state;
  std::vector<double> theta = {1.0};
  adam_step(options, {4.0}, {-kInfinity}, {kInfinity}, state, theta);
  EXPECT_NEAR(theta[0], 0.9, 1e-15);  // the first step is the learning rate
  // m = 0.9*0.4 - 0.1*2 = 0.16, corrected by 1 - 0.81; v = 0.999*0.016 + 0.001*4 = 0.019984, by 1 - 0.998001.
  adam_step(options, {-2.0}, {-kInfinity}, {kInfinity}, state, theta);
  EXPECT_NEAR(theta[0], 0.9 - 0.1 * (0.16 / 0.19) / std::sqrt(0.019984 / 0.001999), 1e-14);
  // m = 0.9*0.16 + 0.1*1 = 0.244; v = 0.999*0.019984 + 0.001 = 0.020964016.
  const double before = theta[0];
  adam_step(options, {1.0}, {-kInfinity}, {kInfinity}, state, theta);
  EXPECT_NEAR(theta[0], before - 0.1 * (0.244 / 0.271) / std::sqrt(0.020964016 / 0.002997001), 1e-14);
  EXPECT_EQ(state.steps, 3);
}

TEST(Adam, StepsHalveAsTheDecayAsks) {
  // Under a constant gradient every step of Adam is its rate.
  ExponentialFit unused;
  Evaluation now;
  now.gradient = {3.0, -3.0};
  const Preconditioner none;
  const auto adam = make_optimizer({.learning_rate = 0.5, .decay = {.start = 2, .half_life = 1}}, none);
  std::vector<double> theta = {0, 0};
  const double expected[] = {0.5, 0.5, 0.5, 0.25, 0.125, 0.0625};
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::vector<double> before = theta;
    theta = adam->step(unused, now, theta, i, 1);
    EXPECT_NEAR(before[0] - theta[0], expected[i], 1e-12) << i;
    EXPECT_NEAR(theta[1] - before[1], expected[i], 1e-12) << i;
  }
}

TEST(Adam, StaysWithinBoundsAndDoesNotDependOnTheLossesUnit) {
  const AdamOptions options{.learning_rate = 0.5};
  AdamState state, scaled_state;
  std::vector<double> theta = {0.2, 0.8, 0.5}, scaled = theta;
  const std::vector<double> lower = {0, 0, 0}, upper = {1, 1, 1};
  adam_step(options, {1.0, -1.0, 0.0}, lower, upper, state, theta);
  adam_step(options, {0x1p-200, -0x1p-200, 0.0}, lower, upper, scaled_state, scaled);
  EXPECT_EQ(theta, (std::vector<double>{0, 1, 0.5}));
  EXPECT_EQ(scaled, theta);
}

/// Four albedos: as many unknowns as the tests need, without geometry.
struct Bound {
  Scene scene;
  std::vector<ParameterSpec> specs;
  Bound() {
    for (const char* name : {"a", "b", "c", "d"}) {
      scene.materials.push_back(Material("diffuse", name));
      ParameterSpec spec;
      spec.name = name;
      spec.type = ParameterType::material;
      spec.quantity = "albedo";
      spec.material = name;
      spec.initial = {0.5};
      specs.push_back(spec);
    }
  }
};

std::vector<std::uint64_t> bits(const std::vector<double>& values) {
  std::vector<std::uint64_t> result;
  for (double value : values) result.push_back(std::bit_cast<std::uint64_t>(value));
  return result;
}

Checkpoint awkward_checkpoint() {
  Checkpoint c;
  c.iteration = 17;
  c.seconds = 1.0 / 3;
  c.safeguard.rejected = 2;
  c.safeguard.best_theta = {1, 2, 3, 1.0 / 7};
  c.safeguard.recent = {5e-324, 1e300};
  c.theta = {0.1 + 0.2, -0.0, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max()};
  c.optimizer = {{"steps", {15}},
                 {"m", {1e-300, -1.0 / 3, std::nextafter(1.0, 2.0), 3e8}},
                 {"v", {5e-324, 0x1.fffffffffffffp-3, 1e17, 2.5}}};
  c.loss_initial = std::nextafter(0.1, 1.0);
  return c;
}

TEST(Checkpoint, RoundTripIsBitExact) {
  const Bound bound;
  const Parameters parameters(bound.scene, bound.specs);
  const TemporaryFolder folder;
  EXPECT_FALSE(load_checkpoint(folder.path(), parameters, nullptr).has_value());
  const Checkpoint saved = awkward_checkpoint();
  save_checkpoint(folder.path(), saved, parameters);
  const auto loaded = load_checkpoint(folder.path(), parameters, nullptr);
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->iteration, 17);
  EXPECT_EQ(loaded->safeguard.rejected, 2);
  EXPECT_EQ(loaded->safeguard.best_level, kInfinity);
  EXPECT_EQ(bits(loaded->safeguard.best_theta), bits(saved.safeguard.best_theta));
  EXPECT_EQ(bits(loaded->safeguard.recent), bits(saved.safeguard.recent));
  EXPECT_EQ(loaded->optimizer.size(), 3u);
  for (const auto& [key, values] : saved.optimizer) EXPECT_EQ(bits(loaded->optimizer.at(key)), bits(values)) << key;
  EXPECT_EQ(bits(loaded->theta), bits(saved.theta));
  EXPECT_EQ(bits({loaded->loss_initial, loaded->seconds}), bits({saved.loss_initial, saved.seconds}));
  EXPECT_TRUE(std::isnan(loaded->param_rmse_initial));
}

TEST(Checkpoint, FallsBackToTheOneBefore) {
  const Bound bound;
  const Parameters parameters(bound.scene, bound.specs);
  const TemporaryFolder folder;
  Checkpoint checkpoint = awkward_checkpoint();
  save_checkpoint(folder.path(), checkpoint, parameters);
  checkpoint.iteration = 18;
  save_checkpoint(folder.path(), checkpoint, parameters);
  EXPECT_EQ(load_checkpoint(folder.path(), parameters, nullptr)->iteration, 18);

  const std::string whole = folder.read("checkpoint.yaml");
  const std::string damages[] = {whole.substr(0, whole.size() / 2), "", std::string(3, '\0'),
                                 whole.substr(0, whole.size() - 1),
                                 std::string(whole).replace(whole.find("iteration: 18"), 13, "iteration: 19")};
  for (const std::string& damaged : damages) {
    folder.write("checkpoint.yaml", damaged);
    std::string warning;
    const auto loaded = load_checkpoint(folder.path(), parameters, &warning);
    ASSERT_TRUE(loaded.has_value());
    EXPECT_EQ(loaded->iteration, 17);
    EXPECT_NE(warning.find("damaged"), std::string::npos);
    EXPECT_FALSE(folder.has("checkpoint.yaml"));  // or the next save would move it over the whole one
  }
  folder.write("checkpoint.previous.yaml", "iteration: [");
  EXPECT_THROW(load_checkpoint(folder.path(), parameters, nullptr), InputError);
}

TEST(Checkpoint, IsOfOneSetOfParameters) {
  const Bound bound;
  const TemporaryFolder folder;
  const Parameters parameters(bound.scene, bound.specs);
  save_checkpoint(folder.path(), awkward_checkpoint(), parameters);
  std::vector<ParameterSpec> renamed = bound.specs, fewer = bound.specs;
  renamed[1].name = "other";
  fewer.pop_back();
  EXPECT_THROW(load_checkpoint(folder.path(), Parameters(bound.scene, renamed), nullptr), InputError);
  EXPECT_THROW(load_checkpoint(folder.path(), Parameters(bound.scene, fewer), nullptr), InputError);
}

TEST(Checkpoint, IsOfOneSchemaWhateverTheVersion) {
  const Bound bound;
  const TemporaryFolder folder;
  const Parameters parameters(bound.scene, bound.specs);
  save_checkpoint(folder.path(), awkward_checkpoint(), parameters);
  const std::string text = folder.read("checkpoint.yaml");
  const auto rewrite = [&](const std::string& from, const std::string& to) {
    std::string changed = replaced(text, from, to);
    changed.resize(changed.rfind("checksum: "));
    folder.write("checkpoint.yaml", changed + "checksum: " + checksum(changed) + "\n");
  };
  const std::string ours = fmt::format("schema: {}\n", kCheckpointSchema);
  const std::string version = fmt::format("version: {}\n", program_version());
  std::string warning;
  EXPECT_EQ(load_checkpoint(folder.path(), parameters, &warning)->iteration, 17);
  EXPECT_EQ(warning, "");
  rewrite(version, "version: 9.9.9\n");
  EXPECT_EQ(load_checkpoint(folder.path(), parameters, &warning)->iteration, 17);
  EXPECT_EQ(warning, folder.file("checkpoint.yaml") +
                         ": written by isochron 9.9.9; the result may differ from a run of one version");
  // As before there were schemas; as some other program writes it.
  for (const auto& [schema, found] : {std::pair("format: 2\n", "is missing"), std::pair("schema: 99\n", "99")}) {
    rewrite(ours, schema);
    try {
      load_checkpoint(folder.path(), parameters, nullptr);
      ADD_FAILURE() << "accepted: " << schema;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), fmt::format("{}: schema: {}, written by isochron {} (allowed: {})",
                                          folder.file("checkpoint.yaml"), found, program_version(), kCheckpointSchema));
    }
    EXPECT_TRUE(folder.has("checkpoint.yaml"));
  }
}

TEST(Checkpoint, KeepsWhatIsKnownOfTheDescent) {
  const Bound bound;
  const TemporaryFolder folder;
  const Parameters parameters(bound.scene, bound.specs);
  Checkpoint saved = awkward_checkpoint();
  saved.descent = {{1, 2}, {0.5, 0.25}, {3}, {1.0 / 3}, {1, 2, 3, 4}, 5, true};
  saved.steps_rejected = 6;
  save_checkpoint(folder.path(), saved, parameters);
  const auto loaded = load_checkpoint(folder.path(), parameters, nullptr);
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(loaded->descent.first, saved.descent.first);
  EXPECT_EQ(bits(loaded->descent.recent_noise), bits(saved.descent.recent_noise));
  EXPECT_EQ(loaded->descent.theta_sum, saved.descent.theta_sum);
  EXPECT_EQ(loaded->descent.summed, 5);
  EXPECT_TRUE(loaded->descent.judged);
  EXPECT_EQ(loaded->steps_rejected, 6);
}

TEST(Log, CutsWhatTheCheckpointDoesNotKnow) {
  const Bound bound;
  const Parameters parameters(bound.scene, bound.specs);
  const TemporaryFolder folder;
  const std::vector<double> theta = {1, 2, 3, 0.1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  {
    Log log(folder.file("log.csv"), parameters, 0);
    for (int i = 0; i < 3; ++i)
      log.append({i, 0.5, 0.25, 0.5, nan, i == 1 ? nan : 2, 0.125}, theta, {4, 5, 6, i == 1 ? nan : 7});
  }
  const std::string header =
      "iteration,seconds,loss,image_rmse,param_rmse,gradient_norm,a,b,c,d,a.rmse,b.rmse,c.rmse,"
      "d.rmse,a.gradient,b.gradient,c.gradient,d.gradient,loss_noise\n";
  const std::string rest = ",0.5,0.25,0.5,,2,1,2,3,0.1,,,,,4,5,6,7,0.125\n",
                    unknown = ",0.5,0.25,0.5,,,1,2,3,0.1,,,,,4,5,6,,0.125\n";
  EXPECT_EQ(folder.read("log.csv"), header + "0" + rest + "1" + unknown + "2" + rest);
  folder.write("log.csv", folder.read("log.csv") + "1,0.5");  // torn by a kill
  { Log log(folder.file("log.csv"), parameters, 2); }
  EXPECT_EQ(folder.read("log.csv"), header + "0" + rest + "1" + unknown);
}

}  // namespace
}  // namespace isochron
