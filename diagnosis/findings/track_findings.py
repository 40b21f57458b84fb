"""Findings on tracks and time stamps, in sentences."""

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem.velocity_gaps import GAP
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import per_cent, plural

from ..tracks.track_segments import MAX_ROW_MISMATCH, MIN_DISPARITY
from .frame_spans import spans
from .track_statistics import MIN_USABLE, MOVING_MATCHES, TrackStatistics

MIN_WRONG = 0.10
"""share of wrong matches that is reported: every tracker has some"""
MIN_DEPTHLESS, MIN_TINY, MIN_ROWS, MIN_MOVING = 0.0075, 0.02, 0.01, 0.01
"""shares of the observations, or of the tracks for `MIN_MOVING`, that are reported"""


def track_findings(sequence: Sequence, repeated: BoolArray, tracks: TrackStatistics) -> tuple[Finding, ...]:
    """Copied frames, wrong matches, dynamic landmarks, unusable observations, cuts and gaps."""
    counts = (
        _copies(repeated, tracks),
        _wrong_matches(tracks),
        _bursts(tracks),
        _moving(sequence, tracks),
        _disparities(sequence, tracks),
        _rows(sequence, tracks),
        _few_features(sequence, tracks),
        _cuts(sequence, tracks),
        _gaps(sequence, tracks),
    )
    return tuple(finding for found in counts for finding in found)


def _counted(code: str, sentence: str, before: float, after: float, unit: str) -> Finding:
    return Finding(code, sentence, before, after, unit, "counted")


def _measured(sequence: Sequence) -> str:
    return "velocities" if sequence.imu is None else "inertial samples"


def _copies(repeated: BoolArray, tracks: TrackStatistics) -> list[Finding]:
    n = int(repeated.sum())
    if n == 0:
        return []
    text = (
        f"In {n:,} of {plural(len(repeated), 'interval')} nearly all observations are bit-identical copies of the "
        f"previous frame ({plural(tracks.copied, 'observation')}); many of these tracks then continue on a different "
        "point."
    )
    return [_counted("copied_frames", text, tracks.copied, 0, "observations")]


def _wrong_matches(tracks: TrackStatistics) -> list[Finding]:
    matches, wrong = int(tracks.matches.sum()), int(tracks.wrong.sum())
    if wrong <= MIN_WRONG * matches or matches == 0:
        return []
    text = (
        f"{per_cent(wrong / matches)} of the matches from a frame to the next contradict the motion of the others "
        f"({wrong:,} of {matches:,})."
    )
    return [_counted("wrong_matches", text, wrong / matches, tracks.wrong_after, "share of the matches")]


def _bursts(tracks: TrackStatistics) -> list[Finding]:
    frames = np.flatnonzero(tracks.burst)
    if len(frames) == 0:
        return []
    worst = int(frames[np.argmax(tracks.wrong_share[frames])])
    text = (
        f"Wrong matches come in bursts: in {plural(len(frames), 'interval')} more than a third of the matches "
        f"contradict the motion (after frames {spans(frames)}). The worst follows frame {worst}: "
        f"{per_cent(tracks.wrong_share[worst])} of {plural(int(tracks.matches[worst]), 'match', 'matches')}."
    )
    return [_counted("bursts", text, len(frames), tracks.bursts_after, "intervals")]


def _moving(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    n_tracks = len(np.unique(sequence.observations.landmark))
    if tracks.moving <= MIN_MOVING * n_tracks:
        return []
    text = (
        f"{tracks.moving:,} of {plural(n_tracks, 'track')} contradict the motion in {MOVING_MATCHES} or more "
        "consecutive intervals: moving objects, or tracks that drift."
    )
    return [_counted("moving", text, tracks.moving, tracks.moving_after, "tracks")]


def _disparities(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    n, found = max(1, len(sequence.observations)), []
    if tracks.not_positive > MIN_DEPTHLESS * n:
        text = (
            f"{plural(tracks.not_positive, 'observation')} ({per_cent(tracks.not_positive / n)}) have a disparity of "
            "zero or less, which no point in front of the camera has."
        )
        found.append(_counted("disparity_not_positive", text, tracks.not_positive, 0, "observations"))
    if tracks.tiny > MIN_TINY * n:
        text = (
            f"{plural(tracks.tiny, 'observation')} ({per_cent(tracks.tiny / n)}) have a disparity of at most "
            f"{MIN_DISPARITY:g} px, too small to determine a depth."
        )
        found.append(_counted("disparity_tiny", text, tracks.tiny, 0, "observations"))
    return found


def _rows(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    n = max(1, len(sequence.observations))
    if tracks.rows <= MIN_ROWS * n:
        return []
    text = (
        f"In {plural(tracks.rows, 'observation')} ({per_cent(tracks.rows / n)}) the rows of the left and right image "
        f"differ by more than {MAX_ROW_MISMATCH:g} px: not matched, or not rectified."
    )
    return [_counted("row_mismatch", text, tracks.rows, 0, "observations")]


def _few_features(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    frames = np.flatnonzero(tracks.few)
    if len(frames) == 0:
        return []
    text = (
        f"{plural(len(frames), 'frame')} of {len(tracks.usable):,} have fewer than {MIN_USABLE} usable features "
        f"({spans(frames)}): there only the {_measured(sequence)} determine the motion."
    )
    return [_counted("few_features", text, len(frames), len(frames), "frames")]


def _cuts(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    """Intervals that no track spans, though both frames have some."""
    usable = tracks.usable >= MIN_USABLE
    untied = sequence.observations.ties(sequence.n_frames) == 0
    cuts = np.flatnonzero(untied & usable[:-1] & usable[1:])
    if len(cuts) == 0:
        return []
    text = (
        f"In {plural(len(cuts), 'interval')} all tracks end at once and others begin (after frames {spans(cuts)}): the "
        f"tracker started anew, or the recording is cut there. Only the {_measured(sequence)} determine the motion."
    )
    return [_counted("cuts", text, len(cuts), len(cuts), "intervals")]


def _gaps(sequence: Sequence, tracks: TrackStatistics) -> list[Finding]:
    if len(tracks.gaps) == 0:
        return []
    longest = int(tracks.gaps[np.argmax(sequence.dt[tracks.gaps])])
    text = (
        f"{plural(len(tracks.gaps), 'gap')} in time: {plural(len(tracks.gaps), 'interval')} longer than {GAP:g} times "
        f"the median ({np.median(sequence.dt):.3f} s), the longest {sequence.dt[longest]:.3f} s after frame {longest}."
    )
    return [_counted("gaps", text, len(tracks.gaps), len(tracks.gaps), "intervals")]
