"""Text from files, made safe to be drawn."""

from functools import cache

from matplotlib.font_manager import FontProperties, findfont, get_font

LONGEST = 48
"""characters of a name that a figure has room for"""


def plain(text: str) -> str:
    """`text` as it can stand in a figure: no mathematics, no line breaks, nothing the font cannot draw, not too long.

    A dollar sign would begin mathematics and a leading underscore would hide a line from the legend.
    """
    known = _drawable()
    letters = "".join(c if ord(c) in known and c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    if len(letters) > LONGEST:
        letters = letters[: LONGEST - 1] + "…"
    letters = letters.replace("$", r"\$")
    return " " + letters if letters.startswith("_") else letters


@cache
def _drawable() -> frozenset[int]:
    return frozenset(get_font(findfont(FontProperties(family=["DejaVu Sans"]))).get_charmap())
