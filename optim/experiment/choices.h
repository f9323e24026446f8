// The words that experiment files hold, see core/base/description.h.
#pragma once
#include "core/base/description.h"
#include "optim/experiment/experiment.h"

namespace isochron {

template <>
inline constexpr auto kChoices<LengthUnit> = std::to_array<Choice<LengthUnit>>(
    {{LengthUnit::scene, "scene", "scene units"}, {LengthUnit::ns, "ns", ""}, {LengthUnit::ps, "ps", ""}});

template <>
inline constexpr auto kChoices<Sampling> = std::to_array<Choice<Sampling>>(
    {{Sampling::automatic, "auto",
      "what measures best for the gates' width: one of the two; with light subpaths where those "
      "help"},
     {Sampling::standard, "standard", "paths of any length"},
     {Sampling::ellipsoidal, "ellipsoidal", "paths of the lengths that the gates let through"}});

template <>
inline constexpr auto kChoices<ArcPick> = std::to_array<Choice<ArcPick>>(
    {{ArcPick::contribution, "contribution", "with probability proportional to each arc's unshadowed contribution"},
     {ArcPick::uniform, "uniform", "the paper's way, noisier"}});

template <>
inline constexpr auto kChoices<Numbers> =
    std::to_array<Choice<Numbers>>({{Numbers::low_discrepancy, "low_discrepancy", "samples cover their domain evenly"},
                                    {Numbers::independent, "independent", "all are independent"}});

template <>
inline constexpr auto kChoices<GradientMethod> = std::to_array<Choice<GradientMethod>>(
    {{GradientMethod::analytic, "analytic", "derivatives of the renderer, term by term"},
     {GradientMethod::finite_difference, "finite_difference", "two images per unknown"}});

template <>
inline constexpr auto kChoices<LossKind> = std::to_array<Choice<LossKind>>(
    {{LossKind::squared, "squared", "its square"},
     {LossKind::huber, "huber", "beyond `scale` the absolute value in place of the square"},
     {LossKind::cauchy, "cauchy", "large residuals have hardly any effect"},
     {LossKind::poisson, "poisson", "half the deviance of counts: their negative log likelihood"}});

}  // namespace isochron
