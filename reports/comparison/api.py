"""Comparison in one call: for the command, and as `fgbaseline.compare_trajectories` with arrays in place of files.

All files are opened, and faults in them reported, before anything heavy is imported.
"""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
from fgbaseline.data.formats.files.file_errors import FilePath, as_path
from fgbaseline.data.formats.trajectories.format_detection import open_named
from fgbaseline.geometry import InputError

from ..python_interface import for_python

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Run
    from fgbaseline.data import Landmarks, Problem, Sequence

    from .inputs import Given, GivenLandmarks
    from .report import ComparisonReport
    from .sources import Array, TrajectoryLike

FILES = ("sequence", "extrinsic")
Triple = tuple[float, float, float]


@for_python
def compare_trajectories(
    reference: "TrajectoryLike | Run",
    estimates: "TrajectoryLike | Iterable[TrajectoryLike] | Mapping[str, TrajectoryLike]",
    *,
    align: Literal["none", "first-pose", "yaw", "se3", "sim3"] | None = None,
    align_first: int | None = None,
    up: Triple | None = None,
    association: Literal["nearest", "interpolated"] = "nearest",
    tolerance: float | None = None,
    offset: float = 0.0,
    search_offset: float | None = None,
    deltas: Iterable[str] = (),
    all_pairs: bool = False,
    form: Literal["tum", "kitti", "euroc", "npz"] | None = None,
    times: "FilePath | Array | Iterable[FilePath | Array]" = (),
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    quaternion: Literal["xyzw", "wxyz"] | None = None,
    lever_arm: Triple | None = None,
    align_body: bool = False,
    sequence: "FilePath | Sequence | Problem | None" = None,
    landmarks: "Mapping[str, FilePath | Landmarks] | Iterable[FilePath]" = (),
    held_out: float = 0.0,
    reference_body: Literal["imu", "camera"] = "imu",
    estimate_body: Literal["imu", "camera"] = "imu",
    extrinsic: "FilePath | Array | None" = None,
    beside: str = "all",
    seed: int = 0,
) -> "ComparisonReport":
    """Compares trajectories with a reference, as `fgbaseline compare` does.

        result = fgbaseline.compare_trajectories("truth.tum", {"mine": (t, poses)}, align="yaw")
        result.table, result.verdict, result.figures()
        result.report("out/comparison")

    A trajectory is a file (TUM, KITTI, EuRoC, npz), a `Trajectory`, stamps (n,), s, with poses (n, 4, 4) or positions
    (n, 3), or by frame: poses (T, 4, 4), an `Estimate` or a `Truth`. Frames have the stamps of `sequence`.

    Args:
        reference: A trajectory, the folder of a run, or the result of `fgbaseline.run`. Of a run, the other estimators
            are compared too, and the trust in its reference is stated.
        estimates: One trajectory, several, or several by name.
        align: Alignment of each estimate; by default "none" against a run, which has the same world, else "se3".
        align_first: Number of poses to align over; by default all.
        up: Up in the reference's world; by default that of its file, format, run or `sequence`, else (0, 0, 1).
        association: Whether poses are paired by the nearest stamp, or interpolated.
        tolerance: Largest time difference of a pair, s; by default 0.01.
        offset: Added to the stamps of the estimates, s.
        search_offset: Half width of a search for the time offset, s; by default none.
        deltas: Lengths of the relative errors, such as "1s", "10m", "30deg", "5frames"; by default "1s" and "10m".
        all_pairs: Relative errors from every pose, not end to end.
        form: Format of the files; by default detected from the content.
        times: Stamps of KITTI files, s: files or arrays, each for the trajectories of its length.
        time_unit: Unit of stamps that the files leave open.
        quaternion: Order of quaternions that the files leave open.
        lever_arm: Position of the reference's point in the body frame of the estimates, m.
        align_body: Remove a constant rotation between the body frames.
        sequence: The recording or problem behind the trajectories, or its file or exported folder: adds reprojection.
        landmarks: Landmarks by the name of their trajectory, in the index of `sequence`; or CSV files `[NAME=]FILE`.
        held_out: Share of the recording's tracks that rank all paths.
        reference_body: Body whose poses the reference has.
        estimate_body: Body whose poses the estimates have.
        extrinsic: `imu_T_cam` (4, 4) or a file of one line; by default that of `sequence`.
        beside: Estimators of a reference run to compare too: names with commas, "all" or "none".
        seed: Seed of the bootstrap and of the held-out tracks.

    Raises InputError, in one sentence, for an invalid trajectory or keyword. No argument is changed.
    """
    options = dict(locals())  # before any other name is bound
    del options["reference"], options["estimates"]
    from .sources import ARRAYS, by_name, opened

    every = [opened(each, form, name) for name, each in by_name(estimates)]
    first = opened(reference, form, "reference") if isinstance(reference, ARRAYS) else reference
    return compare(first, *every, **options)


def compare(
    reference: "Given | Run",
    *estimates: "Given",
    landmarks: "GivenLandmarks | Iterable[FilePath]" = (),
    deltas: Iterable[str] = (),
    drawn: bool = False,
    **options: Any,
) -> "ComparisonReport":
    """Comparison of estimates with a reference, as the command `compare` and `fgbaseline.compare_trajectories` have it.

    Each is a `[NAME=]FILE` or a trajectory in memory; the reference may be a run or its folder. With `drawn`, what
    draws figures is imported meanwhile. The options are the fields of `Settings`; `compare_trajectories` describes
    them. Raises InputError, which names options of the command.
    """
    times = options.pop("times", None)
    if times is None or isinstance(times, str | os.PathLike) or hasattr(times, "shape"):
        times = () if times is None else (times,)
    if not isinstance(times, Iterable):
        raise InputError(f"times: expected files or arrays of stamps, got {type(times).__name__}")
    options["times"] = tuple(map(as_path, times))
    options |= {name: as_path(options[name]) for name in FILES if name in options}
    settings = Settings(**options, deltas=tuple(Delta.parse(text) for text in deltas))

    def opened(given: Any) -> Any:
        return open_named(given, settings.form) if isinstance(given, str | os.PathLike) else given

    is_folder = isinstance(reference, str | os.PathLike) and Path(reference).is_dir()
    first = reference if is_folder else opened(reference)
    others = [opened(each) for each in estimates]
    of_them = landmarks if isinstance(landmarks, Mapping) else list(landmarks)
    from .report import report_of

    return report_of(first, others, of_them, settings, drawn=drawn)
