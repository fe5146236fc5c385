"""A CRS is taken as a code, WKT, PROJJSON or a plain PROJ string, and never makes PROJ or GDAL open a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest

from planning.errors import AreaError
from planning.questions.problems import _check_crs
from terrain import DemUnsupportedError, ElevationGrid, ElevationGridError, FrameError, parse_crs, read_dem
from tests.terrain.files import hill, sentences, write_asc, write_tif

UTM = (
    'PROJCS["x",GEOGCS["g",DATUM["d",SPHEROID["intl",6378388,297]{datum}],PRIMEM["Greenwich",0],'
    'UNIT["degree",0.0174532925199433]],PROJECTION["{method}"],PARAMETER["latitude_of_origin",0],'
    'PARAMETER["central_meridian",-81],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],'
    'PARAMETER["false_northing",0],UNIT["metre",1]{end}]'
)


def utm(end: str = "", datum: str = "", method: str = "Transverse_Mercator") -> str:
    return UTM.format(end=end, datum=datum, method=method)


def in_degrees(remark: str) -> str:
    return (
        'GEOGCRS["x",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],'
        f'AXIS["lat",north],AXIS["lon",east],ANGLEUNIT["degree",0.0174532925199433],REMARK["{remark}"]]'
    )


def init_file(folder: Path) -> Path:
    """A file of definitions as +init opens it; that it serves shows that the refusals are of its use."""
    path = folder / "maps"
    path.write_text("<here> +proj=utm +zone=32 +ellps=intl +units=m no_defs <>\n")
    return path


ROTATED = pyproj.CRS("+proj=ob_tran +o_proj=longlat +o_lon_p=0 +o_lat_p=40 +lon_0=10 +type=crs").to_wkt()
GRIDDED = pyproj.CRS("+proj=utm +zone=32 +ellps=intl +nadgrids=GIVEN +type=crs")
WAYS_TO_A_FILE = {
    "init": "+init=GIVEN:here",
    "init without plus": "init=GIVEN:here",
    "init among others": "+proj=utm +zone=32 +init=GIVEN:here",
    "glued": "+proj=utm+init=GIVEN:here",
    "quoted": '+proj=utm "+init=GIVEN:here"',
    "nadgrids": "+proj=utm +zone=32 +ellps=intl +nadgrids=GIVEN",
    "lines": "+proj=utm\n+zone=32\t+nadgrids=GIVEN",
    "geoidgrids": "+proj=utm +zone=32 +geoidgrids=GIVEN",
    "pipeline": "+proj=pipeline +step +init=GIVEN:here",
    "file": "+proj=tinshift +file=GIVEN",
    "grids": "+proj=hgridshift +grids=GIVEN",
    "datum": "+proj=utm +zone=32 +datum=GIVEN",
    "path": "GIVEN",
    "at": "@GIVEN",
    "file URL": "file:GIVEN",
    "URL": "https://example.org/crs",
    "URN": "urn:ogc:def:crs:EPSG::GIVEN",
    "dictionary": {"proj": "utm", "zone": 32, "nadgrids": "GIVEN"},
    "extension with grids": utm(',EXTENSION["PROJ4","+proj=utm +zone=32 +nadgrids=GIVEN +wktext"]'),
    "extension with init": utm(',EXTENSION["PROJ4","+init=GIVEN:here"]'),
    "extension alone": utm(',EXTENSION["PROJ4","+init=GIVEN:here"]', method="custom_proj4"),
    "grids of a datum": utm(datum=',EXTENSION["PROJ4_GRIDS","GIVEN"]'),
    "parameter file": GRIDDED.to_wkt(),
    "remark": in_degrees("PROJ CRS string: +init=GIVEN:here"),
    "method": ROTATED.replace("o_proj=longlat", "o_proj=longlat grids=GIVEN"),
    "another method": ROTATED.replace("PROJ ob_tran o_proj=longlat", "PROJ hgridshift grids=GIVEN"),
    "PROJJSON parameter file": GRIDDED.to_json(),
    "PROJJSON remark": json.dumps(pyproj.CRS(32632).to_json_dict() | {"remarks": "PROJ CRS string: +init=GIVEN:here"}),
    "object": GRIDDED,
}
WKT1_WAYS = ("extension with grids", "extension with init", "extension alone", "grids of a datum")


@pytest.mark.parametrize("way", WAYS_TO_A_FILE.values(), ids=WAYS_TO_A_FILE.keys())
def test_no_way_of_writing_a_crs_leads_to_a_file(tmp_path: Path, way: Any) -> None:
    path = str(init_file(tmp_path))
    if isinstance(way, str):
        way = way.replace("GIVEN", path)
    elif isinstance(way, dict):
        way = {key: path if value == "GIVEN" else value for key, value in way.items()}
    with pytest.raises(FrameError, match=r"not taken|is not known|needs the file") as caught:
        parse_crs(way)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    ["", "here", "EPSG:4326\0", "\udcff", "[" * 9000, '{"a":' * 3000, "+" * 300_000, None, 1.5, b"EPSG:4326", []],
)
def test_what_is_no_crs_is_refused_in_a_sentence(text: Any) -> None:
    with pytest.raises(FrameError, match="give an EPSG code"):
        parse_crs(text)


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ("EPSG:32632", 32632), (32632, 32632), ("epsg:32632", 32632), (("EPSG", 32632), 32632),
        ("urn:ogc:def:crs:EPSG::32632", 32632), ("http://www.opengis.net/def/crs/EPSG/0/32632", 32632),
        ("+init=epsg:32632", 32632), (pyproj.CRS(32632), 32632), (pyproj.CRS(32632).to_wkt("WKT1_GDAL"), 32632),
        (pyproj.CRS(32632).to_json_dict(), 32632), (pyproj.CRS(3857).to_wkt("WKT1_GDAL"), 3857),
        ("+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +lon_0=0 +x_0=0 +y_0=0 +k=1 +nadgrids=@null +wktext", 3857),
        ("+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs", 32632),
        ({"proj": "utm", "zone": 32, "datum": "WGS84"}, 32632),
    ],
)  # fmt: skip
def test_every_plain_way_of_writing_a_crs_is_taken(given: Any, code: int) -> None:
    assert parse_crs(given).to_epsg(min_confidence=20) == code


def test_a_geoid_model_of_the_heights_is_left_out() -> None:
    crs = parse_crs("COMPD_CS[\"c\"," + pyproj.CRS(32632).to_wkt("WKT1_GDAL") + ',VERT_CS["v",VERT_DATUM["v",2005,'
                    'EXTENSION["PROJ4_GRIDS","/etc/passwd"]],UNIT["metre",1],AXIS["Up",UP]]]')  # fmt: skip
    assert crs.sub_crs_list[0].to_epsg() == 32632
    assert "/etc/passwd" not in crs.to_json()


def test_every_reader_takes_a_crs_through_the_same_check(tmp_path: Path) -> None:
    text = f"+init={init_file(tmp_path)}:here"
    with pytest.warns(FutureWarning):
        assert pyproj.CRS(text).is_projected, "PROJ itself opens it"
    dem = write_tif(tmp_path / "dem.tif", hill())
    for options in ({"crs": text}, {"target_crs": text}):
        with pytest.raises(FrameError, match="may make PROJ open a file"):
            read_dem(dem, **options)
    with pytest.raises(ElevationGridError, match="may make PROJ open a file"):
        ElevationGrid(hill(), 1.0, 1.0, crs=text)
    with pytest.raises(AreaError, match="is not known"):
        _check_crs(ElevationGrid(hill(), 1.0, 1.0, crs=32632), text)
    np.savez(tmp_path / "dem.npz", heights_m=hill(), cell_east_m=1.0, cell_north_m=1.0, crs_wkt=text)
    with pytest.raises(FrameError, match="may make PROJ open a file"):
        read_dem(tmp_path / "dem.npz")


@pytest.mark.parametrize("way", WKT1_WAYS)
def test_a_prj_that_names_a_file_is_told_before_gdal_reads_it(tmp_path: Path, way: str) -> None:
    dem = write_asc(tmp_path / "dem.asc", hill())
    (tmp_path / "dem.prj").write_text(str(WAYS_TO_A_FILE[way]).replace("GIVEN", "/dev/full"))
    with pytest.raises(DemUnsupportedError, match=r"not read because of dem.prj beside it.*PROJ open a file"):
        read_dem(dem)


@pytest.mark.parametrize("way", [*WKT1_WAYS, "none"])
def test_a_geotiff_whose_esri_text_names_a_file_is_told_before_gdal_reads_it(tmp_path: Path, way: str) -> None:
    text = utm() if way == "none" else WAYS_TO_A_FILE[way]
    esri = "ESRI PE String = " + str(text).replace("GIVEN", "/dev/full")
    dem = write_tif(tmp_path / "dem.tif", hill(), crs=utm().replace('["x"', f'["{"N" * len(esri)}"'))
    model, citation = bytes([0, 4, 0, 0, 1, 0, 1, 0]), bytes([2, 4, 0xB1, 0x87])
    content = dem.read_bytes()
    assert (content.count(model), content.count(citation)) == (1, 1)
    content = content.replace(b"N" * len(esri), esri.encode())
    content = content.replace(model, bytes([0, 4, 0, 0, 1, 0, 0xFF, 0x7F])).replace(
        citation, bytes([1, 12, 0xB1, 0x87])
    )
    dem.write_bytes(content)
    if way == "none":
        grid = read_dem(dem)
        assert grid.crs is not None
        assert grid.crs.name == "x", "GDAL takes the CRS from that text"
        return
    with pytest.raises(DemUnsupportedError, match="not read because of its CRS"):
        read_dem(dem)


def test_a_crs_that_only_pyproj_objects_to_is_left_out_with_the_reason(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), crs=utm().replace('["x"', '["+proj=x +grids=y"')))
    assert grid.crs is None
    assert "The file's CRS was left out" in sentences(*grid.provenance.warnings)
