"""What the receiver looks for, drawn: ``python -m benchmarks.gnss.receiver_pictures FOLDER``."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

from benchmarks.gnss.deep import DENSE, FROM_S, Driven, drive_through
from benchmarks.gnss.deep_drive import DeepDrive
from gnss.receiver import Samples, correlate_bits, energy_limit, search_bits
from navigation.deep import DeepRules
from tests.reference import gps_signals

__all__ = ["draw"]

BLUE, RED, GREEN = "#2c5f9e", "#c2452d", "#5d7a3c"
RATE_HZ, SEED = 2.5e6, 22


def draw(folder: Path) -> list[Path]:
    """The pictures of docs/receiver.md and docs/deep-integration.md as PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"signal-function": signal_function(), "bit-search": bit_search(), "deep-integration": deep_errors()}
    for name, figure in drawn.items():
        figure.savefig(folder / f"{name}.png", dpi=100)
    return [folder / f"{name}.png" for name in drawn]


def signal_function(cn0_db_hz: float = 20.0) -> matplotlib.figure.Figure:
    """Amplitude over code delay and frequency: 20 ms and a second of one satellite in noise, from samples."""
    rng, t = np.random.default_rng(SEED), np.arange(round(1.02 * RATE_HZ)) / RATE_HZ
    true_s = 0.0705 - 1.4e-6 * t
    values = gps_signals.noise(rng, len(t))
    values += gps_signals.signal(9, true_s, RATE_HZ, cn0_db_hz, rng.choice([-1, 1], 64))
    times_s = np.linspace(0.0, 1.02, 52)
    chips = np.arange(-2.0, 2.01, 0.25)
    columns = []
    for shift in (-1.0, 1.0):
        told = np.interp(times_s, t, true_s) + shift / gps_signals.CHIP_RATE_HZ
        columns.append(correlate_bits(Samples(values.astype(np.complex64), RATE_HZ), 9, times_s, told).sums[:50])
    sums = np.hstack([columns[0], columns[1][:, 1:]])
    at_s = 0.02 * (np.arange(50) - 24.5)
    offsets_hz = np.linspace(-2.0, 2.0, 81)
    turned = np.exp(-2j * np.pi * offsets_hz[:, None] * at_s)
    long = search_bits((turned[:, :, None] * sums).transpose(0, 2, 1).reshape(-1, 50)).amplitude
    figure = matplotlib.figure.Figure(figsize=(12.0, 4.8), layout="constrained")
    grid = np.meshgrid(chips, offsets_hz)
    for place, heights, title in (
        (121, np.repeat(np.abs(sums[10])[None], len(offsets_hz), axis=0), "20 ms: one bit"),
        (122, long.reshape(len(offsets_hz), len(chips)), "1 s: fifty bits, found where each total is greatest"),
    ):
        axes = figure.add_subplot(place, projection="3d")
        axes.plot_surface(*grid, heights, cmap="viridis", linewidth=0.0, antialiased=True)
        axes.set(xlabel="code later, chips", ylabel="frequency, Hz", zlabel="amplitude (noise: 1 a bit)")
        axes.set_title(f"{title}, {cn0_db_hz:g} dB-Hz", fontsize=11)
        axes.view_init(28, -60)
    return figure


