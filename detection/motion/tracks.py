"""The rover's own track as a witness: where it leads, a range must fit, and how far one does not fit is estimated.

Numbers of the model are shares of the ranging sigma, or rates; how they were chosen is in docs/detection-proof.md.
Of anchors in one plane, either side may be the rover's once it passes through.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..epochs import GroundHeight
from ..kernels import track as kernel
from ..settings import DetectorSettings
from .odometry import Motion

__all__ = [
    "Heard",
    "Track",
    "begin",
    "follow",
    "foretold",
    "is_sane",
    "mirrored_near",
    "on_ground",
    "with_displacement",
]

Floats = npt.NDArray[np.float64]

NOISE = 0.5  # of a range's sigma is noise from range to range; the rest is slower, and belongs to the excess
SHARED = 0.6  # of the sigma: what all ranges of one receiver have too much
CLEARED = 0.4  # of the sigma: spread of the excess of an anchor in sight
CREEP = 0.35  # of the sigma per square root of a second
CREEP_OF_ITSELF = 1.3  # of an excess per square root of a second: what is long changes fast
BACK_PER_S = 1.7  # rate at which an excess returns to its mean
MEAN = 0.2  # of the sigma: signals arrive late rather than early
CLIMB_FORGOTTEN_PER_S = 4.0
# Sight of an anchor comes and goes about so often: what was known of it before says nothing after that.
ANEW_PER_S = 1.8
NEW_SIGMA = 0.7  # of the typical excess
# One occlusion in ten is an order of magnitude longer: a range so far off must not pull the track along.
FAR_SHARE, FAR_SIGMA = 0.1, 10.0
# Few ranges say nothing: a jump, a counter that ran over, another anchor's name; of any size and sign. How few hardly
# matters, since nothing else explains them.
OUTLIERS = 1e-5
# A range that meets most others of its epoch is seldom newly too long, but where they are all alike.
NEW_THOUGH_MEETING = 0.05
UNDERGROUND = 4.0  # sigmas from the ground that was told, beyond which one of both is wrong
ABSURD_M = 1e9  # no rover is so far away
BLIND = 3.0  # sigmas of a range by which it may be off where a track passes the plane
TELLING = 4.0  # sigmas by which one epoch's ranges tell sides for good


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Gaussian belief at a time: place, velocity, shared excess, then the excess of each anchor (m, m/s).

    state (7 + n,), covariance; heard_s: (n,) when each anchor was last heard, −inf = never. since_s: when it began.
    log_likelihood: of all ranges that it was told.
    """

    state: Floats
    covariance: Floats
    time_s: float
    heard_s: Floats
    since_s: float
    log_likelihood: float = 0.0

    @property
    def place_m(self) -> Floats:
        """(3,) east, north, altitude."""
        return self.state[:3]

    @property
    def speed_m_per_s(self) -> float:
        """How fast it goes."""
        velocity = self.state[3:6]
        return math.sqrt(velocity @ velocity)


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """The ranges of an epoch as a track takes them: index (m,) into all anchors (n, 3), the rest (m,)."""

    anchors_m: Floats
    index: npt.NDArray[np.int64]
    ranges_m: Floats
    sigmas_m: Floats
    times_s: Floats
    p_sight: Floats


def begin(
    place_m: Floats,
    covariance_m2: Floats,
    time_s: float,
    anchors: int,
    settings: DetectorSettings,
    excess_m: dict[int, float] | None = None,
) -> Track:
    """A track of unknown velocity that begins at a place (d,) with its covariance.

    excess_m: of anchors, by index, whose ranges are known to be too long.
    """
    d = len(place_m)
    size = kernel.STATES + anchors
    sigma_m = settings.range_sigma_m
    state, covariance = np.zeros(size), np.zeros((size, size))
    state[:d] = place_m
    covariance[:d, :d] = covariance_m2
    speed = settings.max_speed_m_per_s / 3.0
    covariance[range(3, 3 + d), range(3, 3 + d)] = np.array([speed, speed, 0.3 * speed][:d]) ** 2
    covariance[kernel.SHARED, kernel.SHARED] = (SHARED * sigma_m) ** 2
    own = range(kernel.STATES, size)
    state[kernel.STATES :] = MEAN * sigma_m
    covariance[own, own] = (CLEARED * sigma_m) ** 2
    for anchor, too_long_m in (excess_m or {}).items():
        own_state = kernel.STATES + anchor
        state[own_state] = too_long_m
        covariance[own_state, own_state] = (NEW_SIGMA * settings.excess_m) ** 2
    return Track(state, covariance, time_s, np.full(anchors, -math.inf), time_s)


