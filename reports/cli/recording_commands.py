"""Commands on a recording: `run`, `track`, `diagnose` and `export`; `estimators` lists what can run on it."""

from pathlib import Path
from typing import Any

import click

from ..problem import BATCH_OBSERVATIONS, DEFAULT_ESTIMATORS, names_in
from . import options
from .options import PATH


@click.command(epilog="Example: fgbaseline run drive.npz --truth poses.txt --truth-frame camera --out out/drive")
@click.argument("sequence", metavar="[RECORDING]", required=False, type=PATH)
@click.option("--out", type=PATH, help="Folder to write.  [default: out/NAME]")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier run.")
@options.open_page
@options.preset
@click.option(
    "--estimators",
    help=f"Names, separated by commas.  [default: {','.join(DEFAULT_ESTIMATORS)}; with at most {BATCH_OBSERVATIONS:,} "
    "unmasked observations also batch, which then starts at the solution of isam2 only]",
)
@click.option(
    "--estimator",
    "user_estimators",
    multiple=True,
    metavar="[NAME=]FILE:FUNCTION",
    help="Function in a Python file, run in addition to --estimators; repeatable.",
)
@click.option(
    "--add",
    multiple=True,
    type=options.NamedFile(),
    metavar="[NAME=]PATH",
    help="Trajectory file to report in addition to the estimators, aligned to the reference by yaw, or by SE(3) where "
    "the worlds are not level; repeatable.",
)
@click.option(
    "--add-body", type=options.BODY, help="Frame of the poses of --add: world_T_imu or world_T_camera.  [default: imu]"
)
@click.option("--add-time-unit", type=options.UNITS, help="Unit of ambiguous time stamps of --add.")
@click.option("--add-offset", type=float, default=0.0, metavar="S", help="Added to the stamps of --add.")
@options.features
@options.choice(
    "--landmarks",
    "in-turn",
    "held",
    what="With --preset documented: landmarks updated alternately with the pose, or fixed at the result of "
    "landmark-mapping.",
)
@click.option("--truth", type=PATH, help="Ground truth: a trajectory file.")
@click.option(
    "--truth-frame", type=options.BODY, help="Frame of the ground-truth poses: world_T_imu or world_T_camera."
)
@click.option(
    "--truth-up",
    type=options.XYZ,
    help="Raw inertial data: up direction in the world frame of the ground truth.  [default: its file's comment "
    "'# up x y z', else 0,0,1 if the inertial samples agree within 0.5°, else the direction that they measure]",
)
@options.as_recorded
@options.recording_inputs
@options.time_unit
@options.repairs
@options.held_out
@options.seed("the simulated drive and of the choice of held-out tracks")
@click.option(
    "--rerun",
    "rerun_file",
    metavar="FILE.rrd",
    type=PATH,
    help="Write a recording for the viewer Rerun too (needs the extra fgbaseline[rerun]).",
)
def run(
    out: Path | None,
    force: bool,
    opened: bool,
    estimators: str | None,
    user_estimators: tuple[str, ...],
    landmarks: str,
    time_unit: str | None,
    rerun_file: Path | None,
    **given: Any,
) -> int:
    """Run estimators on RECORDING, compare them and write a report.

    RECORDING is a file with tracks, or a folder or ROS bag with images. The tracks of images are written to
    tracks.npz in the folder of the run.

    Without RECORDING, a simulated drive of 60 s through a town is used, with known ground truth.

    Exits 0 when every estimator succeeded, 1 when one failed (the report is written nevertheless), 2 on bad
    input.
    """
    from fgbaseline.data import LandmarkMode, TimeUnit
    from fgbaseline.data.estimators.user_estimator import load_all

    from ..problem.settings import RunSettings
    from ..run.command import run as run_and_report

    functions = load_all(user_estimators)
    names = DEFAULT_ESTIMATORS if estimators is None else names_in(estimators)
    chosen = RunSettings(
        estimators=(*names, *(name for name in functions if name not in names)),
        batch_up_to=BATCH_OBSERVATIONS if estimators is None else 0,
        functions=functions,
        landmarks=LandmarkMode(landmarks),
        time_unit=None if time_unit is None else TimeUnit(time_unit),
        **given,
    )
    return run_and_report(chosen, out, force=force, rerun_file=rerun_file, opened=opened)


