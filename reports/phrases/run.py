"""Sentences on a run: those at the top of its page and on the terminal, one fact each, and those on its tracks."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from fgbaseline.compare import (
    CovarianceState,
    divergence_summary,
    held_out_ranking,
    reprojection_summary,
    time_coverage,
)
from fgbaseline.compare.divergence_onset import (
    AROUND,
    DivergenceOnset,
    divergence_onset,
    divergence_threshold,
    mask_share,
    worst_second,
    wrong_share,
)
from fgbaseline.compare.estimate_comparison import Run, known, same_frames
from fgbaseline.compare.overconfidence import DEGREES_OF_FREEDOM
from fgbaseline.compare.residuals.residual_classes import REGION_COLUMNS, REGION_ROWS
from fgbaseline.compare.sample_sizes import insufficient_truth, truth_sample
from fgbaseline.data import Sequence, Status
from fgbaseline.data.wording import noun
from fgbaseline.geometry import FloatArray

from ..formatting import counted, distance, grouped, limit_per_cent, listed, number, per_cent
from ..results.evidence import frame_ranges, summarize_sigma
from .evidence import (
    held_out_sentences,
    in_pixels,
    reference_sentence,
    reference_sigma_sentence,
    sample_requirement,
    threshold_sentences,
)
from .run_accuracy import ate_sentences, divergence_sentences, overconfidence_sentences, reference_nees_sentences

SUSPECTED = "wrong matches, moving points or points that cannot be triangulated"
"""reasons of `WRONG_MATCH`"""
LONGEST_LIST = 80
"""letters of a list of frames; of a longer one only the first and the last frame are named"""
SPARSE = 0.25
"""part of an even share of the observations, below which a cell of the 3 x 3 grid is sparse"""


def verdict(run: Run) -> list[str]:
    """All sentences, those of most consequence first."""
    parts: tuple[Callable[[Run], list[str]], ...] = (
        _too_little_truth,
        _reference,
        overconfidence_sentences,
        _reference_sigma,
        partial(_with_status, Status.FAILED),
        ate_sentences,
        divergence_sentences,
        _coverage,
        partial(_with_status, Status.RECOVERED),  # the table marks them, and their loss shows in the ranking
        _maximum_divergence,
        _missing_poses,
        reference_nees_sentences,
        _consistency,
        _invalid_covariances,
        _held_out,
        _common_observations,
        _mask,
        _assumed_noise,
    )
    return [sentence for part in parts for sentence in part(run)]


def _too_little_truth(run: Run) -> list[str]:
    sample = truth_sample(run)
    if sample is None or not insufficient_truth(run):
        return []
    n = int(sample["n"])
    return [
        f"Too little ground truth for an ATE: {number(n)} of {counted(run.problem.n_frames, 'frame')} "
        f"{'has' if n == 1 else 'have'} it, over {per_cent(sample['coverage'])} of the recording's time; "
        f"{sample_requirement()}."
    ]


def _reference(run: Run) -> list[str]:
    if run.reference is None:
        return [f"There is no reference, so nothing is compared: {listed(run.trust.reasons)}."]
    return [reference_sentence(run.reference, run.trust, is_compared=bool(run.compared))]


def _reference_sigma(run: Run) -> list[str]:
    """Uncertainty of the reference itself, by its own covariances."""
    if run.reference is None:
        return []
    sigma = summarize_sigma(run.results[run.reference].evidence.sigma)
    if sigma is None:
        return [f"{run.reference} has no covariances: its own distance from the truth is unknown."]
    return [reference_sigma_sentence(run.reference, sigma)]


def _coverage(run: Run) -> list[str]:
    tables = {r.name: r.divergence for r in run.answered if r.divergence is not None}
    frames = {name: known(table) for name, table in tables.items()}
    if len(frames) < 2 or same_frames(frames.values()):
        return []
    t = run.problem.sequence.t
    each = listed(f"{name} {per_cent(time_coverage(t[there], t))}" for name, there in frames.items())
    common = {name: run.results[name].divergence_common for name in frames}
    counts = {c.frames for c in common.values() if c is not None}
    unranked = [name for name, c in common.items() if c is None]
    shares = f"The estimators cover different shares of the recording's time: {each}."
    if not counts:
        return [shares, "They are not ranked: they have no frame in common."]
    having = "the others have" if unranked else "all have"
    ranked = f"They are ranked over the {counted(counts.pop(), 'frame')} that {having}."
    left_out = [f"{listed(unranked)} {noun(len(unranked), 'is', 'are')} not ranked."] if unranked else []
    return [shares, ranked, *left_out]


def _maximum_divergence(run: Run) -> list[str]:
    """Largest divergence of each estimator, and from when on it exceeds the threshold, the first one first."""
    most, onsets = dict[str, tuple[float, str]](), dict[str, DivergenceOnset]()
    for r in run.compared:
        if r.divergence is None or r.name in run.by_products | run.same_graph or not known(r.divergence).any():
            continue
        most[r.name] = (divergence_threshold(r), distance(divergence_summary(r.divergence)["max"]))
        if (onset := divergence_onset(run, r)) is not None:
            onsets[r.name] = onset
    found = dict(sorted(onsets.items(), key=lambda item: item[1].frame))
    since = {
        name: ("" if onset.beyond == 1.0 else f"in {per_cent(onset.beyond)} of the frames ")
        + f"from {onset.seconds:.1f} s (frame {onset.frame}) on"
        for name, onset in found.items()
    }
    sentences = threshold_sentences("divergence", most, since)
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    wrong = {name: onset.wrong for name, onset in found.items() if onset.wrong is not None}
    if wrong and overall is not None:
        each = listed(f"{per_cent(share)} ({name})" for name, share in wrong.items())
        sentences.append(
            f"Within {AROUND:g} s of the first frame above the threshold, the mask excluded {each} of the observations "
            f"as {SUSPECTED}; in the whole recording {per_cent(overall)}."
        )
    return sentences


def _with_status(status: Status, run: Run) -> list[str]:
    """Estimators that ended with a status, by reason."""
    found = {name: result.estimate for name, result in run.results.items() if result.estimate.status is status}
    reasons = grouped((estimate.reason or "no reason was given", name) for name, estimate in found.items())
    outcome = "recovered (finished after losses)" if status is Status.RECOVERED else status.value
    return [f"{listed(names)} {outcome}: {reason.rstrip('.')}." for reason, names in reasons.items()]


def _missing_poses(run: Run) -> list[str]:
    names = grouped((int(np.isnan(r.estimate.world_T_imu[:, 0, 0]).sum()), r.name) for r in run.answered)
    return [
        f"{listed(those)} {noun(len(those), 'has', 'have')} no pose in {missing} of "
        f"{counted(run.problem.n_frames, 'frame')}."
        for missing, those in names.items()
        if missing
    ]


def _consistency(run: Run) -> list[str]:
    """Normalized error RMS, the most consistent estimator first."""
    known = {r.name: r.nees[~np.isnan(r.nees)] for r in run.answered if r.nees is not None}
    mean = {name: float(nees.mean()) for name, nees in known.items() if len(nees)}
    if not mean:
        return []
    each = (
        f"{number(np.sqrt(value / DEGREES_OF_FREEDOM))} for {name} (NEES {number(value)})"
        for name, value in sorted(mean.items(), key=lambda item: abs(np.log(max(item[1], 1e-300) / DEGREES_OF_FREEDOM)))
    )
    return [f"Normalized error RMS (square root of mean NEES / {DEGREES_OF_FREEDOM}, expected 1): {listed(each)}."]


def _invalid_covariances(run: Run) -> list[str]:
    found = []
    for result in run.answered:
        bad = np.flatnonzero(result.evidence.covariance == CovarianceState.NOT_POSITIVE_DEFINITE)
        if len(bad):
            ranges = frame_ranges(bad)
            where = ranges if len(ranges) <= LONGEST_LIST else f"first {bad[0]}, last {bad[-1]}"
            found.append(((len(bad), where), result.name))
    each = [
        f"{number(n)} {noun(len(names), 'of', 'each of')} {listed(names)} ({noun(n, 'frame')} {where})"
        for (n, where), names in grouped(found).items()
    ]
    return [f"Pose covariances that are not positive definite, which NEES leaves out: {listed(each)}."] if each else []


def _held_out(run: Run) -> list[str]:
    """Held-out errors, without other solvers of the reference's graph, which do not compete with it."""
    if run.held_out is None:
        return []
    ranking, held, errors = run.held_out.ranking, run.held_out.held, run.held_out.errors
    if errors is not None and (unranked := list(run.same_graph & set(ranking.index))):
        ranking = held_out_ranking(replace(errors, error=errors.error.drop(columns=unranked)))
    if len(ranking) == 0 or errors is None:
        return [f"There is no held-out error: none of {counted(held.n_tracks, 'held-out track')} can be predicted."]
    sample = (
        f"{counted(errors.inliers, 'track piece')}; all estimators have poses in {number(errors.pieces)} of "
        f"{number(held.n_pieces)}"
    )
    return [
        *held_out_sentences(ranking, sample),
        "The held-out error measures the motion over the length of a track, not drift.",
    ]


