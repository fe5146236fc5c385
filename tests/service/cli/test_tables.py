"""Tables as spreadsheets write them are read alike for anchors, paths and tracks."""

import pytest

from service.cli.asking.anchor_files import anchors_from_file, tracks_from_file
from service.cli.asking.path_files import path_from_file
from service.errors import RequestError
from service.parts.anchors import AnchorIn

D1 = AnchorIn(id="D1", lon_deg=10.8979428, lat_deg=46.3618217, above_ground_m=50.0)
HEADER = ("id", "lon_deg", "lat_deg", "above_ground_m")


def file(tmp_path, text, name="a.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


@pytest.mark.parametrize(
    "text",
    [
        "id;lon_deg;lat_deg;above_ground_m\nD1;10,8979428;46,3618217;50\n",
        "id\tlon_deg\tlat_deg\tabove_ground_m\nD1\t10.8979428\t46.3618217\t50\n",
        'id,lon_deg,lat_deg,above_ground_m\nD1,"10,8979428","46,3618217",50\n',
        '"id","lon_deg","lat_deg","above_ground_m"\n"D1","10.8979428","46.3618217","50"\n',
        "\ufeffid;lon_deg;lat_deg;above_ground_m;\r\nD1;10.8979428;46.3618217;50;\r\n;;;;\r\n",
        "# surveyed today\n\nid, lon_deg, lat_deg, above_ground_m\nD1, 10.8979428, 46.3618217, 50\n",
        '"id";"lon_deg";"lat_deg";"above_ground_m"\n"D1";"10,8979428";"46,3618217";"5,0e1"\n',
    ],
)
def test_separators_decimal_commas_quotes_and_marks_are_understood(tmp_path, text):
    assert anchors_from_file(file(tmp_path, text)) == [D1]


def test_a_table_in_utf_16_is_understood(tmp_path):
    (tmp_path / "a.csv").write_bytes(
        "id\tlon_deg\tlat_deg\tabove_ground_m\nD1\t10,8979428\t46,3618217\t50\n".encode("utf-16")
    )
    assert anchors_from_file(tmp_path / "a.csv") == [D1]


def test_an_id_that_begins_like_a_comment_is_an_anchor(tmp_path):
    path = file(tmp_path, "# surveyed\nid,east_m,north_m,altitude_m\n#1,1,2,3\n")
    assert [anchor.id for anchor in anchors_from_file(path)] == ["#1"]


def test_a_point_in_an_id_is_no_decimal_point(tmp_path):
    (anchor,) = anchors_from_file(file(tmp_path, "id;east_m;north_m;altitude_m\n1.5;0,5;2,25;3,0\n"))
    assert (anchor.id, anchor.east_m, anchor.north_m, anchor.altitude_m) == ("1.5", 0.5, 2.25, 3.0)


def test_paths_and_tracks_are_read_in_the_same_way(tmp_path):
    (point,) = path_from_file(file(tmp_path, "east_m;north_m;altitude_m\n1,5;2;3\n"), 1.5)
    assert (point.east_m, point.north_m, point.altitude_m) == (1.5, 2.0, 3.0)
    (track,) = tracks_from_file(file(tmp_path, "id;time_s;east_m;north_m;altitude_m\nD1;0;1,5;2;3\nD1;0,5;2,5;2;3\n"))
    assert [(at.time_s, at.east_m) for at in track.points] == [(0.0, 1.5), (0.5, 2.5)]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("id;east_m;north_m;altitude_m\nD1;1.5;2,5;3\n", "decimal commas .* and decimal points"),
        ("id;east_m;north_m;altitude_m\nD1;1.234,5;2;3\n", "'1.234,5', not a number"),
        ('id,east_m,north_m,altitude_m\nD1,"1,234",2,3\n', "'1,234', not a number"),
        ("id;east_m;north_m;altitude_m;east_m\n", "the column 'east_m' twice"),
        ("id;x;north_m;altitude_m;east_m\n", "the column 'east_m' twice"),
        ("id;east_m\nD1;1;2\n", "line 2: more cells than columns"),
        ("# a\nid;east_m\n\nD1;1;2\n", "line 4: more cells than columns"),
    ],
)
def test_what_a_cell_means_is_never_guessed(tmp_path, text, sentence):
    with pytest.raises(RequestError, match=sentence):
        anchors_from_file(file(tmp_path, text))
