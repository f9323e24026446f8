"""How well expected counts explain counts: the deviance, and what it would be if nothing but chance were amiss."""

import numpy as np

SEED = 1


def deviance(counts, means):
    """Twice the difference of log likelihoods between counts' own values and means; both positive or 0 alike."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.where(counts > 0, counts * np.log(counts / means), 0.0)
    return float(2 * (means - counts + logs).sum())


class Fit:
    """Deviances per degree of freedom: `fitted` of the run's fit, `drawn` of Poisson numbers drawn from it. Where counts
    are few the latter is not 1, so it is what the former has to be compared with."""

    def __init__(self, run):
        random = np.random.default_rng(SEED)
        fitted = drawn = 0.0
        self.readings = self.dark = 0
        for counts, means in zip(run.counts[run.used_bins], run.fit[run.used_bins]):  # bin by bin, to save memory
            counts, means = counts[run.used_points].astype(float), means[run.used_points].astype(float)
            lit = means > 0  # elsewhere a count is impossible and the deviance infinite, be it by noise of the image
            self.dark += int(np.count_nonzero(~lit))
            counts, means = counts[lit], means[lit]
            fitted += deviance(counts, means)
            drawn += deviance(random.poisson(means).astype(float), means)
            self.readings += len(means)
        freedom = self.readings - run.unknowns
        self.fitted = fitted / freedom if freedom > 0 else np.nan
        self.drawn = drawn / self.readings if self.readings else np.nan
        self.ratio = self.fitted / self.drawn if self.drawn else np.nan
