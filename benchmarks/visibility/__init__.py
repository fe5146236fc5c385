"""Visibility, dilution, volumes and sites against brute force, GDAL and a memory copy."""
