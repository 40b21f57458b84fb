"""Holding out of tracks, which diagnosis and estimators do not use, to validate paths by them."""

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.held_out import MIN_PIECE, HeldOut
from fgbaseline.data.observations import IntArray, Observations
from fgbaseline.data.problem import Excluded
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import InputError, se3

from .odometry.stereo_odometry import odometry
from .tracks.observation_mask import MaskSettings, TrackConsistency, prediction_gate, split_tracks
from .tracks.track_segments import consecutive


def hold_out(sequence: Sequence, share: float, seed: int = 0) -> tuple[Sequence, HeldOut]:
    """The sequence without a random `share` (0 to 1, exclusive) of its tracks, and these tracks.

    The choice depends on the seed and on the observed landmarks, on no pixel. The sequence keeps only their numbers.
    Held-out tracks are cut into pieces where they jump or are copied from the frame before. The test for this is
    frame-to-frame odometry of all tracks, which uses neither velocities nor estimators. Raises InputError for another
    share, and for fewer than two tracks.
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
    stretch = np.concatenate([[0], np.cumsum(~seen.known)])  # spans of frames between which odometry knows every motion
    number, landmark = np.unique(out.landmark * (stretch[-1] + 1) + stretch[out.frame], return_inverse=True)
    cut = Observations(out.frame, landmark.astype(np.int64), out.pixel)
    alone = replace(sequence, observations=cut, n_landmarks=len(number), truth=None)
    before, after = consecutive(alone)
    copied = np.zeros(len(out), dtype=np.bool_)
    copied[after] = (out.pixel[before] == out.pixel[after]).all(axis=1)
    error = TrackConsistency(alone, path, 0.0).error(before[~copied[after]], after[~copied[after]])
    settings = MaskSettings(prediction_gate=prediction_gate(error), min_track=MIN_PIECE)
    split = split_tracks(alone, TrackConsistency(alone, path, settings.prediction_gate), settings, copied)
    sound = split.excluded == Excluded.NO
    piece = np.full(len(out), -1, dtype=np.int64)
    present, piece[sound] = np.unique(split.landmark[sound], return_inverse=True)
    return piece, len(present)