def follow(
    track: Track, heard: Heard, by_others: Floats, end_s: float, settings: DetectorSettings
) -> tuple[Track, Floats, Floats]:
    """(track after an epoch's ranges, excess (m,) of each over the distance from it, sigma (m,) of that distance).

    by_others: (m, 2) excess of each range over where the others of its epoch meet, its variance; inf = not told.
    """
    sigma_m = settings.range_sigma_m
    measured = kernel.Measured(
        heard.anchors_m, heard.index, heard.ranges_m, heard.sigmas_m, heard.times_s, heard.p_sight, by_others
    )
    order = np.argsort(heard.times_s, kind="stable")
    state, covariance, heard_s, log_likelihood, excess_m, sigmas_m = kernel.follow(
        kernel.Belief(track.state, track.covariance, track.time_s, track.heard_s),
        measured,
        order,
        end_s,
        kernel.Push(settings.acceleration_m_per_s2, settings.vertical_acceleration_m_per_s2, CLIMB_FORGOTTEN_PER_S),
        kernel.Creep(CREEP * sigma_m, CREEP_OF_ITSELF, BACK_PER_S, MEAN * sigma_m),
        kernel.Odds(
            anew_per_s=ANEW_PER_S,
            new_m=settings.excess_m,
            new_sigma_m=NEW_SIGMA * settings.excess_m,
            noise=NOISE,
            cleared=CLEARED,
            far_share=FAR_SHARE,
            far_sigma_m=FAR_SIGMA * settings.excess_m,
            outliers=OUTLIERS,
            meeting=NEW_THOUGH_MEETING,
        ),
        settings.dimension == 2,
    )
    log_likelihood += track.log_likelihood
    return Track(state, covariance, end_s, heard_s, track.since_s, log_likelihood), excess_m, sigmas_m


def foretold(track: Track, time_s: float, settings: DetectorSettings) -> tuple[Floats, Floats]:
    """(place (3,), its covariance (3, 3)) that the track leads to by then."""
    step_s = time_s - track.time_s
    across = track.covariance[:3, 3:6]
    covariance_m2 = (
        track.covariance[:3, :3] + step_s * (across + across.T) + step_s * step_s * track.covariance[3:6, 3:6]
    )
    level_m2, upright_m2 = (
        push**2 * step_s**3 / 3.0 for push in (settings.acceleration_m_per_s2, settings.vertical_acceleration_m_per_s2)
    )
    covariance_m2[range(3), range(3)] += level_m2, level_m2, upright_m2
    return track.place_m + step_s * track.state[3:6], covariance_m2


def with_displacement(
    track: Track, motion: Motion, displacement_m: tuple[float, float], settings: DetectorSettings
) -> Track:
    """The track after odometry said which way (east, north) the rover went in the last so many seconds."""
    duration_s = motion.duration_s
    state, covariance = track.state.copy(), track.covariance.copy()
    turned = settings.acceleration_m_per_s2 * math.sqrt(duration_s / 3.0)  # mean velocity against that at the end
    length_m = math.hypot(*displacement_m)
    ahead = (displacement_m[0] / length_m, displacement_m[1] / length_m) if length_m > 0.0 else (1.0, 0.0)
    # along the way lengths err, across it the heading does as well
    for (east, north), off_m, way_m in (
        (ahead, motion.sigma_m, length_m), ((ahead[1], -ahead[0]), math.hypot(motion.sigma_m, motion.across_m), 0.0)
    ):  # fmt: skip
        direction = np.zeros(len(state))
        direction[3:5] = east, north
        variance = (off_m / duration_s) ** 2 + turned**2
        kernel.pull(state, covariance, direction, way_m / duration_s, variance)
    return replace(track, state=state, covariance=covariance)


