"""Places in the files of other programs, read as GeoJSON: KML and KMZ, GPX, QGroundControl plans."""
