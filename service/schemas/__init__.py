"""What requests and parameter files may say: strict, with units in names; degrees only here."""

from .anchors import AnchorIn
from .points import PointIn
from .sentences import sentence_of
from .sight import CurvatureIn
from .visibility_maps import VisibilityMapParameters

__all__ = ["AnchorIn", "CurvatureIn", "PointIn", "VisibilityMapParameters", "sentence_of"]
