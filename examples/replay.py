"""A replay: a log of ranges through a detector that looks at a map, in Python and without a service.

python examples/replay.py

The log is made up: a rover that drives behind a ridge among eight anchors, and hears what the ground lets through.
"""

from dataclasses import replace

import numpy as np

from detection import DetectorSettings, RangingAnchor
from detection.simulation import RangingNoise, draw_epochs, drive_along
from planning.watching import GroundErrors, MapDetector
from terrain import ElevationGrid, height_at
from visibility import lines_of_sight

ANTENNA_M = 1.5
PLACES_M = [(760, 200, 55), (780, 420, 62), (750, 640, 70), (20, 40, 60), (40, 760, 95), (360, 780, 110), (250, 20, 70),
            (420, 420, 130)]  # fmt: skip

# the map: a slope of 10 m cells with a ridge of 45 m across
east_m = 10.0 * np.arange(81)
north_m = 800.0 - east_m
slope_m = 0.05 * north_m[:, None] + 45.0 * np.exp(-(((east_m - 500.0) / 40.0) ** 2))
ground = ElevationGrid(slope_m.astype(np.float32), 10.0, 10.0, origin_east_m=0.0, origin_north_m=800.0)

# the log: who is hidden, and by how much a range is too long, comes from the ground
anchors = [RangingAnchor(f"A{n + 1}", *map(float, place_m)) for n, place_m in enumerate(PLACES_M)]
level = drive_along(anchors, [(250.0, 120.0), (430.0, 300.0), (440.0, 480.0)], speed_m_per_s=1.5)
rover_m = np.column_stack([level.places_m, height_at(ground, *level.places_m.T) + ANTENNA_M])
lines = lines_of_sight(ground, np.repeat(rover_m, 8, axis=0), np.tile(PLACES_M, (len(rover_m), 1)), excess_path=True)
drive = replace(level, places_m=rover_m, excess_m=np.reshape(lines.excess_path_m, (-1, 8)))
log = draw_epochs(drive, RangingNoise(range_sigma_m=0.1), np.random.default_rng(1))

detector = MapDetector(ground, anchors, DetectorSettings(harmful_m=0.5), ANTENNA_M, GroundErrors(dem_sigma_m=1.0))
told = [detector.process(epoch) for epoch in log]
for number in range(0, len(log), 40):
    result, p_sight = told[number].result, told[number].p_sight
    print(f"{result.time_s:5.0f} s: {result.summary} Foretold hidden: {[i for i, p in p_sight.items() if p < 0.5]}")
pairs = zip(told, rover_m, strict=True)
errors_m = [np.linalg.norm(one.result.position.position_m - at_m) for one, at_m in pairs if one.result.position]
print(f"position off by {np.median(errors_m):.2f} m in the median, map doubts: {len(detector.map_doubts())}")
