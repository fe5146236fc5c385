"""An open-loop receiver of GPS L1 C/A over recorded samples: codes, acquisition, data bits, channels."""

from .acquisition import Acquired, Acquisition, Search, acquire, correlation_powers, noise_limit
from .aiding import foretold_delays_s
from .bits import BIT_S, BitSearch, bits_needed, energy_limit, search_bits
from .channel import BitSums, ChannelMeasurement, correlate_bits, measure_channel, measure_sums
from .clocks import find_clock
from .codes import PRNS, ca_code
from .samples import SAMPLE_TYPES, Samples, SampleType, read_samples, recorded_s
from .tracking import Aiding, track

__all__ = [
    "BIT_S",
    "PRNS",
    "SAMPLE_TYPES",
    "Acquired",
    "Acquisition",
    "Aiding",
    "BitSearch",
    "BitSums",
    "ChannelMeasurement",
    "SampleType",
    "Samples",
    "Search",
    "acquire",
    "bits_needed",
    "ca_code",
    "correlate_bits",
    "correlation_powers",
    "energy_limit",
    "find_clock",
    "foretold_delays_s",
    "measure_channel",
    "measure_sums",
    "noise_limit",
    "read_samples",
    "recorded_s",
    "search_bits",
    "track",
]
