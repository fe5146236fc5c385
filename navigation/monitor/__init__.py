"""Whether measurements can be believed: parity, exclusion, the inertial check, protection levels (seed 002, 2.2)."""

from .chi_square import chi_square_limit
from .parity import EpochVerdict, ParityEpochs, Use, judge_epochs, whiten
from .phases import difference_covariance, phase_differences, phase_rows, prediction_check
from .protection import ProtectionLevels, ProtectionRisk, predict_protection, protection_levels

__all__ = [
    "EpochVerdict",
    "ParityEpochs",
    "ProtectionLevels",
    "ProtectionRisk",
    "Use",
    "chi_square_limit",
    "difference_covariance",
    "judge_epochs",
    "phase_differences",
    "phase_rows",
    "predict_protection",
    "prediction_check",
    "protection_levels",
    "whiten",
]
