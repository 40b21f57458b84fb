"""`fgbaseline.run`, the command `run` for Python, with arrays and functions in place of files and names; its result."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import pandas as pd

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.compare.trajectory_comparison.conventions import Source
from fgbaseline.data import (
    LandmarkMode,
    Problem,
    Sequence,
    TimeUnit,
    Trajectory,
    Truth,
)
from fgbaseline.data.dataframes import as_cell_value
from fgbaseline.data.estimators.runner import no_progress
from fgbaseline.data.formats.files.file_errors import FilePath, as_path

from ..comparison.sources import Array, TrajectoryLike, by_name, opened
from ..phrases.run import verdict
from ..problem import BATCH_OBSERVATIONS, DEFAULT_ESTIMATORS, names_in
from ..problem.construction import build_problem, hold_out_tracks, read_sequence
from ..problem.settings import RunSettings, Solver, check_estimators, import_estimators, named_estimators, with_defaults
from ..python_interface import NotebookResult, for_python, write_report
from ..results.json_files import SUMMARY
from ..results.run import Summary, summarize
from ..tables.run import main_frame, main_table, metrics_table
from ..tables.table import Table
from .estimation import read_added, solve

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class RunReport(NotebookResult, Run):
    """A run with pandas tables, sentences, matplotlib figures, and the folder of `fgbaseline run`."""

    @cached_property
    def summary(self) -> Summary:
        """All metrics, as in `summary.json`."""
        return summarize(self)

    @property
    def table(self) -> pd.DataFrame:
        """One row per main metric, one column per estimator."""
        return main_frame(self, self.summary.content["estimators"])

    @property
    def text_table(self) -> Table:
        """The main metrics as text, for `tables.markdown`, `latex` and `print_table`."""
        return main_table(self, self.summary.content["estimators"]).transposed()

    @property
    def metrics(self) -> pd.DataFrame:
        """Every metric: estimator, metric (its path in `summary.json`) and value."""
        return metrics_table(self.summary)

    @cached_property
    def verdict(self) -> list[str]:
        """Conclusions in sentences, the trust in the reference first."""
        return verdict(self)

    @property
    def heading(self) -> str:
        """Recording, and reference with its trust."""
        reference = "no reference" if self.reference is None else f"reference {self.reference}"
        return f"Run on {self.problem.sequence.name}: {reference}, {self.trust.verdict.name.lower()}"

    def to_frame(self) -> pd.DataFrame:
        """The table, as `table`."""
        return self.table

    def figures(self) -> "dict[str, Figure]":
        """The figures by name, as the page has them."""
        from ..figures import draw

        return {name: as_cell_value(figure) for name, figure in draw(self).items()}

    def plot(self) -> "Figure":
        """The figure of all paths, from above."""
        return self.figures()["paths_overlaid"]

    @for_python
    def report(self, path: str | os.PathLike[str], *, force: bool = False, processes: int = 1) -> Path:
        """Writes the page alone to `NAME.html`, or the folder of `fgbaseline run`; returns the path of the page.

        `force` replaces an earlier file or folder; `processes` draw the folder's figures. Raises InputError where
        the path exists without `force`, or is a folder that is not that of a run.
        """
        from ..html.run_page import render
        from .folder import write_run

        return write_report(
            path,
            lambda: render(self, self.summary.content, self.figures()),
            lambda folder: write_run(self, folder, processes),
            force=force,
            mark=SUMMARY,
        )


@for_python
def run(
    recording: FilePath | Sequence | Problem | None = None,
    *,
    estimators: str | Solver | Iterable[str | Solver] | Mapping[str, str | Solver] | None = None,
    add: TrajectoryLike | Iterable[TrajectoryLike] | Mapping[str, TrajectoryLike] = (),
    add_body: Literal["imu", "camera"] | None = None,
    add_time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    add_offset: float = 0.0,
    preset: Literal["calibrated", "documented"] = "calibrated",
    features: int | Literal["all"] | None = None,
    landmarks: Literal["in-turn", "held"] = "in-turn",
    truth: FilePath | Trajectory | Truth | Array | tuple[Array, Array] | None = None,
    truth_frame: Literal["imu", "camera"] | None = None,
    truth_up: tuple[float, float, float] | None = None,
    as_recorded: bool = False,
    imu: FilePath | None = None,
    imu_calibration: FilePath | None = None,
    velocities: FilePath | None = None,
    extrinsic: FilePath | None = None,
    cameras: Literal["stereo", "left"] | None = None,
    right: FilePath | None = None,
    calibration: FilePath | None = None,
    times: FilePath | None = None,
    topics: str | Iterable[str] = (),
    settings: FilePath | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    repairs: FilePath | None = None,
    held_out: float = 0.0,
    seed: int = 0,
    processes: int = 1,
    progress: bool = False,
) -> RunReport:
    """Runs estimators on a recording and compares them, as `fgbaseline run` does; nothing is written.

        result = fgbaseline.run("drive.npz", estimators=["ekf", "isam2", my_filter])
        result.table, result.verdict, result.figures()
        result.report("out/drive")

    Args:
        recording: A file, a `Sequence` or a `Problem`; by default a simulated drive with known truth.
        estimators: Registered names, functions `solve(problem, progress=None) -> Estimate`, or "FILE:FUNCTION"; a
            mapping names them. Functions alone run beside the default names, which are those of the command.
        add: Trajectories beside the estimators: as those of `compare_trajectories`, aligned to the reference.
        add_body: Body whose poses they have; by default the imu.
        add_time_unit: Unit of their stamps, where a file leaves it open.
        add_offset: Added to their stamps, s.
        preset: The problem: diagnosed and repaired, or as the source paper has it.
        features: Number of landmarks, those with the most observations; by default all (documented: 1000).
        landmarks: Landmarks of the documented SLAM: updated in turn with the pose, or held.
        truth: Ground truth: a file, a `Truth`, poses (T, 4, 4) by frame, or stamps (n,), s, with poses (n, 4, 4).
        truth_frame: Body whose poses the ground truth has; a `Truth` has those of the imu.
        truth_up: Up in the world of the ground truth of raw inertial data; by default its file's comment `# up x y z`,
            else its z axis within 0.5° of what the samples measure, and beyond that what they measure.
        as_recorded: No diagnosis and no repairs; the noise is assumed.
        imu: CSV of raw inertial samples, in place of the recording's velocities.
        imu_calibration: YAML of their noise; by default assumed.
        velocities: CSV of body velocities, in place of the recording's motion.
        extrinsic: File with imu_T_cam of the left camera, a line of 12 numbers.
        cameras: Of images: a pair, or the left camera alone with raw inertial samples; by default what there is.
        right: Folder of the right images, where the recording is the folder of the left ones.
        calibration: YAML of the cameras of two folders or a bag, Kalibr or OpenCV.
        times: Stamps of the images of two folders, a line for each.
        topics: Topics of a bag: left, right and, if any, the IMU; by default by their types.
        settings: TOML file of the settings of the tracker.
        time_unit: Unit of the recording's stamps; by default detected.
        repairs: TOML file of user-specified repairs.
        held_out: Share of the tracks that diagnosis and estimators do not use; they rank the paths.
        seed: Seed of the simulated drive and of the choice of held-out tracks.
        processes: Number of processes that share diagnosis and comparison.
        progress: Whether progress is printed on standard error.

    Raises InputError, in one sentence, for an invalid recording or keyword. An estimator that raises an exception
    becomes a failed result; the others go on.
    """
    names, functions = named_estimators(() if estimators is None else estimators)
    is_default = estimators is None or (bool(names) and len(functions) == len(names))
    chosen = RunSettings(
        sequence=as_path(recording),
        preset=preset,
        estimators=(*DEFAULT_ESTIMATORS, *names) if is_default else names,
        batch_up_to=BATCH_OBSERVATIONS if is_default else 0,
        functions=functions,
        features=features,
        landmarks=LandmarkMode(landmarks),
        truth=_truth_source(truth),
        truth_frame=truth_frame,
        truth_up=truth_up,
        as_recorded=as_recorded,
        imu=as_path(imu),
        imu_calibration=as_path(imu_calibration),
        velocities=as_path(velocities),
        extrinsic=as_path(extrinsic),
        cameras=cameras,
        right=as_path(right),
        calibration=as_path(calibration),
        times=as_path(times),
        time_unit=None if time_unit is None else TimeUnit(time_unit),
        topics=names_in(topics) if isinstance(topics, str) else tuple(topics),
        tracker=as_path(settings),
        repairs=as_path(repairs),
        held_out=held_out,
        seed=seed,
        add=tuple(opened(each, name=name) for name, each in by_name(add)),
        add_body=add_body,
        add_time_unit=add_time_unit,
        add_offset=add_offset,
    )
    check_estimators(chosen.estimators, chosen.functions)
    sequence = read_sequence(chosen)
    chosen = with_defaults(chosen, sequence)
    added = read_added(chosen)
    kept, held = hold_out_tracks(sequence, chosen)
    problem = build_problem(kept, chosen, processes)
    import_estimators(chosen.estimators)
    watch = no_progress
    if progress:
        from ..progress import reporter

        watch = reporter().estimator
    solved = solve(problem, chosen, watch, held, processes, added)
    return RunReport(**{field.name: getattr(solved, field.name) for field in fields(solved)})


def _truth_source(
    truth: FilePath | Trajectory | Truth | Array | tuple[Array, Array] | None,
) -> Path | Source | Truth | None:
    """Ground truth as `RunSettings` has it: a path that is not read yet, a `Source` or a `Truth`."""
    if isinstance(truth, str | os.PathLike):
        return Path(truth)
    return truth if truth is None or isinstance(truth, Truth) else opened(truth, name="truth")
