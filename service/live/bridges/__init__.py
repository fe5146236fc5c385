"""Live links: ranges in, positions and verdicts out, over MAVLink or lines of JSON, by UDP, TCP and serial lines."""
