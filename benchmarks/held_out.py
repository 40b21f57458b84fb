"""Agreement of a ranking by held-out tracks with the truth: `python benchmarks/held_out.py drive.mat ...`.

A fifth of the tracks is kept from diagnosis and estimators (seed 0), and the four paths are ranked by their errors on
it. Beside that stand, against the truth, the relative error over 1 and 2 seconds and the error of the aligned path, and
in the last row of a recording what the held-out tracks make of the truth itself, which takes no part in the mask: where
the truth errs more than an estimate, the cameras and the truth disagree, and no ranking by cameras can follow it.
Kendall's tau is 1 where two orders of the four are the same, -1 where they are opposite; "separated" counts the pairs
whose difference on held-out tracks is sure (95 %, block bootstrap of the difference), and how many of these have the
same order in the truth. Without files: three simulated drives, whose truth is exact. Tables and text are in
docs/metrics.md.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):  # before numpy: small matrices wait for each other in threads
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import click
import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from fgbaseline import compare
from fgbaseline.compare.residuals.held_out_tracks import cross_prediction_errors
from fgbaseline.data import HeldOut, Sequence, find_estimator, read
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.diagnosis import calibrated, hold_out
from fgbaseline.geometry import FloatArray, se3, so3

NAMES = ("dead-reckoning", "ekf", "joint-ekf", "isam2")
SIMULATED: tuple[PathName, ...] = ("town", "loop", "handheld")
AGAINST = ("RPE 1 s, m", "RPE 1 s, deg", "RPE 2 s, m", "RPE 2 s, deg", "ATE, m")


@dataclass(frozen=True)
class Judged:
    """One recording."""

    table: pd.DataFrame
    """a row for each path"""
    differences: dict[tuple[str, str], tuple[float, float]]
    """95 % interval of the median held-out error of the first minus that of the second, for each pair"""


def judged(sequence: Sequence, share: float, seed: int) -> Judged:
    kept, held = hold_out(sequence, share, seed)
    problem = calibrated(kept)
    truth = problem.sequence.truth
    if truth is None:
        raise click.ClickException(f"{sequence.name} has no truth to compare with")
    paths = {name: find_estimator(name)(problem, None).world_T_imu for name in NAMES}
    errors = compare.held_out_errors(problem.sequence, held, paths, problem.pixel_variance)
    rows = {
        name: {
            "held out, px": float(np.median(errors.error[name])),
            **relative(path, truth.world_T_imu, sequence.t, 1.0),
            **relative(path, truth.world_T_imu, sequence.t, 2.0),
            "ATE, m": aligned(path, truth.world_T_imu),
        }
        for name, path in paths.items()
    }
    rows["(truth)"] = {"held out, px": of_truth(problem.sequence, held, errors, problem.pixel_variance)}
    return Judged(pd.DataFrame(rows).T, differences(errors))


def relative(path: FloatArray, truth: FloatArray, t: FloatArray, seconds: float) -> dict[str, float]:
    """RMSE of the motion over so many seconds, from every frame on: m, and degrees."""
    step = max(1, round(seconds / float(np.median(np.diff(t)))))
    known = np.asarray(np.isfinite(path + truth).all(axis=(1, 2)))
    k = np.flatnonzero(known[:-step] & known[step:])
    moved, true = (se3.inverse(p[k]) @ p[k + step] for p in (path, truth))
    error = se3.inverse(true) @ moved
    angle = np.rad2deg(so3.rotation_angle(error[:, :3, :3]))
    return {
        f"RPE {seconds:g} s, m": float(np.sqrt(np.mean(np.sum(error[:, :3, 3] ** 2, axis=1)))),
        f"RPE {seconds:g} s, deg": float(np.sqrt(np.mean(angle**2))),
    }


def aligned(path: FloatArray, truth: FloatArray) -> float:
    known = np.isfinite(path + truth).all(axis=(1, 2))
    p, q = path[known, :3, 3], truth[known, :3, 3]
    moved = se3.transform(compare.align_se3(p, q), p)
    return float(np.sqrt(np.mean(np.sum((moved - q) ** 2, axis=1))))


def of_truth(sequence: Sequence, held: HeldOut, errors: compare.HeldOutErrors, variance: float) -> float:
    """px: the median error of the true path over the same observations, as far as truth is known there."""
    assert sequence.truth is not None
    inlier = np.isin(held.piece, errors.table["piece"].unique())
    missing = held.piece[inlier & ~sequence.truth.known[held.observations.frame]]
    chosen = np.flatnonzero(inlier & ~np.isin(held.piece, missing))
    chosen = chosen[np.lexsort((held.observations.frame[chosen], held.piece[chosen]))]
    return float(np.median(cross_prediction_errors(sequence, held, chosen, sequence.truth.world_T_imu, variance)))


def differences(errors: compare.HeldOutErrors) -> dict[tuple[str, str], tuple[float, float]]:
    """Pair of names -> interval of the second minus the first in held-out error, each pair ranked alone."""
    found = {}
    for a, b in combinations(NAMES, 2):
        pair = compare.HeldOutErrors(errors.table, errors.error[[a, b]], errors.gate, errors.pieces, errors.inliers)
        ranking = compare.held_out_ranking(pair)
        worse = str(ranking.index[1])
        low, high = float(ranking["behind_low"].iloc[1]), float(ranking["behind_high"].iloc[1])
        found[a, b] = (low, high) if worse == a else (-high, -low)
    return found


def agreement(recordings: dict[str, Judged]) -> pd.DataFrame:
    """Tau of each recording by each measure, and separated pairs with the same order in the truth."""
    rows: dict[str, dict[str, object]] = {}
    for name, one in recordings.items():
        table = one.table.loc[list(NAMES)]
        sure = {pair: low > 0.0 for pair, (low, high) in one.differences.items() if low > 0.0 or high < 0.0}
        rows[name] = {"separated": f"{len(sure)} of {len(one.differences)}"}
        for measure in AGAINST:
            tau = float(kendalltau(table["held out, px"], table[measure]).statistic)
            truth = table[measure].to_dict()
            same = sum((truth[a] > truth[b]) == worse for (a, b), worse in sure.items())
            rows[name][measure] = f"{tau:+.2f} ({same}/{len(sure)})"
    return pd.DataFrame(rows).T


@click.command()
@click.argument("recordings", nargs=-1, type=click.Path(path_type=Path, exists=True))
@click.option("--truth", type=click.Path(path_type=Path), help="KITTI camera poses of the first recording.")
@click.option("--share", default=0.2, show_default=True)
@click.option("--seed", default=0, show_default=True)
def main(recordings: tuple[Path, ...], truth: Path | None, share: float, seed: int) -> None:
    """Print, for each recording, the paths' errors on held-out tracks and against the truth, and how they agree."""
    given = {p.stem: read(p, *((truth, "camera") if truth and i == 0 else ())) for i, p in enumerate(recordings)}
    if not given:
        given = {name: simulate(Simulation(path=name, duration=30.0, seed=seed + 1)) for name in SIMULATED}
    done = {}
    for name, sequence in given.items():
        done[name] = judged(sequence, share, seed)
        click.echo(f"\n{name}\n{done[name].table.to_string(float_format='{:.3f}'.format, na_rep='')}")
    click.echo(
        f"\nKendall's tau (separated pairs that have the same order in the truth)\n{agreement(done).to_string()}"
    )


if __name__ == "__main__":
    main()
