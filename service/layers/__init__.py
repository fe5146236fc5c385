"""What a finished visibility map can be downloaded as: one registry of layers for the command line and for HTTP."""

from .registry import LAYERS, Layer, write_layer

__all__ = ["LAYERS", "Layer", "write_layer"]
