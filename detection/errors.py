"""What can go wrong with detection.

DetectionError
└── DetectionInputError   settings, anchors or arrays that make no question: misuse, told at once

What a sensor may deliver (a negative range, a late epoch, an unknown anchor) is no error: it is rejected and counted.
"""

__all__ = ["DetectionError", "DetectionInputError"]


class DetectionError(Exception):
    """Base of everything that detection raises on purpose."""


class DetectionInputError(DetectionError):
    """Settings, anchors or arrays make no question that can be answered."""
