"""Pseudoranges that may lie, by drawing: places and clocks from the prior, each weighed by its ranges."""

import numpy as np
from scipy.stats import norm

from tests.reference.lying_ranges import likelihood_of_lie


def posterior(rng, count, prior, satellites_m, measured_m, sigma_m, share, mean_m):
    """(mean (4,), covariance (4, 4), probability that each lies) of east, north, up and clock; prior: mean, sigmas."""
    states = rng.normal(*prior, (count, 4))
    weights, lies = np.ones(count), []
    for satellite, measured in zip(satellites_m, measured_m, strict=True):
        off = measured - np.linalg.norm(states[:, :3] - satellite, axis=1) - states[:, 3]
        right, lie = (1.0 - share) * norm.pdf(off, 0.0, sigma_m), share * likelihood_of_lie(off, sigma_m, 0.0, mean_m)
        weights *= right + lie
        lies.append(lie / np.maximum(right + lie, 1e-300))  # far off both are 0, and so is the weight
    weights /= weights.sum()
    mean = weights @ states
    return mean, (states - mean).T @ ((states - mean) * weights[:, None]), np.array([weights @ one for one in lies])