def on_ground(track: Track, ground: GroundHeight, time_s: float) -> Track:
    """The track after it was told how high the ground is where it leads to by then.

    Its height over the ground becomes as sure as that, never surer: what epochs after one another are told of the same
    ground are no independent measurements. One that contradicts the ground by many sigmas is left where it is.
    """
    step_s = time_s - track.time_s
    over = np.zeros(len(track.state))
    over[:3] = -ground.slope_east, -ground.slope_north, 1.0
    over[3:6] = step_s * over[:3]
    level_m = ground.altitude_m - ground.slope_east * ground.east_m - ground.slope_north * ground.north_m
    variance_m2, told_m2 = float(over @ track.covariance @ over), ground.sigma_m**2
    miss2 = (level_m - float(over @ track.state)) ** 2 / (variance_m2 + told_m2)
    likely = track.log_likelihood - 0.5 * (min(miss2, UNDERGROUND**2) + math.log(variance_m2 + told_m2))
    if miss2 > UNDERGROUND**2 or variance_m2 <= told_m2:
        return replace(track, log_likelihood=likely)
    state, covariance = track.state.copy(), track.covariance.copy()
    kernel.pull(state, covariance, over, level_m, variance_m2 * told_m2 / (variance_m2 - told_m2))
    return replace(track, state=state, covariance=covariance, log_likelihood=likely)


def is_sane(track: Track, dimension: int) -> bool:
    """Whether rounding left the track numbers that mean something: of very unsure places it may not."""
    variances_m2 = track.covariance.diagonal()
    return bool(
        np.abs(track.state).max() < ABSURD_M
        and variances_m2[:dimension].min() > 0.0
        and variances_m2.max() < ABSURD_M * ABSURD_M
    )


def mirrored_near(track: Track, places_m: Floats, sigma_m: float, dimension: int) -> tuple[Track | None, float]:
    """The same track on the other side of the anchors (m, 3), and how many sigmas an epoch's ranges tell it from there.

    None where it is too far from their plane to have passed it unseen, or where anchors stand so far off that plane
    that its ranges tell sides. Near it ranges know a height only by its square, h²/2r: below √(2·r·3 sigma) hardly.
    """
    d = dimension
    if len(places_m) <= d:
        return None, math.inf
    middle_m, normal, thick_m, wide2_m2 = _plane(places_m.tobytes(), d)
    from_middle_m = track.place_m[:d] - middle_m
    off_m = float(from_middle_m @ normal)
    apart_m = math.sqrt(float(from_middle_m @ from_middle_m) + wide2_m2)  # of the anchors, in the root mean square
    told = 2.0 * abs(off_m) * thick_m / (sigma_m * apart_m)
    if off_m * off_m > 2.0 * apart_m * BLIND * sigma_m or told > TELLING:
        return None, told
    flip = np.eye(d) - 2.0 * np.outer(normal, normal)
    whole = np.eye(len(track.state))
    whole[:d, :d] = whole[3 : 3 + d, 3 : 3 + d] = flip
    state = whole @ track.state
    state[:d] = track.place_m[:d] - 2.0 * off_m * normal
    # it has to be shown by more than the noise of one epoch that the track, which ranges told of, has lost its side
    likely = track.log_likelihood - (told * told if told > 1.0 else 0.0)
    return replace(track, state=state, covariance=whole @ track.covariance @ whole.T, log_likelihood=likely), told


@functools.lru_cache(maxsize=64)
def _plane(places: bytes, d: int) -> tuple[Floats, Floats, float, float]:
    """(middle (d,), normal (d,), how far off it anchors (m, 3) stand, root of the sum, mean square from the middle)."""
    places_m = np.frombuffer(places).reshape(-1, 3)[:, :d]
    middle_m = places_m.mean(axis=0)
    _, sizes_m, axes = np.linalg.svd(places_m - middle_m, full_matrices=False)
    return middle_m, axes[-1], float(sizes_m[-1]), float(sizes_m @ sizes_m) / len(places_m)
