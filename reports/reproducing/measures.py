"""How figures stand in the sentences of the claims."""

from math import isfinite


def metres(value: float) -> str:
    """'0.35 m', '79.6 m', '1342 m', '28.9 km'; 'no path' for what is not a number."""
    if not isfinite(value):
        return "no path"
    size = abs(value)
    if size >= 9_999.5:
        return f"{value / 1000:.3g} km"
    return f"{value:.0f} m" if size >= 999.5 else f"{value:.3g} m"


def per_cent(share: float) -> str:
    """'16.7 %'."""
    return f"{100.0 * share:.3g} %" if isfinite(share) else "–"


def plural(n: int, one: str) -> str:
    """'1 frame', '5 frames'."""
    return f"{n} {one}{'' if n == 1 else 's'}"