def _common_observations(run: Run) -> list[str]:
    if run.common is None or not run.common.any():
        return []
    common = np.flatnonzero(run.common)
    medians = {}
    for result in run.answered:
        if result.estimate.used.any():
            table = result.reprojection
            medians[result.name] = reprojection_summary(table[table["observation"].isin(common)])["median"]
    if len(medians) < 2:
        return []
    return [
        f"Median reprojection error over the {counted(len(common), 'observation')} that all estimators with landmark "
        f"updates used: {in_pixels(medians)}."
    ]


def _mask(run: Run) -> list[str]:
    """Share of the observations that the mask excluded, and of the suspected errors among them the worst second."""
    n, excluded = mask_share(run.problem)
    if excluded == 0:
        return []
    total = f"The mask excluded {per_cent(excluded / n)} of the observations ({number(excluded)} of {number(n)})."
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    worst = worst_second(run.problem)
    if overall is None or worst is None:
        return [total]
    second = f"{worst.second:.0f} s to {worst.second + 1.0:.0f} s"
    return [
        total,
        f"Excluded as {SUSPECTED}: {per_cent(overall)}, at most {per_cent(worst.share)} within a second (from "
        f"{second}).",
    ]


def _assumed_noise(run: Run) -> list[str]:
    problem = run.problem
    if problem.diagnosed:
        return []
    pixels = number(float(np.sqrt(problem.pixel_variance)))
    if problem.imu is not None:
        return [
            f"Not diagnosed: {pixels} px are assumed as noise (1-sigma), not estimated from this recording; the noise "
            "of the inertial samples is as given."
        ]
    sigma = np.sqrt(np.median(np.diagonal(problem.increment_covariance, axis1=1, axis2=2), axis=0))
    motion = f"{number(float(sigma[:3].max()))} m and {number(float(np.rad2deg(sigma[3:].max())))}° per frame"
    return [f"Not diagnosed: the noise (1-sigma) is assumed, {pixels} px, {motion}."]


