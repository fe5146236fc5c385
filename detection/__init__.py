"""The runtime range-based detector: notices occlusion from the ranges themselves, without a map."""

from .detector import Detector, detect_epoch, meeting_place
from .epochs import GroundHeight, OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor
from .errors import DetectionError, DetectionInputError
from .faults.calibration import Calibrated, Calibration, calibrate
from .faults.diagnosis import diagnose
from .faults.suspicions import Cause, Suspicion
from .geometric import GeometricDetection, detect_2d, detect_3d
from .motion.odometry import Motion
from .settings import (
    DetectorSettings,
    false_positive_rate,
    k_for_false_positive_rate,
    sigma_geometric_m,
    sigma_odometry_m,
)
from .state import AnchorState, DetectorState, Health
from .verdicts import (
    AnchorVerdict,
    Classification,
    EpochResult,
    OdometryCondition,
    PlanningStatus,
    PositionFix,
    RejectedRange,
    Rejection,
    Say,
    SearchReport,
    Sight,
    Witness,
    WitnessSay,
)

__all__ = [
    "AnchorState",
    "AnchorVerdict",
    "Calibrated",
    "Calibration",
    "Cause",
    "Classification",
    "DetectionError",
    "DetectionInputError",
    "Detector",
    "DetectorSettings",
    "DetectorState",
    "EpochResult",
    "GeometricDetection",
    "GroundHeight",
    "Health",
    "Motion",
    "OdometryCondition",
    "OdometryIncrement",
    "PlanningStatus",
    "PositionFix",
    "RangeEpoch",
    "RangeMeasurement",
    "RangingAnchor",
    "RejectedRange",
    "Rejection",
    "Say",
    "SearchReport",
    "Sight",
    "Suspicion",
    "Witness",
    "WitnessSay",
    "calibrate",
    "detect_2d",
    "detect_3d",
    "detect_epoch",
    "diagnose",
    "false_positive_rate",
    "k_for_false_positive_rate",
    "meeting_place",
    "sigma_geometric_m",
    "sigma_odometry_m",
]
