"""MAVLink: ranges and motion in; position, occlusions, beacon parameters and targets out, by what pymavlink reads."""

from __future__ import annotations

import math
import os
import random

import numpy as np
import pyproj
import pytest
from pymavlink.dialects.v20 import all as dialect

from detection import Detector
from navigation import ConstantVelocityEstimator
from service.errors import RequestError
from service.live.bridges.running import mavlink_bridge, site_of
from terrain import egm96_height_m
from tests.service.bridges.running import ANCHORS, PLACES, SETTINGS, Judge, free_port, rover_m, running, site
from tests.service.bridges.vehicle import BOOT_S, Vehicle, beacons, distances

MIDDLE = {"lon_deg": 10.94, "lat_deg": 46.37, "up_m": 0.0}
EARTH = pyproj.Geod(ellps="WGS84")


def bridge_at(port, judge=None, where=None, ids=None, drones=None, round_s=0.25, **told):
    made = where if where is not None else site(MIDDLE)
    return mavlink_bridge(made, f"tcpin:127.0.0.1:{port}", round_s, judge or Judge(), told, ids or {}, drones or {})


def degrees_of(place_m):
    """(lon, lat) of a place east and north of MIDDLE by the geodesic, without the frame under test."""
    azimuth_deg, way_m = math.degrees(math.atan2(place_m[0], place_m[1])), math.hypot(*place_m[:2])
    return EARTH.fwd(MIDDLE["lon_deg"], MIDDLE["lat_deg"], azimuth_deg, way_m)[:2]


def test_a_position_goes_back_for_each_epoch_of_beacons():
    port, judge = free_port(), Judge()
    where = site(MIDDLE)
    with running(bridge_at(port, judge, where)):
        vehicle = Vehicle(port).connect()
        for second in range(10):
            vehicle.send(*beacons(second))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 10 and vehicle.count("HEARTBEAT"))
        vehicle.close()
    east_m, north_m, up_m = where.origin.at_m
    for second, told in enumerate(vehicle.told["VISION_POSITION_ESTIMATE"]):
        at_m = rover_m(second)
        assert told.usec == round(1e6 * (BOOT_S + second))
        assert math.hypot(told.x - (at_m[1] - north_m), told.y - (at_m[0] - east_m)) < 0.5
        assert told.z == pytest.approx(up_m - at_m[2], abs=1.0)
        variances = np.array(told.covariance)[[0, 6, 11]]
        assert (variances > 0.0).all()
        assert (variances < 1.0).all()
        assert math.isnan(told.covariance[20])
    assert all(len(asked.epoch.ranges) == 6 for asked, _ in judge.epochs)


def test_the_place_of_a_filter_goes_back_where_one_goes_along():
    port, judge = free_port(), Judge()
    where = site(MIDDLE, estimator=ConstantVelocityEstimator(ANCHORS, SETTINGS))
    with running(bridge_at(port, judge, where)):
        vehicle = Vehicle(port).connect()
        for second in range(10):
            # the last rounds are of two beacons, which allow no position of their own
            vehicle.send(*beacons(second)[: None if second < 8 else 2])
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 10)
        vehicle.close()
    detector, fresh = Detector(ANCHORS, SETTINGS), ConstantVelocityEstimator(ANCHORS, SETTINGS)
    for (asked, _), told in zip(judge.epochs, vehicle.told["VISION_POSITION_ESTIMATE"], strict=True):
        alone = fresh.step(asked.epoch, detector.process(asked.epoch), detector.motion)
        assert alone is not None
        off_m = np.array([told.y, told.x, -told.z]) - (alone.position_m - where.origin.at_m)
        assert np.abs(off_m).max() < 0.01
        assert told.covariance[0] == pytest.approx(alone.covariance[1, 1], rel=1e-3)


def test_an_occlusion_is_told_once_in_words():
    port = free_port()
    with running(bridge_at(port)):
        vehicle = Vehicle(port).connect()
        for second in range(20):
            vehicle.send(*beacons(second, hidden=("4",) if second >= 8 else ()))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 20)
        vehicle.close()
    (text,) = (told for told in vehicle.told["STATUSTEXT"] if told.text.startswith("4 "))
    assert text.severity == dialect.MAV_SEVERITY_WARNING
    assert text.text.startswith("4 occluded +")
    assert float(text.text.split()[2]) == pytest.approx(6.0, abs=0.5)


def test_ranges_of_distance_sensors_are_taken_until_beacons_come():
    port, judge = free_port(), Judge()
    with running(bridge_at(port, judge)):
        vehicle = Vehicle(port).connect()
        altimeter = dialect.MAVLink_distance_sensor_message(1, 10, 5000, 321, 0, 9, 25, 255)
        for second in range(3):
            vehicle.send(altimeter, *distances(second))
        for second in range(3, 6):
            vehicle.send(*distances(second), *beacons(second))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") >= 6)
        vehicle.close()
    used = [(asked.key, len(result.verdicts)) for asked, result in judge.epochs if result.rejection is None]
    assert [ranges for _, ranges in used] == [6] * 6
    assert [key for key, _ in used] == pytest.approx([BOOT_S + second for second in range(6)])


