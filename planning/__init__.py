"""Occlusion-aware path planning and anchor placement."""

__all__: list[str] = []
