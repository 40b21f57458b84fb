"""What a comparison says of pixels, landmarks and covariances, in words."""

import numpy as np

from ..formatting import counted, listed, number
from .comparison import Comparison


def claimed_said(comparison: Comparison) -> list[str]:
    """What the covariances that came along are worth."""
    sentences = []
    for result in comparison.results.values():
        claimed = result.claimed
        if claimed is None:
            if result.entry.covariance is not None:
                sentences.append(f"The covariances of {result.name} are not judged: {result.notes['nees']}.")
            continue
        known = claimed.nees[~np.isnan(claimed.nees)]
        if len(known):
            mean = float(np.mean(known))
            sentences.append(
                f"Normalized error RMS of {result.name} by its covariances: {number(float(np.sqrt(mean / 6.0)))}, "
                f"1 being expected (mean NEES {number(mean)} over {counted(len(known), 'pose')}, 6 being expected"
                f"{'; ' if claimed.remark else ''}{claimed.remark})."
            )
        if claimed.not_positive_definite:
            sentences.append(
                f"{number(claimed.not_positive_definite)} of the {number(len(claimed.nees))} covariances of "
                f"{result.name} are not positive definite; they are left out."
            )
    return sentences


def maps_said(comparison: Comparison) -> list[str]:
    """How far landmarks that came along are from the reference's."""
    known = {name: result.map for name, result in comparison.results.items() if result.map is not None}
    if not known:
        return []
    each = listed(
        f"{number(float(table['distance'].median()))} m for {name} ({number(float(table['seen'].median()))} m as the "
        f"cameras see them, {number(len(table))} in common)"
        for name, table in known.items()
    )
    return [f"The median distance of landmarks from those of {comparison.reference.name} is {each}."]


def unmatched_said(comparison: Comparison) -> list[str]:
    """Whoever gives a recording expects its pixels to be used."""
    every = {comparison.reference.name: comparison.reference_pixels}
    every |= {name: result.pixels for name, result in comparison.results.items()}
    names = [name for name, pixels in every.items() if pixels is not None and pixels.frames == 0]
    if not names:
        return []
    return [
        f"No pose of {listed(names)} is at a frame of {comparison.sequence}: their time stamps have nothing in common."
    ]


def pixels_said(comparison: Comparison) -> list[str]:
    """Medians with landmarks that are made in the same way for all."""
    every = {comparison.reference.name: comparison.reference_pixels}
    every |= {name: result.pixels for name, result in comparison.results.items()}
    medians = {
        name: float(pixels.along["error"].median())
        for name, pixels in every.items()
        if pixels is not None and pixels.along is not None
    }
    if len(medians) < 2:
        return []
    order = sorted(medians, key=lambda name: medians[name])
    each = listed(f"{number(medians[name])} px for {name}" for name in order)
    return [
        f"With landmarks triangulated along each path in the same way, the median reprojection error is {each}: it "
        "judges them locally, within the life of a track."
    ]


def held_out_said(comparison: Comparison) -> list[str]:
    """The ranking by held-out tracks, and who cannot be told from the first."""
    table = comparison.held_out
    if table is None or len(table) < 2:
        return []
    each = listed(
        f"{number(float(median))} px for {name}" for name, median in zip(table.index, table["median"], strict=True)
    )
    first, best = table.index[0], number(float(table["median"].iloc[0]))
    rest = table.iloc[1:]
    lows = zip(rest.index, rest["behind_low"], rest["median"], strict=True)
    tied = [str(name) for name, low, median in lows if not low > 0.0 or number(float(median)) == best]
    said = f"; the bootstrap does not separate {listed(tied)} from {first}" if tied else ""
    return [f"On tracks that were held out, one half predicted from the other, the median error is {each}{said}."]
