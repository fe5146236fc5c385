"""Ranges that may lie, by drawing: places from the prior, each weighed by its ranges; nothing is linear."""

import numpy as np
from scipy.stats import exponnorm, norm


def likelihood_of_lie(off_m, sigma_m, least_m, mean_beyond_m):
    """Density of least + Exp(mean) + noise."""
    return exponnorm.pdf(off_m, mean_beyond_m / sigma_m, loc=least_m, scale=sigma_m)


def posterior(rng, count, prior, anchors_m, measured_m, sigma_m, share, law):
    """(mean (3,), covariance (3, 3), probability that each range lies (k,)) of a place with a Gaussian prior.

    prior: (mean, covariance). share: of ranges that lie, each by itself. law: least, mean beyond it.
    """
    places = rng.multivariate_normal(*prior, count)
    weights, lies = np.ones(count), []
    for anchor, measured in zip(anchors_m, measured_m, strict=True):
        off = measured - np.linalg.norm(places - anchor, axis=1)
        right, lie = (1.0 - share) * norm.pdf(off, 0.0, sigma_m), share * likelihood_of_lie(off, sigma_m, *law)
        weights *= right + lie
        lies.append(lie / (right + lie))
    weights /= weights.sum()
    mean = weights @ places
    spread = (places - mean).T @ ((places - mean) * weights[:, None])
    return mean, spread, np.array([weights @ one for one in lies])
