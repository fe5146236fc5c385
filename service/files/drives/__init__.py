"""Logs of drives: inertial readings, fixes, ranges and speeds, as tables and as logs of messages have them."""
