"""Kernels of anchor placement over packed sight: how many anchors targets see, and what those weigh.

Sight is packed: bit i of row a = anchor a sees target i.
"""

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["count_masks", "keep_in_range", "weight_under_mask"]


@scalar_kernel
def _ones(word):
    """How many bits of a word are set."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


# bits of a number of anchors in sight
COUNT_BITS = 10


@scalar_kernel
def count_masks(rows, full, reached, short):
    """Fill bits of targets that at least ``full`` of rows (k, words) see, and of those that see one too few."""
    # rows are added up 64 targets at a time, a word for each binary digit of the sums
    digits = np.zeros(COUNT_BITS, np.uint64)
    for w in range(rows.shape[1]):
        digits[:] = 0
        for a in range(rows.shape[0]):
            carry = rows[a, w]
            for digit in range(COUNT_BITS):
                digits[digit], carry = digits[digit] ^ carry, digits[digit] & carry
                if carry == 0:
                    break
        more, equal, equal_short = np.uint64(0), ~np.uint64(0), ~np.uint64(0)
        for digit in range(COUNT_BITS - 1, -1, -1):
            if (full >> digit) & 1 != 0:
                equal &= digits[digit]
            else:
                more |= equal & digits[digit]
                equal &= ~digits[digit]
            equal_short &= digits[digit] if ((full - 1) >> digit) & 1 != 0 else ~digits[digit]
        reached[w], short[w] = more | equal, equal_short


@parallel_kernel
def weight_under_mask(bits, which, mask, weight, out):
    """Fill out (r,) with the weight of the targets in mask (words,) that each row bits[which[r]] sees.

    weight: (m,), or (0,) where every target counts 1.
    """
    for r in prange(which.shape[0]):
        row = bits[which[r]]
        total = 0.0
        if weight.shape[0] == 0:
            ones = np.uint64(0)
            for w in range(mask.shape[0]):
                ones += _ones(row[w] & mask[w])
            total = float(ones)
        else:
            for w in range(mask.shape[0]):
                word = row[w] & mask[w]
                if word != 0:
                    for b in range(min(64, weight.shape[0] - 64 * w)):
                        if (word >> np.uint64(b)) & np.uint64(1) != 0:
                            total += weight[64 * w + b]
        out[r] = total


@parallel_kernel
def keep_in_range(seen, place_m, point_m, max_range_m, drop_per_m2):
    """Clear seen (n, m) bool where a target (m, 3) is further from an anchor (n, 3) than its longest slant range.

    drop_per_m2: curvature, as for antenna limits: ground at distance d lies d² times that lower.
    """
    for i in prange(point_m.shape[0]):
        for a in range(place_m.shape[0]):
            east, north = point_m[i, 0] - place_m[a, 0], point_m[i, 1] - place_m[a, 1]
            across2 = east * east + north * north
            up = point_m[i, 2] - drop_per_m2 * across2 - place_m[a, 2]
            if across2 + up * up > max_range_m * max_range_m:
                seen[a, i] = False