def test_motion_comes_from_the_best_message_that_is_sent():
    port, judge = free_port(), Judge()
    with running(bridge_at(port, judge)):
        vehicle = Vehicle(port).connect()
        for second in range(8):
            boot_ms = round(1000.0 * (BOOT_S + second))
            north_m, east_m = 5.0 * second, 5.0 * second
            vehicle.send(dialect.MAVLink_local_position_ned_message(boot_ms, north_m, east_m, 0.0, 0.0, 0.0, 0.0))
            vehicle.send(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, math.radians(90.0), 0.0, 0.0, 0.0))
            if second >= 4:
                ways_m = [1.0 * second, 1.2 * second, *14 * [0.0]]
                vehicle.send(dialect.MAVLink_wheel_distance_message(1000 * boot_ms, 2, ways_m))
            vehicle.send(*beacons(second))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 8)
        vehicle.close()
    motions = [asked.epoch.odometry for asked, _ in judge.epochs]
    assert motions[0] is None
    for motion in motions[1:4]:
        assert motion.duration_s == pytest.approx(1.0)
        assert math.hypot(*motion.wheel_m) == pytest.approx(math.hypot(5.0, 5.0))
        assert motion.heading_rad == pytest.approx(math.radians(45.0))
    for motion in motions[5:]:
        assert math.hypot(*motion.wheel_m) == pytest.approx(1.1)
        assert motion.heading_rad == pytest.approx(math.radians(90.0))


def test_beacon_parameters_are_sent_until_the_vehicle_says_it_has_them():
    port = free_port()
    where = site(MIDDLE)
    with running(bridge_at(port, where=where, beacons=True, origin=True)):
        vehicle = Vehicle(port).connect()
        vehicle.until(lambda: vehicle.count("HEARTBEAT") >= 2)
        assert not {"PARAM_SET", "SET_GPS_GLOBAL_ORIGIN"} & vehicle.told.keys(), "nobody is there yet"
        vehicle.send(dialect.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3))
        vehicle.until(lambda: vehicle.count("PARAM_SET") >= 8)  # nothing was confirmed, so they come again
        origin = vehicle.told["SET_GPS_GLOBAL_ORIGIN"][0]
        vehicle.send(dialect.MAVLink_gps_global_origin_message(origin.latitude, origin.longitude, origin.altitude))
        wanted = {told.param_id: told.param_value for told in vehicle.told["PARAM_SET"]}
        for name, value in wanted.items():
            vehicle.send(dialect.MAVLink_param_value_message(name.encode(), value, 9, 4, 0))
        beats = vehicle.count("HEARTBEAT")
        vehicle.until(lambda: vehicle.count("HEARTBEAT") > beats + 1)
        before = vehicle.count("PARAM_SET"), vehicle.count("SET_GPS_GLOBAL_ORIGIN")
        vehicle.until(lambda: vehicle.count("HEARTBEAT") > beats + 3)
        vehicle.close()
    assert (vehicle.count("PARAM_SET"), vehicle.count("SET_GPS_GLOBAL_ORIGIN")) == before
    assert wanted["BCN_ORIENT_YAW"] == 0.0
    # what 32 bits hold is what offsets are counted from
    assert (wanted["BCN_LATITUDE"], wanted["BCN_LONGITUDE"]) == (where.origin.lat_deg, where.origin.lon_deg)
    assert origin.latitude == round(1e7 * wanted["BCN_LATITUDE"])


def test_a_position_goes_out_as_gps_above_the_sea():
    port = free_port()
    geoid_m = float(egm96_height_m([MIDDLE["lon_deg"]], [MIDDLE["lat_deg"]])[0])
    assert geoid_m > 40.0
    with running(bridge_at(port, where=site(MIDDLE, datum="hae"), position="gps")):
        vehicle = Vehicle(port).connect()
        vehicle.send(*beacons(0))
        vehicle.until(lambda: vehicle.count("GPS_INPUT") == 1)
        vehicle.close()
    (told,) = vehicle.told["GPS_INPUT"]
    lon_deg, lat_deg = degrees_of(rover_m(0))
    assert EARTH.inv(1e-7 * told.lon, 1e-7 * told.lat, lon_deg, lat_deg)[2] < 0.5
    assert told.alt == pytest.approx(rover_m(0)[2] - geoid_m, abs=1.0)
    assert 0.0 < told.horiz_accuracy < 1.0
    assert told.fix_type == 3


def test_anchors_are_shown_as_targets():
    port = free_port()
    with running(bridge_at(port, targets=True)):
        vehicle = Vehicle(port).connect()
        vehicle.until(lambda: vehicle.count("ADSB_VEHICLE") >= 6)
        vehicle.close()
    targets = {told.callsign: told for told in vehicle.told["ADSB_VEHICLE"]}
    assert targets.keys() == PLACES.keys()
    assert len({told.ICAO_address for told in targets.values()}) == 6
    for name, told in targets.items():
        assert EARTH.inv(1e-7 * told.lon, 1e-7 * told.lat, *degrees_of(PLACES[name]))[2] < 0.05
        assert 1e-3 * told.altitude == pytest.approx(PLACES[name][2], abs=0.01)


