// Results depend on seed, iteration, pass and sample range alone: not on threads, nor, where all samples are independent,
// on how a range is cut.
#include <gtest/gtest.h>

#include "core/base/parallel.h"
#include "support.h"

namespace isochron::testing {
namespace {

struct Results {
  GatedImage image;
  std::vector<std::vector<GatedImage>> derivatives;  ///< [term][column]
  std::vector<std::vector<double>> gradients;        ///< [term][dof]
};

/// A scene, gates with jumps (so that no term is empty) and two columns.
class Determinism : public ::testing::TestWithParam<Sampling> {
 protected:
  Determinism()
      : scene_(load_scene(TEST_DATA "/validation/scene.yaml")),
        gates_(GateShape::truncated_gaussian(0.2, 0.3), {4.9, 5.3, 5.8}),
        basis_(
            make_basis(scene_, {translate(scene_, "block", {0.5, 0, 1}), change_material(scene_, "grey", "albedo")})),
        renderer_(make_renderer()) {}
  ~Determinism() override { set_thread_count(0); }

  /// Guided, so that what each renderer learns is tested, too.
  Renderer make_renderer() const {
    return {scene_, gates_, {.max_bounces = 3, .sampling = GetParam(), .guiding_samples = 1.2}, &basis_};
  }

  Results run(const Stream& stream, SampleRange range) const { return run(renderer_, stream, range); }
  Results run(const Renderer& renderer, const Stream& stream, SampleRange range) const {
    Results r;
    r.image = renderer.render(stream, range);
    GatedImage adjoint = r.image;
    for (std::size_t i = 0; i < adjoint.data.size(); ++i) adjoint.data[i] = std::sin(1.0 + static_cast<double>(i));
    for (const Term term : kTerms) {
      r.derivatives.push_back(renderer.derive(term, stream, range));
      r.gradients.emplace_back(DofLayout(scene_).size(), 0.0);
      renderer.add_gradient(term, adjoint, stream, range, r.gradients.back());
    }
    return r;
  }

  /// All numbers of a result in a row.
  static std::vector<double> flat(const Results& r) {
    std::vector<double> all = r.image.data;
    for (const auto& term : r.derivatives)
      for (const auto& image : term) all.insert(all.end(), image.data.begin(), image.data.end());
    for (const auto& term : r.gradients) all.insert(all.end(), term.begin(), term.end());
    return all;
  }

  Scene scene_;
  GateSet gates_;
  TangentBasis basis_;
  Renderer renderer_;
};

TEST_P(Determinism, SameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<double>> results;
  for (const int threads : {1, 2, 1}) {
    set_thread_count(threads);
    results.push_back(flat(run(make_renderer(), {3, 1, 4}, {0, 8})));
  }
  for (double x : results[0]) ASSERT_TRUE(std::isfinite(x));
  for (std::size_t i = 1; i < results.size(); ++i) EXPECT_EQ(results[i], results[0]);
}

TEST_P(Determinism, EverythingInTheKeyMatters) {
  const Results base = run({3, 1, 4}, {0, 8});
  const struct {
    Stream stream;
    SampleRange range;
  } others[] = {{{4, 1, 4}, {0, 8}},
                {{3 + (std::uint64_t{1} << 32), 1, 4}, {0, 8}},
                {{3, 2, 4}, {0, 8}},
                {{3, 1, 5}, {0, 8}},
                {{3, 1, 4}, {8, 16}}};
  for (const auto& other : others) {
    const Results r = run(other.stream, other.range);
    int lit = 0, equal = 0;
    for (std::size_t i = 0; i < r.image.data.size(); ++i) {
      lit += r.image.data[i] != 0;
      equal += r.image.data[i] != 0 && r.image.data[i] == base.image.data[i];
    }
    EXPECT_GT(lit, 200);
    EXPECT_EQ(equal, 0);
    for (std::size_t term = 0; term < std::size(kTerms); ++term) {
      for (int column = 0; column < 2; ++column) {
        double sum = 0;
        for (double x : r.derivatives[term][column].data) sum += std::abs(x);
        // The albedo, column 1, moves no boundary and no length.
        const bool varies = kTerms[term] == Term::interior || column == 0;
        EXPECT_EQ(sum > 0, varies) << name(kTerms[term]) << ", column " << column;
        EXPECT_EQ(r.derivatives[term][column].data != base.derivatives[term][column].data, varies)
            << name(kTerms[term]) << ", column " << column;
      }
      EXPECT_NE(r.gradients[term], base.gradients[term]);
    }
  }
}

TEST_P(Determinism, GradientsAreAddedToWhatIsThere) {
  const GatedImage adjoint = renderer_.render({3, 1, 4}, {0, 2});
  std::vector<double> from_zero(DofLayout(scene_).size(), 0.0), from_some(from_zero.size(), 1.5);
  renderer_.add_gradient(Term::interior, adjoint, {3, 1, 5}, {0, 4}, from_zero);
  renderer_.add_gradient(Term::interior, adjoint, {3, 1, 5}, {0, 4}, from_some);
  for (std::size_t i = 0; i < from_zero.size(); ++i) ASSERT_EQ(from_some[i], 1.5 + from_zero[i]);
}

INSTANTIATE_TEST_SUITE_P(, Determinism, ::testing::Values(Sampling::standard, Sampling::ellipsoidal),
                         [](const auto& test) {
                           return std::string(test.param == Sampling::standard ? "Standard" : "Ellipsoidal");
                         });

}  // namespace
}  // namespace isochron::testing
