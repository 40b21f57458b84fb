"""Runs estimators, own and registered ones, on one problem; the failure of one does not stop the others."""

import inspect
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import PurePath
from typing import TypeAlias

import numpy as np

from fgbaseline.geometry import FgbaselineError, so3

from ..problem import Problem
from .estimate import Estimate, Progress, Status
from .registry import find_estimator

Watch: TypeAlias = Callable[[str], AbstractContextManager[Progress | None]]
"""context manager around the run of a named estimator, which gives its progress callback"""
ROTATION_TOLERANCE = 1e-6


def no_progress(name: str) -> AbstractContextManager[Progress | None]:  # noqa: ARG001
    """Progress is not reported."""
    return nullcontext(None)


def solve_all(
    problem: Problem,
    names: Iterable[str],
    watch: Watch = no_progress,
    functions: Mapping[str, Callable[..., object]] | None = None,
) -> dict[str, Estimate]:
    """Estimate of each named estimator, in the order of the names; a failure gives a failed estimate.

    Estimators get the problem without ground truth.
    `functions` are estimators that are not registered, by name. An estimate or by-product without `seconds_total` gets
    the time that the call took. A by-product (`isam2-online` of `isam2`) is not computed twice. An estimator with a
    parameter `given` (`batch` starts from the answer of `isam2`) receives the earlier estimates by name.
    """
    problem = replace(problem, sequence=replace(problem.sequence, truth=None))
    answers: dict[str, Estimate] = {}
    given: dict[str, Estimate] = {}
    for name in names:
        if name in given:
            answers[name] = given[name]
            continue
        start = time.perf_counter()
        try:
            with watch(name) as progress:
                solver = (functions or {}).get(name) or find_estimator(name)
                start = time.perf_counter()  # without its import
                answer = _solved(solver, problem, progress, given | answers)
                spent = time.perf_counter() - start
                estimate = _timed(checked(answer, name, problem), spent)
                given |= {other: _timed(checked(e, other, problem), spent) for other, e in estimate.by_products.items()}
        except Exception as error:  # a filter of another package may raise anything
            estimate = Estimate.failed(name, describe(error), problem.n_frames, len(problem.excluded))
            estimate = replace(estimate, seconds_total=time.perf_counter() - start)
        answers[name] = estimate
    return answers


def _timed(estimate: Estimate, seconds: float) -> Estimate:
    """The estimate, with `seconds` as its total where it states none above 0."""
    return estimate if estimate.seconds_total > 0.0 else replace(estimate, seconds_total=seconds)


def _solved(
    estimator: Callable[..., object], problem: Problem, progress: Progress | None, given: Mapping[str, Estimate]
) -> object:
    if "given" in _parameters(estimator):
        return estimator(problem, progress, given=given)
    return estimator(problem, progress)


def _parameters(estimator: Callable[..., object]) -> Iterable[str]:
    try:
        return inspect.signature(estimator).parameters
    except (TypeError, ValueError):  # one written in C has no signature
        return ()


def describe(error: Exception) -> str:
    """Description of an exception in one sentence: type, text and source line."""
    text = str(error).strip().partition("\n")[0]
    if isinstance(error, FgbaselineError) and text:
        return text
    where = traceback.extract_tb(error.__traceback__)
    line = f" ({PurePath(where[-1].filename).name}, line {where[-1].lineno})" if where else ""
    return f"{type(error).__name__}: {text or 'no text'}{line}"


def checked(answer: object, name: str, problem: Problem) -> Estimate:
    """Validated estimate with its registered name. Raises FgbaselineError where it cannot be compared or written."""
    if not isinstance(answer, Estimate):
        raise FgbaselineError(f"it returned {type(answer).__name__} in place of an Estimate")
    T, n = problem.n_frames, len(problem.excluded)
    _require_shape("world_T_imu", answer.world_T_imu, (T, 4, 4))
    _require_shape("used", answer.used, (n,))
    if answer.used.dtype != np.bool_:
        raise FgbaselineError(f"its used has the type {answer.used.dtype}, expected bool")
    if answer.covariance is not None:
        _require_shape("covariance", answer.covariance, (T, 6, 6))
    if answer.innovations is not None:
        _require_shape("innovations.nis", answer.innovations.nis, (T,))
        _require_shape("innovations.degrees", answer.innovations.degrees, (T,))
    if len(answer.seconds):
        _require_shape("seconds", answer.seconds, (T,))
    _require_landmarks(answer, problem)
    if answer.status is not Status.FAILED:
        _require_path(answer)
    return replace(answer, name=name)


def _require_shape(field: str, array: object, expected: tuple[int, ...]) -> None:
    shape = np.shape(array) if isinstance(array, np.ndarray) else type(array).__name__
    if shape != expected:
        raise FgbaselineError(f"its {field} is {shape}, expected an array {expected}")


def _require_landmarks(answer: Estimate, problem: Problem) -> None:
    index, m = answer.landmarks.index, len(answer.landmarks)
    _require_shape("landmarks.position", answer.landmarks.position, (m, 3))
    if answer.landmarks.covariance is not None:
        _require_shape("landmarks.covariance", answer.landmarks.covariance, (m, 3, 3))
    if m and not (np.all(np.diff(index) > 0) and index[0] >= 0 and index[-1] < problem.sequence.n_landmarks):
        raise FgbaselineError(
            f"its landmarks.index must rise and name landmarks of the sequence, 0 to {problem.sequence.n_landmarks - 1}"
        )


def _require_path(answer: Estimate) -> None:
    poses = answer.world_T_imu
    known = ~np.isnan(poses).all(axis=(1, 2))
    if not known.any():
        raise FgbaselineError("it gave no pose at all")
    defect = np.where(np.isfinite(poses).all(axis=(1, 2)), 0.0, np.inf)
    rigid = known & (defect == 0.0)
    defect[rigid] = so3.orthogonality_error(poses[rigid, :3, :3])
    wrong = np.flatnonzero(known & ~(defect <= ROTATION_TOLERANCE))
    if len(wrong):
        k = int(wrong[0])
        raise FgbaselineError(f"its pose of frame {k} is not a rigid motion (rotation off by {defect[k]:.3g})")
