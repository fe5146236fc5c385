"""Missions: what a planner decides, as a document that the service keeps with its versions, and as files."""
