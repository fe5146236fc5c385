"""Small DEMs that come with Sightline: real ground and made-up ground, with source, licence and checksum."""

from .catalog import load_sample, sample_manifest, sample_names, sample_path

__all__ = ["load_sample", "sample_manifest", "sample_names", "sample_path"]
