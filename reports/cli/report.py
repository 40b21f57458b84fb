"""What a person sees of a run: progress, the main table and where the report is."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fgbaseline.data.forks import cores, shared
from fgbaseline.data.plural import plural

from .. import job
from ..whole_folder import require_free, whole_folder

if TYPE_CHECKING:
    from ..schema import Summary

FAILED = 1
UNWRAPPED = 120
"""columns of the table where no terminal says how many there are"""


def report(settings: job.RunSettings, out: Path | None, *, force: bool, rerun_file: Path | None = None) -> int:
    """Runs, writes the folder and tells of it; gives the exit code: 1 where an estimator failed, else 0."""
    job.check_estimators(settings.estimators)
    sequence = job.read_sequence(settings)
    place = out or Path("out") / sequence.name
    require_free(place, force=force, mark=job.MARK)
    if rerun_file is not None:
        from ..rerun_file import require_rerun

        require_rerun(rerun_file)

    kept, held = job.split(sequence, settings)

    from ..progress import reporter

    told = reporter()
    told.say(
        f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} "
        f"of {plural(sequence.n_landmarks, 'track')}"
    )
    if held is not None:
        told.say(f"{plural(held.n_tracks, 'track')} held out, {plural(len(held.observations), 'observation')}")
    if settings.preset == "calibrated" and not settings.as_recorded:
        told.say("diagnosing the recording")
    with shared(lambda _: job.pose_problem(kept, settings, cores()), 1, cores()) as posed:
        # Two seconds of imports: bad input is told before, and the diagnosis goes on meanwhile.
        from .. import html
        from ..run_folder import write_run

        job.load_estimators(settings.estimators)
        (problem,) = posed()
    for sentence in job.to_print_first(problem):
        click.echo(sentence)
    run = job.solve(problem, settings, told.estimator, held, cores())
    for name, result in run.results.items():
        if not result.answered:
            told.say(f"{name} failed: {result.estimate.reason}")
    told.say("writing the report")
    with whole_folder(place, force=force, mark=job.MARK) as folder:
        summary = write_run(run, folder, cores())
        if rerun_file is not None:
            from ..rerun_file import write_rerun

            write_rerun(run, rerun_file)
    _print_table(summary)
    for sentence in html.verdict(run):
        click.echo(sentence)
    click.echo(f"\nThe report is in {place / 'report.html'}")
    return 0 if len(run.answered) == len(run.results) else FAILED


def _print_table(summary: "Summary") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    has_truth = any(e.ate is not None for e in summary.estimators.values())
    for title in ("estimator", "status", "seconds", "reprojection, px", "under 3 px", "from the reference, m"):
        table.add_column(title, justify="left" if title in ("estimator", "status") else "right")
    if has_truth:
        table.add_column("ATE, m", justify="right")
    uneven = len({e.coverage for e in summary.estimators.values()}) > 1
    if uneven:
        table.add_column("coverage", justify="right")
    for name, e in summary.estimators.items():
        row = [
            name,
            e.status,
            f"{e.seconds:.1f}",
            _number(e.reprojection.median),
            _share(e.reprojection.under_3px),
            "reference"
            if name == summary.reference.name
            else _number(None if e.divergence is None else e.divergence.rmse),
        ]
        table.add_row(
            *row,
            *([_number(None if e.ate is None else e.ate.rmse)] if has_truth else []),
            *([f"{e.coverage:.1%}"] if uneven else []),
        )
    console = Console()
    Console(width=None if console.is_terminal else max(console.width, UNWRAPPED)).print(table)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.0%}"
