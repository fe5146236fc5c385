"""All places at once: how much each post would see as a site, and the sites that see most."""

from .choosing import Site, best_sites
from .site_maps import DIRECTIONS, LEAST_DIRECTIONS, MOST_DIRECTIONS, SiteMap, site_map

__all__ = ["DIRECTIONS", "LEAST_DIRECTIONS", "MOST_DIRECTIONS", "Site", "SiteMap", "best_sites", "site_map"]
