"""Counts and shares in sentences: '1 frame', '1,009 frames', '98 %'."""


def plural(n: int, one: str, many: str = "") -> str:
    """The count, with commas, and its noun."""
    return f"{n:,} {noun(n, one, many)}"


def noun(n: int, one: str, many: str = "") -> str:
    """The noun alone: `one` for 1, else `many`, by default `one` with an s."""
    return one if n == 1 else many or f"{one}s"


def percent(share: float, decimals: int = 0) -> str:
    """A share of one in percent: '98 %'."""
    return f"{100.0 * share:.{decimals}f} %"
