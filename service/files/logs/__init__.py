"""Logs as they come: tables of many shapes, ROS bags, MCAP, PX4 and ArduPilot logs, MAVLink telemetry."""