def track_sentences(sequence: Sequence, size: tuple[float, float]) -> list[str]:
    """Number and length of the tracks, observations a frame, and sparse cells of a left image of `size`, px."""
    o, T = sequence.observations, sequence.n_frames
    if len(o) == 0:
        return []
    length = o.counts(sequence.n_landmarks)
    length = length[length > 0]
    per_frame = np.bincount(o.frame, minlength=T)
    fewest = int(np.argmin(per_frame))
    return [
        f"{counted(len(length), 'track')} of {number(float(length.mean()))} frames on average (median "
        f"{int(np.median(length))}, longest {int(length.max())}).",
        f"{number(float(per_frame.mean()))} recorded observations a frame on average, fewest in frame {fewest} "
        f"({int(per_frame[fewest])}).",
        f"Sparse cells of the 3 x 3 grid of the {'image' if sequence.monocular else 'left image'} (below "
        f"{limit_per_cent(SPARSE)} of an even share): {listed(_sparse_cells(o.pixel[:, :2], size)) or 'none'}.",
    ]


def _sparse_cells(pixel: FloatArray, size: tuple[float, float]) -> list[str]:
    """Names of the cells of the image with few of the points (n, 2)."""
    cell = np.clip((3.0 * pixel / np.array(size)).astype(np.int64), 0, 2)
    share = np.bincount(3 * cell[:, 1] + cell[:, 0], minlength=9) / len(pixel)
    return [f"{REGION_ROWS[k // 3]} {REGION_COLUMNS[k % 3]}" for k in np.flatnonzero(share < SPARSE / 9.0)]
