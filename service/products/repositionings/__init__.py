"""Which drone moves where while a mission runs."""
