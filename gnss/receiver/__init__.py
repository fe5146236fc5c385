"""An open-loop receiver of GPS L1 C/A over recorded samples: codes, acquisition, data bits, channels."""

from .acquisition import Acquired, Acquisition, Search, acquire, correlation_powers, noise_limit
from .aiding import foretold_delays_s
from .bits import BIT_S, BitSearch, energy_limit, search_bits
from .channel import ChannelMeasurement, measure_channel
from .codes import PRNS, ca_code
from .samples import SAMPLE_TYPES, Samples, SampleType, read_samples

__all__ = [
    "BIT_S",
    "PRNS",
    "SAMPLE_TYPES",
    "Acquired",
    "Acquisition",
    "BitSearch",
    "ChannelMeasurement",
    "SampleType",
    "Samples",
    "Search",
    "acquire",
    "ca_code",
    "correlation_powers",
    "energy_limit",
    "foretold_delays_s",
    "measure_channel",
    "noise_limit",
    "read_samples",
    "search_bits",
]
