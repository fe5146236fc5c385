"""The front doors: HTTP, jobs and their store, the command line. Translates, calls, answers; no mathematics."""

__all__: list[str] = []