@click.command(epilog="Example: fgbaseline track V1_01_easy --out out/tracks.npz")
@click.argument("source", metavar="INPUT", type=PATH)
@click.option("--out", type=PATH, required=True, help="Npz to write.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@options.recording_inputs
def track(source: Path, out: Path, force: bool, tracker: Path | None, **given: Any) -> int:
    """Track the images in INPUT and write their tracks.

    INPUT is a EuRoC, TUM-VI or KITTI folder, a folder of images (with --right for a pair), or a ROS bag.

    Rectified pairs, Lucas-Kanade from frame to frame and from left to right; a track that fails a check ends. With
    one camera (--cameras left, cam0 alone, one topic of images) the epipolar constraint is that check. The npz is a
    recording for run and diagnose. Without motion in INPUT, run needs --imu or --velocities, and --extrinsic.
    """
    from fgbaseline.data.tracking import ImageOptions

    from ..problem.images import write_tracks

    return write_tracks(source, out, ImageOptions(**given), tracker, force=force)


@click.command(epilog="Example: fgbaseline estimators")
def estimators() -> None:
    """List the estimators, with a line each.

    The list includes those of other installed packages.

    Exits 0.
    """
    from fgbaseline.data import estimator_summaries

    from ..open_page import print_sentences

    summaries = estimator_summaries()
    width = max(map(len, summaries))
    for name, summary in summaries.items():
        print_sentences([summary], mark=f"{name:{width}}  ")


@click.command(epilog="Example: fgbaseline diagnose drive.npz --out out/diagnosis")
@click.argument("sequence", metavar="RECORDING", type=PATH)
@click.option("--out", type=PATH, help="Folder for diagnosis.json, figures and page.")
@click.option("--json", "as_json", is_flag=True, help="Print diagnosis.json alone on standard output.")
@click.option("--write-repairs", type=PATH, help="TOML file of the repairs, to edit and to use with run --repairs.")
@options.recording_inputs
@options.time_unit
@click.option("--force", is_flag=True, help="Replace the folder, or the repairs, of an earlier diagnosis.")
@options.open_page
def diagnose(
    sequence: Path,
    out: Path | None,
    as_json: bool,
    write_repairs: Path | None,
    time_unit: str | None,
    force: bool,
    opened: bool,
    **given: Any,
) -> int:
    """Detect the faults of RECORDING and estimate its noise.

    Faults: wrong units, axes, extrinsic or matches, gyroscope bias, time offset, velocity scale error, repeated images.
    Ground truth in the file is not used. `fgbaseline run` repairs the faults that are detected here.

    Exits 0 without findings, 1 with findings, 2 when the data do not suffice for a diagnosis, and on bad input.
    """
    from fgbaseline.data import TimeUnit

    from ..problem.construction import read_sequence
    from ..problem.settings import RunSettings
    from ..run.diagnose import print_diagnosis

    unit = None if time_unit is None else TimeUnit(time_unit)
    recording = read_sequence(RunSettings(sequence=sequence, time_unit=unit, **given))
    return print_diagnosis(recording, out, as_json=as_json, repairs=write_repairs, force=force, opened=opened)


@click.command(epilog="Example: fgbaseline export drive.npz --out out/problem")
@click.argument("sequence", metavar="RECORDING", type=PATH)
@click.option("--out", type=PATH, required=True, help="Folder to write.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier export.")
@options.preset
@options.features
@options.recording_inputs
@options.as_recorded
@options.repairs
@options.held_out
@options.seed("the choice of held-out tracks")
def export(out: Path, force: bool, **given: Any) -> int:
    """Write the problem that run solves on RECORDING.

    The npz, CSV and JSON files hold repaired velocities, increments with covariances, observations with the mask,
    noise, kernel, priors, calibration and time stamps. A filter in any language can solve the same problem;
    `fgbaseline compare` reads its trajectory. Ground truth is not exported.

    Exits 0, or 2 on bad input.
    """
    from ..problem.settings import RunSettings
    from ..run.command import export as export_problem

    return export_problem(RunSettings(**given), out, force=force)
