"""Anchors, motions and first beliefs that the tests of navigation share."""

import numpy as np

from navigation import MotionNoise, initial_state

MOTION = MotionNoise(0.2, 0.3, 0.1, 0.05)
ANCHORS_M = np.array(
    [
        (900.0, 100.0, 300.0),
        (-800.0, 400.0, 250.0),
        (100.0, -900.0, 400.0),
        (-200.0, 700.0, 120.0),
        (500.0, 800.0, 500.0),
        (-600.0, -700.0, 350.0),
    ]
)


def belief(clock, time_s=0.0, position_m=(3.0, -4.0, 20.0)):
    """A first belief with or without a receiver's clock."""
    return initial_state(time_s, position_m, (1.0, 2.0, -0.5), clock_m=(30.0, 0.2) if clock else None)


def correlated(state, seed=1):
    """The same belief with a full covariance."""
    from navigation import FilterState

    rng = np.random.default_rng(seed)
    root = rng.normal(size=(len(state.mean), len(state.mean)))
    return FilterState(state.time_s, state.mean, root @ root.T + np.eye(len(state.mean)))


def true_ranges_m(state_or_position, anchors_m=ANCHORS_M, clock_m=0.0):
    """Ranges from a place to anchors."""
    return np.linalg.norm(np.asarray(anchors_m) - np.asarray(state_or_position), axis=1) + clock_m
