"""The receiver: gnss-sdr's sample, how fast satellites are looked for, and what a second of a weak signal gives."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.timing import best_of_each_s
from gnss.receiver import (
    PRNS,
    Samples,
    Search,
    acquire,
    energy_limit,
    measure_channel,
    noise_limit,
    read_samples,
    search_bits,
)

__all__ = ["acquisition_speed", "channel_speed", "recorded_sample", "weak_signals"]

RECORDED = Path(__file__).parents[2] / "../shared/data/if/GPS_L1_CA_ID_1_Fs_4Msps_2ms.dat"
SEED, FALSE_ALARM = 22, 1e-3
# C/N0, least detection, most wrong bits, largest sigma of phase
TARGETS = ((15.0, 0.87, 0.14, 6.0), (17.0, 0.998, 0.085, 4.0), (20.0, 1.0, 0.025, 2.5))


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


def weak_signals(draws: int = 20_000) -> Table:
    """A second of 50 unknown bits by the search, beside powers of bits added up and beside known bits."""
    rng, rows = np.random.default_rng(SEED), []
    wavelength_mm = 190.293673
    limit = energy_limit(FALSE_ALARM, 50)
    powers, known_limit = 50.0 * noise_limit(FALSE_ALARM, 1, 50), 50.0 * noise_limit(FALSE_ALARM, 1, 1)
    for cn0_db_hz, least, wrong, most_mm in TARGETS:
        bits, phases = rng.choice([-1, 1], (draws, 50)), rng.uniform(-math.pi, math.pi, draws)
        noise = rng.normal(size=(draws, 50, 2)) @ (1.0, 1j) / math.sqrt(2.0)
        turned = np.exp(1j * phases)
        sums = math.sqrt(10.0 ** (cn0_db_hz / 10.0) * 0.02) * bits * turned[:, None] + noise
        found = search_bits(sums)
        seen = found.amplitude > limit
        same = np.sign((found.bits * bits).sum(axis=1))
        errors = float(np.mean(found.bits != bits * same[:, None]))
        known = (sums * bits).sum(axis=1)
        sigmas_mm = [
            float(np.std(np.angle(total * turned.conj()), where=used)) * wavelength_mm / (2.0 * math.pi)
            for total, used in ((found.total * same, seen), (known, np.ones_like(seen)))
        ]
        rate = float(seen.mean())
        target = f"≥ {least:g}, ≤ {wrong:g}, ≤ {most_mm:g} mm"
        met = rate >= least and errors <= wrong and sigmas_mm[0] <= most_mm
        cells = f"{cn0_db_hz:g} dB-Hz", "bits searched", f"{rate:.4f}", f"{errors:.4f}", f"{sigmas_mm[0]:.2f} mm"
        rows.append(Row(cells, target, met))
        apart = float(np.mean((np.abs(sums) ** 2).sum(axis=1) > powers))
        rows.append(Row(("", "powers of bits added", f"{apart:.4f}", "–", "–")))
        together = float(np.mean(np.abs(known) ** 2 > known_limit))
        rows.append(Row(("", "bits known", f"{together:.4f}", "0", f"{sigmas_mm[1]:.2f} mm")))
    noise = rng.normal(size=(draws, 50, 2)) @ (1.0, 1j) / math.sqrt(2.0)
    alarms = float(np.mean(search_bits(noise).amplitude > limit))
    rows.append(Row(("noise alone", "bits searched", f"{alarms:.5f}", "–", "–")))
    note = f"{draws:,} draws each, false alarms at {FALSE_ALARM:g}; phase of those detected, half a cycle taken out."
    return Table("A second of 50 data bits", ("signal", "how", "detected", "bits wrong", "phase σ"), rows, note)


def channel_speed(channels: int = 10, duration_s: float = 1.0) -> Table:
    """Aided channels over samples of 4 Msps, on two threads."""
    rng = np.random.default_rng(SEED)
    values = (rng.normal(size=(round(4e6 * duration_s), 2)) @ (1.0, 1j)).astype(np.complex64)
    samples, times_s = Samples(values, 4e6), np.linspace(0.0, duration_s, 1001)

    def measure(prn: int) -> float:
        return measure_channel(samples, prn, times_s, 0.07 + 1e-6 * prn * times_s).amplitude

    def measured() -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(measure, PRNS[:channels]))

    took_s = best_of_each_s({"channels": measured}, rounds=3)["channels"]
    cells = (
        f"{channels} channels, {duration_s:g} s at 4 Msps",
        duration(took_s),
        f"{duration_s / took_s:.1f} times real time",
    )
    rows = (Row(cells, "real time", took_s <= duration_s),)
    note = "Nine delays, all frequencies within 2 Hz, unknown bits; two threads."
    return Table("Speed of aided channels", ("what", "measured", "that is"), rows, note)
