"""A sky of made-up satellites as the text of an almanac, for tests of what takes one."""

from __future__ import annotations

# of the week that the almanac is for: 1411, counted modulo 1024
TIME = "2007-01-27T06:00:00Z"
REFERENCE_DATE = "2007-01-22"
RECORD = """
{prn}
30
0
 5.0000000000000E-03  1.0000000000000E-02 -2.4774635676295E-09
 5.1536000000000E+03 {node:.13E}  1.0000000000000E-01
 {anomaly:.13E}  1.0000000000000E-04  0.0000000000000E+00
{health}
9
"""


def almanac(satellites: int = 24, *, unhealthy: int = 0) -> str:
    """SEM text: satellites on six planes, the first so many of them unhealthy."""
    records = []
    for number in range(satellites):
        plane, slot = number % 6, number // 6
        records.append(
            RECORD.format(
                prn=number + 1,
                node=-1.0 + plane / 3.0,
                anomaly=-1.0 + (slot / 2.0 + plane / 9.0) % 2.0,
                health=63 if number < unhealthy else 0,
            )
        )
    return f"{satellites} MADE-UP.ALM\n 387 589824\n" + "".join(records)
