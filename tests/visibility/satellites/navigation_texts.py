"""RINEX navigation texts cut from one, and in the layout of another version."""


def head(text, records):
    """The header and the first records of a RINEX 2 navigation file."""
    lines = text.splitlines()
    end = next(number for number, line in enumerate(lines) if "END OF HEADER" in line) + 1
    return "\n".join(lines[: end + 8 * records])


def as_rinex_3(text):
    """The same records in the layout of RINEX 3, with one of GLONASS between them."""
    _, _, body = text.partition("END OF HEADER")
    lines = body.splitlines()[1:]
    new = [
        "     3.03           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE",
        " " * 60 + "END OF HEADER",
    ]
    for first in range(0, len(lines), 8):
        year, month, day, hour, minute, second = lines[first][2:22].split()
        epoch = f"20{year} {int(month):02d} {int(day):02d} {int(hour):02d} {int(minute):02d} {float(second):02.0f}"
        new.append(f"G{int(lines[first][:2]):02d} {epoch}{lines[first][22:]}".replace("E", "D"))
        new += [" " + line for line in lines[first + 1 : first + 8]]
        if first == 0:
            new += ["R04 2009 04 01 00 15 00" + " 0.000000000000D+00" * 3, *[" " * 4 + " 0.000000000000D+00" * 4] * 3]
    return "\n".join(new)
