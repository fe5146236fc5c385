"""Slow obvious oracle for one ray of samples: a running maximum of slopes, in plain Python. Imports nothing of ours."""

import math


def seen_along_ray(eye_m, distances_m, grounds_m, receiver_m=0.0, drop_per_m2=0.0, tolerance_m=1e-5):
    """For samples going outward, whether the line from the eye to receiver_m above each clears all before it.

    True, False, or None where the ground is unknown (NaN) or unknown ground lies before it and nothing known hides it.
    """
    steepest, unknown, answers = -math.inf, False, []
    for distance_m, ground_m in zip(distances_m, grounds_m, strict=True):
        if math.isnan(ground_m):
            unknown = True
            answers.append(None)
            continue
        altitude_m = ground_m - drop_per_m2 * distance_m**2
        steepest = max(steepest, (altitude_m - eye_m) / distance_m)
        sees = altitude_m + receiver_m + tolerance_m - eye_m >= steepest * distance_m
        answers.append(None if sees and unknown else sees)
    return answers
