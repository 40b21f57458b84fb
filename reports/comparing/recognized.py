"""What was recognized in the files of a comparison, and what that leaves out, in words."""

import numpy as np

from ..page.numbers import listed
from .comparison import Comparison


def recognized(comparison: Comparison) -> list[str]:
    """A sentence for each remark on a file, and one on what cannot be compared without orientations."""
    entries = [comparison.reference, *(result.entry for result in comparison.results.values())]
    sentences = [f"{entry.name}: {remark}." for entry in entries for remark in entry.remarks]
    bare = [entry.name for entry in entries if not entry.trajectory.oriented]
    if bare:
        sentences.append(
            f"{listed(bare)} {'has' if len(bare) == 1 else 'have'} no orientations, so positions alone are compared: "
            "rotation errors, relative errors, segments, drift, the body's heading and NEES need orientations and are "
            "left out."
        )
    return sentences


def up_of(comparison: Comparison) -> str:
    """Which direction is up, and from where that is known."""
    direction = ", ".join(f"{x:.3g}" for x in (np.round(comparison.up, 6) + 0.0))
    return f"Up is ({direction}) in the world of {comparison.reference.name} ({comparison.up_from})."
