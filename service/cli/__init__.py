"""The command line: ``sightline``."""

from .app import main

__all__ = ["main"]
