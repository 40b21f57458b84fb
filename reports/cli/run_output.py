"""Run on the terminal: progress, the main table, the verdict and where the report is."""

from pathlib import Path

import click

from fgbaseline.data.formats import write_npz
from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.data.parallel import cores, shared
from fgbaseline.data.plural import plural
from fgbaseline.data.tracking import has_images
from fgbaseline.reports.run.problem import (
    MARK,
    TRACKS,
    RunSettings,
    check_estimators,
    load_estimators,
    pose_problem,
    read_sequence,
    solve,
    split,
    to_print_first,
)

FAILED = 1
UNWRAPPED = 120
"""columns of the table where no terminal says how many there are"""


def report(settings: RunSettings, out: Path | None, *, force: bool, rerun_file: Path | None = None) -> int:
    """Runs, writes the folder and prints the main results; gives the exit code: 1 where an estimator failed, else 0."""
    check_estimators(settings.estimators)
    sequence = read_sequence(settings)
    place = out or Path("out") / sequence.name
    require_free(place, force=force, mark=MARK)
    if rerun_file is not None:
        from fgbaseline.reports.run.rerun import require_rerun

        require_rerun(rerun_file)

    kept, held = split(sequence, settings)

    from fgbaseline.reports.progress import reporter

    progress = reporter()
    progress.say(
        f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} "
        f"of {plural(sequence.n_landmarks, 'track')}"
    )
    if held is not None:
        progress.say(f"{plural(held.n_tracks, 'track')} held out, {plural(len(held.observations), 'observation')}")
    if settings.preset == "calibrated" and not settings.as_recorded:
        progress.say("diagnosing the recording")
    with shared(lambda _: pose_problem(kept, settings, cores()), 1, cores()) as posed:
        # Two seconds of imports: bad input is reported before, and the diagnosis goes on meanwhile.
        from fgbaseline.reports.phrases.run import verdict
        from fgbaseline.reports.run.folder import as_dict, write_run
        from fgbaseline.reports.tables import print_table
        from fgbaseline.reports.tables.run import terminal_table

        load_estimators(settings.estimators)
        (problem,) = posed()
    for sentence in to_print_first(problem):
        click.echo(sentence)
    run = solve(problem, settings, progress.estimator, held, cores())
    for name, result in run.results.items():
        if not result.answered:
            progress.say(f"{name} failed: {result.estimate.reason}")
    progress.say("writing the report")
    with atomic_folder(place, force=force, mark=MARK) as folder:
        summary = write_run(run, folder, cores())
        if settings.sequence is not None and has_images(settings.sequence):
            write_npz(sequence, folder / TRACKS, flat=True)
        if rerun_file is not None:
            from fgbaseline.reports.run.rerun import write_rerun

            write_rerun(run, rerun_file)
    print_table(terminal_table(as_dict(summary)["estimators"], summary.reference.name), width=UNWRAPPED)
    for sentence in verdict(run):
        click.echo(sentence)
    click.echo(f"\nThe report is in {place / 'report.html'}")
    return 0 if len(run.answered) == len(run.results) else FAILED
