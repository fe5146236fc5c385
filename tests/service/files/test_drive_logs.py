"""Logs of drives: tables by their columns, messages by their kinds, units and axes that they tell."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as dialect

from service.errors import RequestError
from service.files.drives.reading import read_drive
from service.files.logs.form import PLAIN
from tests.service.logs.recorded import telemetry, ulog

IMU = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z\n0,0.1,0.2,9.8,0.01,0.02,0.03\n0.1,0.1,0.2,9.7,0.01,0.02,0.04\n"
GNSS = "time_s,lat_deg,lon_deg,altitude_m,ve,vn,vu,hacc\n0,34.1,-118.2,500,1,2,0.5,2.5\n1,,,,,,,\n"
RANGES = "time_s,anchor_id,range_m\n0.05,D1,120.5\n0.06,D2,nan\n"


def written(folder, **texts):
    paths = []
    for name, text in texts.items():
        paths.append(folder / f"{name}.csv")
        paths[-1].write_text(text)
    return paths


def test_tables_of_one_drive_are_put_together(tmp_path):
    rows = read_drive(written(tmp_path, imu=IMU, gnss=GNSS, ranges=RANGES), PLAIN)
    assert rows.times_s == [0.0, 0.1]
    assert rows.forces == [(0.1, 0.2, 9.8), (0.1, 0.2, 9.7)]
    assert rows.rates[1] == (0.01, 0.02, 0.04)
    assert rows.fixes == [
        {
            "time_s": 0.0,
            "lon_deg": -118.2,
            "lat_deg": 34.1,
            "altitude_m": 500.0,
            "velocity_m_per_s": [1.0, 2.0, 0.5],
            "horizontal_sigma_m": 2.5,
        }
    ]
    assert rows.ranges == [{"time_s": 0.05, "anchor_id": "D1", "range_m": 120.5}]
    assert "Ranges that failed were passed over: 1." in rows.told
    assert read_drive([tmp_path], PLAIN).forces == rows.forces


@pytest.mark.parametrize(
    ("head", "units"),
    [
        (
            "stamp_ms,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z,wx,wy,wz",
            (None, None),
        ),
        ("Timestamp,Accel X (g),Accel Y (g),Accel Z (g),Gyro X (deg/s),Gyro Y (deg/s),Gyro Z (deg/s)", ("g", "deg/s")),
        ("t,ax_g,ay_g,az_g,wx_dps,wy_dps,wz_dps", ("g", "deg/s")),
        ("time,f_x,f_y,f_z,g_x,g_y,g_z", (None, None)),
        ("time,acc.x,acc.y,acc.z,gyr.x,gyr.y,gyr.z", (None, None)),
    ],
)
def test_columns_of_other_names_are_recognised_with_their_units(tmp_path, head, units):
    rows = read_drive(written(tmp_path, imu=f"{head}\n0,1,2,3,4,5,6\n1,1,2,3,4,5,7\n"), PLAIN)
    assert rows.forces[0] == (1.0, 2.0, 3.0)
    assert rows.rates[1] == (4.0, 5.0, 7.0)
    assert (rows.force_unit, rows.rate_unit) == units
    assert any("taken for forces are" in told for told in rows.told)


def test_what_holds_no_inertial_readings_is_refused(tmp_path):
    with pytest.raises(RequestError, match="three columns of forces and three of turn rates"):
        read_drive(written(tmp_path, gnss=GNSS), PLAIN)
    with pytest.raises(RequestError, match=r"no three columns of turn rates, such as gyro_x"):
        read_drive(written(tmp_path, imu="time_s,acc_x,acc_y,acc_z\n0,0,0,9.8\n"), PLAIN)
    with pytest.raises(RequestError, match=r"imu\.csv, line 3: gyro_z is 'much', not a number"):
        read_drive(written(tmp_path, imu=IMU.replace("0.04", "much")), PLAIN)
    with pytest.raises(RequestError, match="has no column of times"):
        read_drive(written(tmp_path, imu=IMU.replace("time_s", "frame")), PLAIN)


def test_telemetry_in_thousandths_of_g_and_centimetres_comes_to_si(tmp_path):
    messages = []
    for second in range(3):
        messages.append((second, dialect.MAVLink_scaled_imu_message(0, 20, -10, -1000, 5, 6, -7, 0, 0, 0)))
        fix = {"h_acc": 1500, "v_acc": 3000}
        gps = dialect.MAVLink_gps_raw_int_message(
            0, 3, 341000000, -1182000000, 500000, 100, 100, 300, 9000, 9, h_acc=fix["h_acc"], v_acc=fix["v_acc"]
        )
        messages.append((second, gps))
    rows = read_drive([telemetry(tmp_path / "log", *messages)], PLAIN)
    assert rows.axes == "frd"
    np.testing.assert_allclose(rows.forces[0], np.array([20, -10, -1000]) * 9.80665e-3)
    np.testing.assert_allclose(rows.rates[0], [5e-3, 6e-3, -7e-3])
    fix = rows.fixes[0]
    assert (fix["lat_deg"], fix["lon_deg"], fix["altitude_m"]) == pytest.approx((34.1, -118.2, 500.0))
    assert (fix["horizontal_sigma_m"], fix["vertical_sigma_m"]) == pytest.approx((1.5, 3.0))
    # 3 m/s towards 90°
    assert fix["velocity_m_per_s"] == pytest.approx([3.0, 0.0, 0.0], abs=1e-9)


def test_a_ulog_has_readings_and_fixes_of_px4(tmp_path):
    forms = {
        "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        "sensor_gps": "uint64_t timestamp;double latitude_deg;double longitude_deg;double altitude_msl_m;float eph;"
        "float epv;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;",
    }
    readings = [
        {"timestamp": 10**6 * t, **{f"gyro_rad[{i}]": 0.5 * i for i in range(3)},
         **{f"accelerometer_m_s2[{i}]": (0.0, 0.25, -9.75)[i] for i in range(3)}}
        for t in range(3)
    ]  # fmt: skip
    fixes = [
        {"timestamp": 10**6, "latitude_deg": 34.1, "longitude_deg": -118.2, "altitude_msl_m": 500.0, "eph": 1.5,
         "epv": 2.5, "vel_n_m_s": 1.0, "vel_e_m_s": 2.0, "vel_d_m_s": 0.5}
    ]  # fmt: skip
    path = ulog(tmp_path / "log", {"sensor_combined": (forms["sensor_combined"], readings),
                                   "sensor_gps": (forms["sensor_gps"], fixes)})  # fmt: skip
    rows = read_drive([path], PLAIN)
    assert rows.forces == [(0.0, 0.25, -9.75)] * 3
    assert rows.rates[0] == (0.0, 0.5, 1.0)
    assert rows.axes == "frd"
    assert rows.fixes[0]["velocity_m_per_s"] == [2.0, 1.0, -0.5]
    assert rows.fixes[0]["vertical_sigma_m"] == 2.5
