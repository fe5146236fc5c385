"""Sentences about requests as the command line says them: options in place of fields, heights as people type them."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence

__all__ = ["spoken"]

NAME = r"[a-z][a-z0-9_]*(?:\[\d+\])?"
FIELD = re.compile(
    rf"(?<![\w\-.'\"/=])(?:{NAME}\.)*(?P<name>[a-z][a-z0-9_]*)(?:\[(?P<number>\d+)\])?(?P<given>=|(?!\w))(?![/'\"(\[]|\.\w)"
)
# in a file, as in a request, a field is called by its name
OF_A_FILE = re.compile(
    r"The (?:request|map|mapping|log|trajectory|(?:anchors |track |path )?file) |\S+, (?:line|anchor|feature) \d"
)
PHRASES = (
    ("its altitude_m instead of above_ground_m", "its altitude (612msl) instead of its height above ground (80agl)"),
    ("give above_ground_m", "give its height above ground (80agl)"),
    ("Give times_s or", "Give time_s in the file of --path or"),
    ("cover.footprints", "--buildings"),
    ("say how high a level is", "say how high a level is (--level-height)"),
    ("what to take for those without.", "what to take for those without (--default-height)."),
    ("place (lon_deg, lat_deg)", "place (--sky-at LON,LAT)"),
)
# as --help writes what is typed, and fields whose option is called otherwise
TYPED = {"east_m": "EAST", "north_m": "NORTH", "lon_deg": "LON", "lat_deg": "LAT"}
TYPED |= {"above_ground_m": "HEIGHT", "altitude_m": "HEIGHT"}
OTHERWISE = {
    **dict.fromkeys(("ceiling_above_ground_m", "ceiling_altitude_m"), "ceiling"),
    **dict.fromkeys(("from_s", "to_s", "step_s"), "frames"),
    **{"bounds_m": "bounds", "ranging_sigma_m": "range_sigma", "map_id": "map", "goals": "goal", "way_points": "via"},
    **{"top_m": "canopy_top_m", "base_m": "canopy_base_m"},
    **dict.fromkeys(("horizontal_m2_per_s3", "up_m2_per_s3"), "agility"),
    **{"step_m": "layer_m", "surface_layer_m": "mesh_layer", "time_limit_s": "time_limit", "speed_m_per_s": "speed"},
}


def spoken(sentence: str) -> str:
    """The sentence for whoever typed this process's command line.

    With --request the question is one over HTTP, and so are its words; a file has columns by the names of fields.
    """
    words = sys.argv[1:]
    if not words or any(word.partition("=")[0] == "--request" for word in words) or OF_A_FILE.match(sentence):
        return sentence
    for written, said in PHRASES:
        sentence = sentence.replace(written, said)
    options = _options_of(words)

    def said_for(found: re.Match[str]) -> str:
        text, number = found[0], found["number"]
        # a word like any other is not meant
        meant = "_" in text or number is not None or found["given"] or _leads(sentence, found)
        option = options.get(found["name"])
        if not meant or option is None or sentence[: found.start()].endswith("--set "):
            return text
        if number is not None:
            return f"{option} (number {int(number) + 1})"
        value_follows = found["given"] and re.match(r"[\w\-]", sentence[found.end() :])
        return f"{option} " if value_follows else option

    return FIELD.sub(said_for, sentence)


def _leads(sentence: str, found: re.Match[str]) -> bool:
    """Whether it names the place in the request that a sentence is about: ``seed: …``."""
    before, after = sentence[: found.start()], sentence[found.end() :]
    return after.startswith(":") and (not before or before.endswith(": "))


def _options_of(words: Sequence[str]) -> Mapping[str, str]:
    """What stands for each field of a command's requests: its option, as people type it. words: of the whole line."""
    from ..app import COMMANDS, command_line

    command, rest = words[0], words[1:]
    if command not in COMMANDS:
        return {}
    line = command_line()[command]
    if line.default_command is None:
        # one of several, such as `store check`
        if not rest or rest[0] not in tuple(line):
            return {}
        line = line[rest[0]]
    named: dict[str, str] = {}
    for argument in line.assemble_argument_collection():
        if argument.name.startswith("--"):
            field = argument.field_info.name
            named[field] = f"{named[field]} or {argument.name}" if field in named else argument.name
    for field, other in OTHERWISE.items():
        if field not in named and other in named:
            named[field] = named[other]
    if command == "detect":
        from service.live.settings import DetectorSettingsIn

        named |= {field: f"--set {field}" for field in DetectorSettingsIn.model_fields if field not in named}
    return {**TYPED, **named}
