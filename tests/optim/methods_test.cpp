// Methods that are the same by another name.
#include "optim/analysis/methods.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "optim/experiment/experiment.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

struct GatesAlike {
  std::string gates, alike;  ///< `alike`: what `auto` comes down to
};

// Steady gates leave standard sampling alone, gates of a tenth of a percent leave ellipsoidal connections.
TEST(Methods, KnowsWhatAutomaticSamplingComesDownTo) {
  TemporaryFolder folder;
  write_tiny_scene(folder);
  folder.write("tiny.yaml", tiny_experiment());
  for (const GatesAlike& c :
       {GatesAlike{"gates={kind: steady}", "standard"},
        GatesAlike{"gates={kind: gaussian, centers: [4.5], sigma: 0.02}", "ellipsoidal_coupled"}}) {
    SCOPED_TRACE(c.gates);
    const Experiment experiment = load_experiment(folder.file("tiny.yaml"), {c.gates});
    std::vector<std::string> notes;
    const std::vector<Method> methods = methods_for(experiment, {0.05}, notes);
    std::deque<MethodRun> runs;
    for (const Method& method : methods) runs.emplace_back(experiment, method);
    notes.clear();
    const std::vector<std::size_t> first = first_alike(runs, methods, "here: ", notes);
    const std::size_t automatic = std::ranges::find(methods, "auto", &Method::name) - methods.begin();
    const std::size_t alike = std::ranges::find(methods, c.alike, &Method::name) - methods.begin();
    for (std::size_t i = 0; i < methods.size(); ++i) EXPECT_EQ(first[i], i == automatic ? alike : i) << methods[i].name;
    EXPECT_EQ(notes, std::vector<std::string>{"here: auto comes down to " + c.alike + ": measured once"});

    const std::vector<double> theta = runs[0].problem().parameters().initial();
    const GatedImage target = runs[0].problem().make_target();
    EXPECT_EQ(runs[automatic].gradient(theta, target, 5).gradient, runs[alike].gradient(theta, target, 5).gradient);
  }
}

// The slope of a likelihood needs two halves of the image's samples, which the first of the charts' trials must leave.
TEST(Methods, AllOfThemKnowTheSlopeOfALikelihood) {
  TemporaryFolder folder;
  write_tiny_scene(folder);
  folder.write("tiny.yaml", tiny_experiment());
  const Experiment experiment = load_experiment(folder.file("tiny.yaml"), {"loss={kind: poisson}"});
  std::vector<std::string> notes;
  for (const Method& method : methods_for(experiment, {0.05}, notes)) {
    SCOPED_TRACE(method.name);
    MethodRun run(experiment, method);
    run.set_factor(run.least_factor());
    const std::vector<double> theta = run.problem().parameters().initial();
    EXPECT_NO_THROW(run.gradient(theta, run.problem().make_target(), 0));
  }
}

TEST(Methods, LeaveOutOneTechniqueEach) {
  TemporaryFolder folder;
  write_tiny_scene(folder);
  folder.write("tiny.yaml", tiny_experiment());
  const auto names = [&](const std::vector<std::string>& settings) {
    std::string all;
    for (const Method& method : methods_without(load_experiment(folder.file("tiny.yaml"), settings)))
      all += method.name + " ";
    return all;
  };
  const std::string rest = "without_wedge without_aimed without_from_camera without_at_length without_light_arcs ";
  EXPECT_EQ(names({}), "auto without_standard without_ellipsoidal without_light " + rest);
  for (const char* gates : {"gates={kind: steady}", "gates={kind: dirac, centers: [5]}"})
    EXPECT_EQ(names({gates}), "auto without_light " + rest) << gates;
  EXPECT_EQ(names({"estimator={techniques: [standard, ellipsoidal, wedge]}"}),
            "auto without_standard without_ellipsoidal without_light without_wedge ");
}

TEST(Methods, TrialsHaveRandomNumbersOfTheirOwn) {
  for (const std::uint32_t gates : {1u, 2u, 10u}) {
    std::set<std::uint32_t> numbers;
    for (const std::uint32_t first : {0u, kTrialIteration})
      for (std::uint32_t iteration = 0; iteration < 5; ++iteration)
        for (std::uint32_t gate = 0; gate < gates; ++gate)
          numbers.insert(number_of_gate(first + iteration, gates, gate));
    EXPECT_EQ(numbers.size(), 2 * 5 * gates);
  }
}

}  // namespace
}  // namespace isochron
