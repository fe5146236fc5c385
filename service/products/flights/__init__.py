"""Flights through the air above a morphing map."""