def bit_search(cn0_db_hz: float = 17.0) -> matplotlib.figure.Figure:
    """Fifty sums, the half plane they are folded to, and the fifty candidates."""
    rng = np.random.default_rng(5)
    amplitude = np.sqrt(10.0 ** (cn0_db_hz / 10.0) * 0.02)
    bits = rng.choice([-1, 1], 50)
    sums = amplitude * bits * np.exp(0.7j) + gps_signals.noise(rng, 50)
    found = search_bits(sums)
    folded = np.where(sums.imag > 0.0, sums, -sums)
    turned = folded[np.argsort(np.angle(folded))]
    totals = np.abs(folded.sum() - 2.0 * (np.cumsum(turned) - turned))
    same = np.sign(found.bits[0] @ bits)
    wrong = found.bits[0] * same != bits
    figure = matplotlib.figure.Figure(figsize=(12.0, 4.2), layout="constrained")
    panels: list[Axes] = list(figure.subplots(1, 3))
    for name, mask, colour in (("bit right", ~wrong, BLUE), ("bit wrong", wrong, RED)):
        panels[0].scatter(sums.real[mask], sums.imag[mask], s=18, color=colour, label=name)
    along = found.total[0] / abs(found.total[0])
    panels[0].axline((0.0, 0.0), (along.real, along.imag), color="black", lw=1.0, label="phase found")
    panels[0].axline((0.0, 0.0), (-along.imag, along.real), color="black", lw=0.8, ls=":")
    panels[0].set(
        title=f"50 sums of 20 ms at {cn0_db_hz:g} dB-Hz", xlabel="in-phase", ylabel="quadrature", aspect="equal"
    )
    panels[0].legend(loc="upper left", fontsize=8)
    panels[1].scatter(folded.real, folded.imag, s=18, c=np.argsort(np.argsort(np.angle(folded))), cmap="viridis")
    panels[1].set(title="folded to a half plane, in order of phase", xlabel="in-phase", aspect="equal")
    panels[2].plot(totals, ".-", color=BLUE, label="total with the first n turned over")
    panels[2].axhline(energy_limit(1e-3, 50), color=RED, lw=1.0, label="noise reaches this once in 1000")
    panels[2].axhline(amplitude * 50.0, color=GREEN, lw=1.0, ls="--", label="with the true bits, no noise")
    panels[2].set(title="fifty candidates", xlabel="n", ylabel="amplitude of the total", ylim=(0.0, None))
    panels[2].legend(loc="lower center", fontsize=8)
    return figure


def deep_errors(duration_s: float = 110.1) -> matplotlib.figure.Figure:
    """One drive through the dense wood: strengths, and errors by how long is summed and whether somebody judges."""
    drive = DeepDrive(1, duration_s, DENSE)
    driven = {
        "1 s, monitored": (drive_through(drive, DeepRules()), BLUE),
        "1 s, monitor off": (drive_through(drive, DeepRules(monitored=False)), RED),
        "20 ms, monitored": (drive_through(drive, DeepRules(bits=1)), GREEN),
    }
    figure = matplotlib.figure.Figure(figsize=(12.0, 5.0), layout="constrained")
    places: dict[str, Axes] = figure.subplot_mosaic([["map", "error"], ["map", "cn0"]], width_ratios=[1.0, 1.5])
    truth = drive.drive.position(np.arange(0.0, duration_s, 0.5))
    places["map"].plot(*truth[:, :2].T, color="black", lw=3.0, alpha=0.25, label="truth")
    for name, (one, colour) in driven.items():
        places["map"].plot(*one.track.position_m[:, :2].T, color=colour, lw=1.0, label=name)
        places["error"].plot(one.track.times_s, np.linalg.norm(one.off_m, axis=1), color=colour, lw=1.2, label=name)
    places["map"].set(aspect="equal", xlabel="east, m", ylabel="north, m", xlim=(-130, 130), ylim=(-130, 130))
    places["map"].legend(loc="center", fontsize=8)
    places["error"].axhline(0.5, color="black", lw=0.8, ls=":")
    places["error"].set(yscale="log", ylabel="error of position, m", title=f"trees from {FROM_S:g} s on")
    places["error"].legend(loc="upper left", fontsize=8)
    _strengths(places["cn0"], driven["1 s, monitored"][0])
    return figure


def _strengths(axes: Axes, one: Driven) -> None:
    for n, prn in enumerate(one.drive.prns):
        strengths = [second[n].cn0_db_hz for second in one.track.heard]
        axes.plot(one.track.times_s, strengths, ".", ms=3.0, label=str(prn))
    axes.set(xlabel="time, s", ylabel="C/N0 of those detected, dB-Hz")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for path in draw(parser.parse_args().folder):
        print(path)
