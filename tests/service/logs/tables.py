"""The drive as tables, as spreadsheets, databases, ROS and people write them: name to what writes it."""

from __future__ import annotations

import csv
import datetime
import io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.service.logs.drive import ANCHORS, BEGIN_S, RANGES, moments, table, write

UTC = datetime.UTC


def moment(second: float, form: str) -> str:
    return datetime.datetime.fromtimestamp(BEGIN_S + second, UTC).strftime(form)


def dated(head: str, form: str, between: str = ",") -> str:
    rows = [f"{moment(t, form)}{between}{a}{between}{r}" for t, a, r in RANGES]
    return "\n".join([head, *rows, ""])


def with_commas(text: str, delimiter: str) -> str:
    return text.replace(",", delimiter).replace(".", ",")


def wide(head: list[str], factor: float = 1.0) -> str:
    file = io.StringIO()
    rows = csv.writer(file)
    rows.writerow(head)
    rows.writerows([t, *(round(factor * r, 2) for r in ranges.values())] for t, ranges in moments())
    return file.getvalue()


def by_numpy(path: Path) -> Path:
    np.savetxt(path, RANGES, delimiter=",", header="time_s,anchor_id,range_m", fmt=["%d", "%d", "%.2f"])
    return path


def one_for_each(path: Path) -> Path:
    path.mkdir()
    for anchor in ANCHORS:
        rows = [f"{t},{r}" for t, a, r in RANGES if a == anchor]
        write(path / f"uwb_anchor{anchor}_run7.csv", "\n".join(["timestamp,distance", *rows]))
    return path


def lines_of_json(path: Path) -> Path:
    epochs = (
        {"time_s": float(t), "ranges": [{"anchor_id": str(a), "range_m": r} for a, r in ranges.items()]}
        for t, ranges in moments()
    )
    return write(path, "\n".join(map(json.dumps, epochs)))


PLAIN = table("time_s,anchor_id,range_m", "{t},{a},{r}")
TEXTS: dict[str, str | bytes] = {
    "as documented": PLAIN,
    "a moment a row": wide(["time_s", *(f"range_m.{a}" for a in ANCHORS)]),
    "semicolons and decimal commas": with_commas(table("time_s,anchor_id,range_m", "{t}.0,{a},{r}"), ";"),
    "tabs, decimal commas, UTF-16": with_commas(PLAIN, "\t").encode("utf-16"),
    "a byte-order mark, comments, more columns": "\ufeff# rover 7\r\n"
    + table("Time,Anchor,RSSI,Range (m)", "{t},{a},-80,{r}", "\r\n"),
    "rostopic echo -p, nanoseconds": table(
        "%time,field.header.seq,field.header.frame_id,field.anchorId,field.tagId,field.range",
        "{ns}{t:02d}000000000,7,uwb,{a},0,{r}",
        ns=round(BEGIN_S) // 100,
    ),
    "seconds and nanoseconds apart": table(
        "header.stamp.secs,header.stamp.nsecs,header.frame_id,anchor_id,distance",
        "{s}{t:02d},0,map,{a},{r}",
        s=round(BEGIN_S) // 100,
    ),
    "milliseconds since 1970, centimetres": "\n".join(
        ["timestamp,beacon_id,dist_cm", *(f"{round(BEGIN_S + t)}000,{a},{100.0 * r:.0f}" for t, a, r in RANGES)]
    ),
    "microseconds in the name": table("TimeUS,dest_addr,range_m,quality", "{t}000000,{a},{r},0.9"),
    "ISO times with a zone": dated("stamp,anchor,range", "%Y-%m-%dT%H:%M:%S+00:00"),
    "German dates": with_commas(dated("Zeit,Anker,Entfernung", "%d/%m/%Y %H:%M:%S"), ";").replace("/", "."),
    "German date and clock apart, centimetres": with_commas(
        "\n".join(
            [
                "Datum,Uhrzeit,Anker,Distanz [cm]",
                *(f"{moment(t, '%d/%m/%Y,%H:%M:%S')},{a},{100.0 * r:.1f}" for t, a, r in RANGES),
            ]
        ),
        ";",
    ).replace("/", "."),
    "American dates": dated("time,station,distance", "%m/%d/%Y %H:%M:%S"),
    "date and clock apart": "\n".join(
        ["date,time,anchor id,Range [m]", *(f"{moment(t, '%Y-%m-%d,%H:%M:%S')},{a},{r}" for t, a, r in RANGES)]
    ),
    "truth and limits beside": table("t,to_id,from_id,range,gt_range,range_std", "{t},{a},9,{r},0.0,0.1"),
    "a column for each anchor": wide(["time", *(f"dist_{a}" for a in ANCHORS)]),
    "a column for each anchor, millimetres": wide(["time_s", *(f"Distance to {a} [mm]" for a in ANCHORS)], 1000.0),
    "d1, d2, d3": wide(["t", *(f"d{a}" for a in ANCHORS)]),
}
TABLES: dict[str, Callable[[Path], Path]] = {
    **{name: lambda path, text=text: write(path.with_suffix(".csv"), text) for name, text in TEXTS.items()},
    "numpy.savetxt": by_numpy,
    "one file for each anchor": one_for_each,
    "lines of JSON": lambda path: lines_of_json(path.with_suffix(".jsonl")),
}
