"""Tracks kept from diagnosis and estimators, to judge paths by what none of them has seen."""

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.geometry import InputError, se3

from .diagnose.links import consecutive
from .diagnose.odometry import odometry
from .diagnose.repair import GATE, GATE_RANGE
from .observations import IntArray, Observations
from .problem import Excluded
from .sequence import Sequence
from .track_mask import MaskSettings, TrackLinks, split_tracks

MIN_PIECE = 6
"""observations of a piece of a track: three on each half"""


@dataclass(frozen=True, eq=False, slots=True)
class HeldOut:
    """n observations of tracks that were taken out of a sequence."""

    observations: Observations
    """as recorded, with the recording's landmark numbers"""
    piece: IntArray
    """(n,) the piece of a track that each belongs to, 0 to n_pieces - 1: consecutive sights of one point, as far as the
    cameras alone can tell; -1 for those that are copies, jump, or are left in pieces shorter than `MIN_PIECE`"""
    n_pieces: int
    share: float
    seed: int

    @property
    def n_tracks(self) -> int:
        """How many tracks were taken out."""
        return len(np.unique(self.observations.landmark))


def hold_out(sequence: Sequence, share: float, seed: int = 0) -> tuple[Sequence, HeldOut]:
    """The sequence without a random `share` (0 to 1, exclusive) of its tracks, and these tracks.

    Which ones depends on the seed and on which landmarks are observed, on no pixel. Nothing of them is left in the
    sequence but their numbers. They are cut into pieces where they jump, or are copied from the frame before: against
    frame-to-frame odometry of all tracks, which knows neither velocities nor estimators. Raises InputError for another
    share, or where there are no two tracks.
    """
    if not 0.0 < share < 1.0:
        raise InputError(f"held-out: expected a share above 0 and below 1, got {share:g}; 0.2 is usual")
    o = sequence.observations
    tracks = np.unique(o.landmark)
    if len(tracks) < 2:
        raise InputError(f"held-out: the recording has {len(tracks)} tracks, of which none can be spared")
    n = min(max(1, round(share * len(tracks))), len(tracks) - 1)
    out = np.isin(o.landmark, np.random.default_rng(seed).choice(tracks, n, replace=False))
    kept = replace(sequence, observations=o.select(~out))
    with threadpool_limits(limits=1, user_api="blas"):
        piece, n_pieces = _pieces(sequence, o.select(out))
    return kept, HeldOut(o.select(out), piece, n_pieces, share, seed)


def _pieces(sequence: Sequence, out: Observations) -> tuple[IntArray, int]:
    """The piece (n,) of each observation of the tracks `out`, and how many there are."""
    seen = odometry(sequence)
    path = se3.compose(np.where(seen.known[:, None, None], seen.motion, np.eye(4)))
    stretch = np.concatenate([[0], np.cumsum(~seen.known)])  # of frames whose motion the cameras tell
    number, landmark = np.unique(out.landmark * (stretch[-1] + 1) + stretch[out.frame], return_inverse=True)
    cut = Observations(out.frame, landmark.astype(np.int64), out.pixel)
    alone = replace(sequence, observations=cut, n_landmarks=len(number), truth=None)
    before, after = consecutive(alone)
    copied = np.zeros(len(out), dtype=np.bool_)
    copied[after] = (out.pixel[before] == out.pixel[after]).all(axis=1)
    error = TrackLinks(alone, path, 0.0).error(before[~copied[after]], after[~copied[after]])
    typical = float(np.median(error)) if len(error) else GATE_RANGE[1]
    gate = float(np.clip(GATE * typical, *GATE_RANGE))
    split = split_tracks(alone, path, MaskSettings(prediction_gate=gate, min_track=MIN_PIECE), copied)
    sound = split.excluded == Excluded.NO
    piece = np.full(len(out), -1, dtype=np.int64)
    present, piece[sound] = np.unique(split.landmark[sound], return_inverse=True)
    return piece, len(present)
