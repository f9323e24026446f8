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
    {{Sampling::automatic, "auto", "whichever suits the gates' width, or both combined"},
     {Sampling::standard, "standard", "paths of any length"},
     {Sampling::ellipsoidal, "ellipsoidal", "paths of the lengths that the gates let through"}});

template <>
inline constexpr auto kChoices<ArcPick> = std::to_array<Choice<ArcPick>>(
    {{ArcPick::contribution, "contribution", "in proportion to what each arc would carry if nothing stood in the way"},
     {ArcPick::uniform, "uniform", "the paper's way, noisier"}});

template <>
inline constexpr auto kChoices<Numbers> = std::to_array<Choice<Numbers>>(
    {{Numbers::low_discrepancy, "low_discrepancy", "samples cover evenly what they are taken from"},
     {Numbers::independent, "independent", "none knows of another"}});

template <>
inline constexpr auto kChoices<GradientMethod> = std::to_array<Choice<GradientMethod>>(
    {{GradientMethod::analytic, "analytic", "derivatives of the renderer, term by term"},
     {GradientMethod::finite_difference, "finite_difference", "two images per unknown"}});

template <>
inline constexpr auto kChoices<LossKind> = std::to_array<Choice<LossKind>>(
    {{LossKind::squared, "squared", "its square"},
     {LossKind::huber, "huber", "beyond `scale`, residuals pull like their size, not its square"},
     {LossKind::cauchy, "cauchy", "large residuals hardly pull"},
     {LossKind::poisson, "poisson", "half the deviance of counts: their negative log likelihood"}});

}  // namespace isochron
