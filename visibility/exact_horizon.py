"""Exact mode: placeholder import target."""
from .fast_sweep import sweep
