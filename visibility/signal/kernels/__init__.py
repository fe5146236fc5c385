"""Compiled loops of radio over ground: diffraction and ways through canopy."""
