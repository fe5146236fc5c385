"""The receiver: gnss-sdr's sample, and how fast satellites are looked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.timing import best_of_each_s
from gnss.receiver import PRNS, Samples, Search, acquire, read_samples

__all__ = ["acquisition_speed", "recorded_sample"]

RECORDED = Path(__file__).parents[2] / "../shared/data/if/GPS_L1_CA_ID_1_Fs_4Msps_2ms.dat"
SEED = 22


def recorded_sample() -> Table:
    """What is in the sample of 2 ms that comes with gnss-sdr."""
    rows: tuple[Row, ...] = ()
    if RECORDED.exists():
        found = acquire(read_samples(RECORDED, 4e6), Search(duration_s=0.002, false_alarm=1e-3))
        first, second = found.satellites[:2]
        right = first.found and abs(first.doppler_hz - 1680.0) <= 250.0 and abs(first.code_start_sample - 523) <= 1
        place = f"PRN {first.prn}, {first.doppler_hz:+.0f} Hz, sample {first.code_start_sample}"
        rows = (
            Row(("the highest", place), "PRN 1, +1680 Hz ± 250, sample 523 ± 1", right and first.prn == 1),
            Row(
                ("the next, of 31", f"PRN {second.prn}: {second.power:.1f} of {found.limit:.1f} over noise"),
                "below the threshold of 1e-3",
                not second.found,
            ),
        )
    note = f"2 ms at 4 Msps, 41 Dopplers.{'' if rows else ' The recording is not beside this checkout.'}"
    return Table("Acquisition of gnss-sdr's sample", ("cell", "where"), rows, note)


def acquisition_speed(prns: int = 32) -> Table:
    """All satellites at 41 Dopplers over 4 ms, beside the Fourier transforms that it takes at least."""
    rng = np.random.default_rng(SEED)
    values = (rng.normal(size=(16_000, 2)) @ (1.0, 1j)).astype(np.complex64)
    samples, asked = Samples(values, 4e6), PRNS[:prns]
    blocks = values.reshape(4, 4000)

    def transforms() -> None:
        for _ in range(41 * (prns + 1)):
            np.fft.ifft(blocks, axis=1)

    best_s = best_of_each_s({"acquire": lambda: acquire(samples, prns=asked), "transforms": transforms}, rounds=5)
    took_s, least_s = best_s["acquire"], best_s["transforms"]
    table = (
        Row((f"{prns} satellites, 41 Dopplers, 4 ms at 4 Msps", duration(took_s)), "≤ 1 s", took_s <= 1.0),
        Row(("of that the bare transforms", f"{duration(least_s)} ({took_s / least_s:.1f} times that in all)")),
    )
    return Table("Speed of acquisition", ("what", "measured"), table, "One core.")
