"""What a run tells of an estimator beside its trajectory: consistency, residuals, map, held-out tracks."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from fgbaseline import compare
from fgbaseline.data import Estimate, HeldOut, Problem, Status
from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """One estimator's."""

    covariance: NDArray[np.uint8]
    """(T,) a `compare.CovarianceState` each"""
    error: FloatArray | None
    """(T, 6) in the body frame: see `compare.body_error`; None without truth"""
    nees: pd.DataFrame | None
    """see `compare.nees_table`; None without truth"""
    difference: compare.ReferenceNees | None
    """against the reference; None for the reference itself, and without one"""
    sigma_ratio: pd.DataFrame | None
    """its sigmas over those of the reference, by frame; None likewise"""
    nis_per_degree: FloatArray
    """(T,) NaN where it recorded no innovation"""
    nis: compare.NisSummary
    whitened: dict[str, float | int]
    """see `compare.whitened_summary`"""
    patterns: pd.DataFrame
    """see `compare.residual_patterns`"""
    moved: pd.DataFrame
    """see `compare.dynamic_landmarks`"""
    map: pd.DataFrame | None
    """see `compare.map_difference`; None for the reference itself, and without one"""


@dataclass(frozen=True, eq=False, slots=True)
class HeldOutReport:
    """The tracks that were kept from the run, and what the paths make of them."""

    held: HeldOut
    errors: compare.HeldOutErrors | None
    """None where no estimator answered"""
    ranking: pd.DataFrame
    """see `compare.held_out_ranking`; empty where no track is left to judge by"""


def gathered(problem: Problem, estimate: Estimate, reprojection: pd.DataFrame, reference: Estimate | None) -> Evidence:
    """The evidence on an estimate, `reprojection` being its table."""
    truth = problem.sequence.truth
    other = None if reference is None or reference.name == estimate.name else reference
    return Evidence(
        covariance=compare.covariance_state(estimate),
        error=None if truth is None else compare.body_error(estimate, truth),
        nees=None if truth is None else compare.nees_table(estimate, truth),
        difference=None if other is None else compare.reference_nees(estimate, other),
        sigma_ratio=None if other is None else compare.sigma_ratio(estimate, other),
        nis_per_degree=compare.nis_per_degree(estimate),
        nis=compare.nis_summary(estimate),
        whitened=compare.whitened_summary(problem, reprojection),
        patterns=compare.residual_patterns(problem.sequence, reprojection),
        moved=compare.dynamic_landmarks(problem, estimate, reprojection),
        map=None if other is None else compare.map_difference(problem.sequence, estimate, other),
    )


def held_out_report(problem: Problem, estimates: Iterable[Estimate], held: HeldOut) -> HeldOutReport:
    """The ranking of all estimates that answered."""
    paths = {e.name: e.world_T_imu for e in estimates if e.status is not Status.FAILED}
    if not paths:
        return HeldOutReport(held, None, pd.DataFrame())
    errors = compare.held_out_errors(problem.sequence, held, paths, problem.pixel_variance)
    return HeldOutReport(held, errors, compare.held_out_ranking(errors))


def frames_in_words(frames: NDArray[np.int64]) -> str:
    """`3, 7 to 9` for rising frames; empty for none."""
    if len(frames) == 0:
        return ""
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)
