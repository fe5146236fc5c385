"""Ground out of many tiles: their headers, the library of them, and one grid made of those that an area needs."""
