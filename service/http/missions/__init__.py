"""Missions over HTTP: kept with their versions, and as files."""
