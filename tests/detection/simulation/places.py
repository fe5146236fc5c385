"""Five drones over a rover's way."""

from detection import RangingAnchor

ANCHORS = [
    RangingAnchor("D1", 0.0, 0.0, 120.0),
    RangingAnchor("D2", 400.0, 30.0, 60.0),
    RangingAnchor("D3", 380.0, 420.0, 140.0),
    RangingAnchor("D4", -20.0, 390.0, 80.0),
    RangingAnchor("D5", 240.0, 150.0, 160.0),
]
WAY_M = [(100.0, 100.0, 2.0), (160.0, 180.0, 2.0), (160.0, 200.0, 2.0)]
