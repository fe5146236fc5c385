"""What finished maps can be downloaded as: one registry of layers for the command line and for HTTP."""

from .layer import Layer
from .registry import LAYERS, write_layer

__all__ = ["LAYERS", "Layer", "write_layer"]
