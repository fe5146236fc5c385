"""An open-loop receiver of GPS L1 C/A over recorded samples: codes, acquisition."""

from .acquisition import Acquired, Acquisition, Search, acquire, correlation_powers, noise_limit
from .bits import BIT_S, BitSearch, energy_limit, search_bits
from .codes import PRNS, ca_code
from .samples import SAMPLE_TYPES, Samples, SampleType, read_samples

__all__ = [
    "BIT_S",
    "PRNS",
    "SAMPLE_TYPES",
    "Acquired",
    "Acquisition",
    "BitSearch",
    "SampleType",
    "Samples",
    "Search",
    "acquire",
    "ca_code",
    "correlation_powers",
    "energy_limit",
    "noise_limit",
    "read_samples",
    "search_bits",
]
