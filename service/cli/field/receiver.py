"""``sightline receiver``: satellites in recorded samples of a front end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from cyclopts import App
from rich.table import Table

from service.errors import RequestError

from ..asking.options import option
from ..asking.recordings import SampleFile, SampleOptions, satellite_numbers
from ..output import print_json, print_tables, print_warnings
from .receiver_track import track

if TYPE_CHECKING:
    from gnss.receiver import Acquisition, Samples

__all__ = ["receiver"]

receiver = App(name="receiver", help="An open-loop receiver of GPS L1 C/A over recorded samples.")
receiver.command(track)
AsJson = Annotated[bool, option("Print JSON on standard output and nothing else.", name="--json")]


@receiver.command
def acquire(
    path: SampleFile,
    /,
    *,
    samples: SampleOptions,
    prn: Annotated[str | None, option("Satellites to look for. (default 1 to 32)", "N,N,…")] = None,
    ms: Annotated[int, option("Milliseconds that are searched.", "MS")] = 4,
    coherent: Annotated[int, option("Of these, summed with their phase at a time.", "MS")] = 1,
    doppler_max: Annotated[float, option("The largest Doppler.", "HZ")] = 5000.0,
    doppler_step: Annotated[float, option("From Doppler to Doppler.", "HZ")] = 250.0,
    false_alarm: Annotated[float, option("Probability that noise is taken for one satellite.", "P")] = 1e-3,
    as_json: AsJson = False,
) -> None:
    """Look for satellites in recorded samples: Doppler, where the code begins, C/N0.

    Exit code 2 where no satellite is above the threshold.
    """
    from gnss.receiver import PRNS, Search, acquire

    search = Search(doppler_max, doppler_step, coherent, 0.0, ms * 1e-3, false_alarm)
    read = samples.read(path, search.duration_s)
    found = acquire(read, search, PRNS if prn is None else satellite_numbers(prn))
    if as_json:
        print_json(_document(read, search.false_alarm, found))
    else:
        print_tables(*([_table(read, found)] if found.found else []))
        print_warnings(list(read.warnings))
    if not found.found:
        best = found.satellites[0]
        raise RequestError(
            f"No satellite of {len(found.satellites)} is above the threshold; the highest, PRN {best.prn}, has "
            f"{best.power:.1f} times the power of noise, {found.limit:.1f} are needed. Are rate and type right?"
        )


def _document(samples: Samples, false_alarm: float, found: Acquisition) -> dict[str, object]:
    return {
        "source": samples.source,
        "rate_hz": samples.rate_hz,
        "intermediate_hz": samples.intermediate_hz,
        "coherent_s": found.coherent_s,
        "sums": found.sums,
        "false_alarm": false_alarm,
        "threshold": found.limit,
        "satellites": [
            {
                "prn": one.prn,
                "found": one.found,
                "doppler_hz": one.doppler_hz,
                "code_start_sample": one.code_start_sample,
                "power_over_noise": one.power,
                "cn0_db_hz": one.cn0_db_hz if math.isfinite(one.cn0_db_hz) else None,
            }
            for one in found.satellites
        ],
        "warnings": list(samples.warnings),
    }


def _table(samples: Samples, found: Acquisition) -> Table:
    coherent = f"{found.sums} sums of {1e3 * found.coherent_s:g} ms"
    table = Table(title=f"{samples.source}: {coherent}, threshold {found.limit:.1f} over noise", title_justify="left")
    for column in ("PRN", "Doppler Hz", "code begins at sample", "over noise", "C/N0 dB-Hz"):
        table.add_column(column, justify="right")
    for one in found.found:
        numbers = f"{one.doppler_hz:+.0f}", str(one.code_start_sample), f"{one.power:.1f}", f"{one.cn0_db_hz:.1f}"
        table.add_row(str(one.prn), *numbers)
    return table
