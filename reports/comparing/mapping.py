"""Landmarks that came along, beside those of the reference."""

from collections.abc import Mapping
from dataclasses import replace

import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import Alignment, MatchedTrajectories
from fgbaseline.data import Estimate, Landmarks, Problem
from fgbaseline.geometry import FloatArray, InputError

from .entry import Entry


def map_of(
    problem: Problem | None,
    paths: Mapping[str, FloatArray],
    reference: Entry,
    entry: Entry,
    matched: MatchedTrajectories,
) -> pd.DataFrame:
    """`compare.map_difference` of the landmarks of an entry, aligned as its path is, from those of the reference.

    Raises InputError, saying why, where there is nothing to compare.
    """
    if problem is None or reference.landmarks is None or entry.landmarks is None:
        lacking = [e.name for e in (reference, entry) if e.landmarks is None]
        raise InputError(f"no landmarks came with {' and '.join(lacking)}" if lacking else "there is no recording")
    motion = matched.alignment
    aligned = Estimate(
        name=entry.name,
        world_T_imu=motion.apply(paths[entry.name]),
        used=problem.mask,
        landmarks=_moved(entry.landmarks, motion),
    )
    there = Estimate(reference.name, paths[reference.name], problem.mask, landmarks=reference.landmarks)
    table = compare.map_difference(problem.sequence, aligned, there)
    if table.empty:
        raise InputError(f"no landmark that {reference.name} has too is seen from a frame that both have a pose of")
    return table


def _moved(landmarks: Landmarks, motion: Alignment) -> Landmarks:
    position = motion.scale * landmarks.position @ motion.rotation.T + motion.translation
    return replace(landmarks, position=position, covariance=None)
