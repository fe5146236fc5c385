"""Compiled loops of navigation by pseudoranges and wheels."""
