"""Live detector sessions: in memory, bounded in number, size and idle time, answering each epoch at once."""

from .answers import as_json, epoch_answer
from .registry import Detectors
from .rehearsal import rehearse
from .sessions import DetectorSession

__all__ = ["DetectorSession", "Detectors", "as_json", "epoch_answer", "rehearse"]
