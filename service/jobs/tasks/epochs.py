"""Long bodies of epochs, looked through in a worker."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.jobs.bodies import model_of
from service.live.limits import DetectorLimits
from service.live.request import EpochsIn

from .bodies import body_in
from .context import TaskContext

__all__ = ["check_epochs"]


def check_epochs(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Raises NotJsonError, LimitError, NotValidError; nothing comes back."""
    model_of(EpochsIn, body_in(arguments), DetectorLimits.of(context.settings).refuse_long_epochs)
    return {}
