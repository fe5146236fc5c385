"""Accuracy and speed of Sightline against brute force, GDAL and a plain memory copy: ``python -m benchmarks``."""
