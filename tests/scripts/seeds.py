"""Random numbers of tests: fixed, or others where ISOCHRON_TEST_SEED asks for them (tests/README.md)."""

import os

import numpy as np


def generator(seed):
    return np.random.default_rng([seed, int(os.environ.get("ISOCHRON_TEST_SEED", "0"))])