@pytest.mark.parametrize("way", ["a drone says where it is", "a beacon says where it is"])
def test_an_anchor_that_flies_is_followed(way):
    port, judge = free_port(), Judge()
    moved_m = (PLACES["4"][0] + 40.0, PLACES["4"][1] - 30.0, PLACES["4"][2])
    with running(bridge_at(port, judge, drones={44: "4"})):
        vehicle = Vehicle(port).connect()
        vehicle.send(*beacons(0))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 1)
        lon_deg, lat_deg = degrees_of(moved_m)
        if way == "a drone says where it is":
            drone = Vehicle(port, system=44).connect()
            millimetres = round(1000.0 * moved_m[2])
            drone.send(
                dialect.MAVLink_global_position_int_message(
                    1, round(1e7 * lat_deg), round(1e7 * lon_deg), millimetres, 0, 0, 0, 0, 0
                )
            )
            vehicle.until(lambda: drone.hear() or True)
            drone.close()
            vehicle.send(*beacons(1))
        else:
            told = {name: (*degrees_of(place), place[2]) for name, place in PLACES.items()}
            vehicle.send(*beacons(1, places={**told, "4": (lon_deg, lat_deg, moved_m[2])}))
        vehicle.until(lambda: len(judge.epochs) == 2)
        vehicle.close()
    (anchor,) = judge.epochs[1][0].epoch.moved
    assert anchor.id == "4"
    assert math.dist((anchor.east_m, anchor.north_m, anchor.altitude_m), moved_m) < 0.1


def answered_by(vehicle, before):
    """The seconds before, and those whose position came since."""
    before.update(round(1e-6 * told.usec - BOOT_S) for told in vehicle.told.pop("VISION_POSITION_ESTIMATE", ()))
    return before


def drive(port, count, cuts):
    """A vehicle that sends each epoch once, and again only after a cut; broken bytes before every fifth.

    Returns the seconds that were answered, those that were cut, broken bytes of the others, and of all.
    """
    draw = random.Random(7)
    cut_after = set(draw.sample(range(1, count), cuts))
    vehicle = Vehicle(port).connect()
    answered, whole_bad, bad = set(), 0, 0
    for second in range(count):
        again = second in cut_after
        data = vehicle.packed(*beacons(second, hidden=("4",) if second % 60 > 40 else ()))
        garbage = draw.randbytes(draw.randrange(1, 80)) if second % 5 == 0 else b""
        bad += len(garbage)
        if again:
            vehicle.line.sendall((garbage + data)[: draw.choice([len(data) // 2, len(data)])])
            vehicle.close()
            vehicle.connect()
            vehicle.line.sendall(data)
        else:
            whole_bad += len(garbage)
            vehicle.line.sendall(garbage + data)
        vehicle.until(lambda second=second: second in answered_by(vehicle, answered))
    vehicle.close()
    return answered, cut_after, whole_bad, bad


def test_nothing_is_lost_while_the_link_is_cut_and_garbled():
    """SIGHTLINE_LINK_EPOCHS=3600 makes it an hour at an epoch a second, with 20 cuts."""
    port, judge, count = free_port(), Judge(), int(os.environ.get("SIGHTLINE_LINK_EPOCHS", "300"))
    cuts = max(5, count // 180)
    bridge = bridge_at(port, judge)
    with running(bridge):
        answered, cut, whole_bad, bad = drive(port, count, cuts)
    assert bridge.link_counts.cuts == 0, "a listener lasts while connections end"
    assert len(cut) == cuts
    assert answered == set(range(count))
    used = {round(asked.key - BOOT_S): len(got.verdicts) for asked, got in judge.epochs if got.rejection is None}
    assert used.keys() == answered
    assert {second for second, ranges in used.items() if ranges != 6} <= cut
    assert whole_bad <= bridge.bad <= bad
    assert bridge.counts.lost == bridge.link_counts.unsent == 0


def test_an_anchor_that_is_none_is_refused():
    with pytest.raises(RequestError, match="There is no anchor 'D9'"):
        bridge_at(free_port(), ids={"7": "D9"})


def test_anchors_of_nowhere_send_positions_alone():
    port = free_port()
    nowhere = site_of(ANCHORS, SETTINGS, None, None, None, None)
    assert "north is taken for true north" in nowhere.told[0]
    with running(bridge_at(port, where=nowhere, targets=True, beacons=True, origin=True)):
        vehicle = Vehicle(port).connect()
        vehicle.send(*beacons(0))
        vehicle.until(lambda: vehicle.count("VISION_POSITION_ESTIMATE") == 1 and vehicle.count("HEARTBEAT") > 1)
        vehicle.close()
    assert not {"ADSB_VEHICLE", "PARAM_SET", "SET_GPS_GLOBAL_ORIGIN"} & vehicle.told.keys()
