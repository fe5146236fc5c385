"""DOP maps: how good positioning is at one antenna height, and where it is not good enough."""
