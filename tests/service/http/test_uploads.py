"""What clients send as an upload: names in any alphabet, and odd headers."""

from __future__ import annotations

import pytest

from service.http.bodies import clean_name
from tests.service.running import Server

FILE_SYSTEMS_LIMIT_BYTES = 255


@pytest.mark.parametrize("letter", ["a", "é", "地", "𠀀"])
@pytest.mark.parametrize("suffix", [".tif", ".", "", ".地" * 80])
def test_a_cleaned_name_fits_into_any_file_system_and_keeps_a_short_suffix(letter: str, suffix: str) -> None:
    name = clean_name(letter * 250 + suffix)
    assert 0 < len(name.encode()) <= FILE_SYSTEMS_LIMIT_BYTES
    assert name.startswith(letter) or len(suffix) > 4
    assert name.endswith(".tif") or suffix != ".tif"


def test_a_long_name_in_another_alphabet_is_no_fault(server: Server) -> None:
    answer = server.client.post("/dems", params={"filename": "地" * 100 + ".tif"}, content=b"no raster")
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/dem-format"


@pytest.mark.parametrize("content_type", [b"\xff", b"multipart/form-data; boundary=" + b"x" * 5000])
def test_an_odd_content_type_is_no_fault(server: Server, content_type: bytes) -> None:
    answer = server.client.post("/dems", headers={b"Content-Type": content_type}, content=b"no raster")
    assert answer.status_code == 422
