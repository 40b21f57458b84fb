"""How a count stands in a sentence: '1 frame', '1,009 frames'."""


def plural(n: int, one: str, many: str = "") -> str:
    """The count, with commas, and its noun."""
    return f"{n:,} {noun(n, one, many)}"


def noun(n: int, one: str, many: str = "") -> str:
    """The noun alone: `one` for 1, else `many`, by default `one` with an s."""
    return one if n == 1 else many or f"{one}s"
