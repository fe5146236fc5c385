"""Which Sightline answers: every result says so."""

import importlib.metadata

__all__ = ["VERSION"]

VERSION = importlib.metadata.version("sightline")
