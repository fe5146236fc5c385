"""Products over HTTP: their routes, and their raster layers as bare numbers."""
