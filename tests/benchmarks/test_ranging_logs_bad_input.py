"""What is no published log is told in a sentence that says what is taken."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks.detection.ranging_logs import PLACES, main


def place_in(folder: Path, what: str) -> Path:
    if what == "empty folder":
        return folder
    path = folder / ("missing.mat" if what == "nothing" else "text.mat")
    if what == "text":
        path.write_text("no such data\n")
    return path


@pytest.mark.parametrize("what", ["nothing", "empty folder", "text"])
@pytest.mark.parametrize("data", list(PLACES))
def test_a_place_without_the_data_is_told(
    data: str, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place = place_in(tmp_path, what)
    monkeypatch.setattr(sys, "argv", ["ranging_logs", data, str(place), str(tmp_path / "out")])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert PLACES[data] in " ".join(said.split())
    assert str(place) in said
    assert not (tmp_path / "out").exists()
