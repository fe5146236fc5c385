"""The runtime range-based detector: notices occlusion from the ranges themselves, without a map."""

__all__: list[str] = []
