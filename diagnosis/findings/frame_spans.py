"""Spans of frames, formatted for sentences."""

from itertools import pairwise

from fgbaseline.data.observations import IntArray
from fgbaseline.data.wording import plural


def spans(frames: IntArray, most: int = 4) -> str:
    """Spans of increasing indices, of which at most the longest `most`: `121 to 127, 150 and 3 more spans`."""
    if len(frames) == 0:
        return "none"
    cuts = [0, *(i + 1 for i in range(len(frames) - 1) if frames[i + 1] - frames[i] > 1), len(frames)]
    runs = [(int(frames[a]), int(frames[b - 1])) for a, b in pairwise(cuts)]
    shown = sorted(sorted(runs, key=lambda run: run[0] - run[1])[:most])
    text = ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in shown)
    return text + (f" and {plural(len(runs) - most, 'more span')}" if len(runs) > most else "")
