"""Answers about a few places at once, without a job: what a pointer over a map, or an autopilot, asks many times."""
