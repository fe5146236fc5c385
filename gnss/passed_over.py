"""What of an orbit file was passed over, and why: sentences for those who use the rest."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from gnss.errors import AlmanacFileError

__all__ = ["PassedOver", "system_of_number"]

# numbers that mixed files give satellites of other systems
SYSTEMS = ((120, 158, "SBAS"), (183, 206, "QZSS"))
MOST_TOLD = 5


@dataclass(slots=True)
class PassedOver:
    """Collects them while a file is read."""

    foreign: Counter[str] = field(default_factory=Counter)
    useless: list[str] = field(default_factory=list)

    def warnings(self) -> tuple[str, ...]:
        """One sentence for each other system, and one for each useless record, or for the many of them."""
        others = [f"{n} records of {system} were passed over; only GPS is read." for system, n in self.foreign.items()]
        told = self.useless[:MOST_TOLD]
        if len(self.useless) > MOST_TOLD:
            told.append(f"{len(self.useless) - MOST_TOLD} more records were passed over for such reasons.")
        return (*others, *told)

    def nothing_left(self, sentence: str) -> AlmanacFileError:
        """The error for a file of which nothing is left; it says why."""
        return AlmanacFileError(" ".join([sentence, *self.warnings()]))


def system_of_number(number: int) -> str:
    """The system whose satellites have such numbers; where there is none, the number itself."""
    name = next((name for low, high, name in SYSTEMS if low <= number <= high), None)
    return f"satellites with number {number}" if name is None else name
