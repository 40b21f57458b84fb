"""`fgbaseline run` and `fgbaseline export`: progress, output folder, and the results on the terminal."""

from pathlib import Path

import click

from fgbaseline.data import Excluded, Problem, write_npz
from fgbaseline.data.formats.files.atomic_folder import atomic_folder, require_free
from fgbaseline.data.parallel import background_map, cores
from fgbaseline.data.problem_export import layout, write_problem
from fgbaseline.data.tracking import Pictures
from fgbaseline.data.wording import plural

from ..open_page import announce, print_sentences
from ..problem.construction import TRACKS, build_problem, hold_out_tracks, preliminary_remarks, read_sequence
from ..problem.settings import RunSettings, check_estimators, import_estimators, with_defaults
from ..results.json_files import SUMMARY

FAILED = 1
UNWRAPPED = 120
"""columns of the table where no terminal says how many there are"""


def run(
    settings: RunSettings, out: Path | None, *, force: bool, rerun_file: Path | None = None, opened: bool = False
) -> int:
    """Runs the estimators, writes the folder, prints the main results; returns 1 where an estimator failed, else 0."""
    check_estimators(settings.estimators, settings.functions)
    pictures = Pictures()
    sequence = read_sequence(settings, pictures)
    settings = with_defaults(settings, sequence)
    place = out or Path("out") / sequence.name
    require_free(place, force=force, mark=SUMMARY)
    if rerun_file is not None:
        from .rerun import require_rerun

        require_rerun(rerun_file)

    if settings.add or settings.add_body or settings.add_time_unit or settings.add_offset:
        from .estimation import read_added

        added = read_added(settings)
    else:
        added = None
    kept, held = hold_out_tracks(sequence, settings)

    from ..progress import reporter

    progress = reporter()
    progress.print_line(
        f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} "
        f"of {plural(sequence.n_landmarks, 'track')}"
    )
    if held is not None:
        n_observations = plural(len(held.observations), "observation")
        progress.print_line(f"{plural(held.n_tracks, 'track')} held out, with {n_observations}")
    if settings.preset == "calibrated" and not settings.as_recorded:
        progress.print_line("diagnosing the recording")
    with background_map(lambda _: build_problem(kept, settings, cores()), 1, cores()) as built:
        # Two seconds of imports: bad input is reported before, and the diagnosis goes on meanwhile.
        from ..phrases.evidence import FIRST
        from ..phrases.run import verdict
        from ..tables.run import terminal_table
        from ..tables.writers import print_table
        from .estimation import solve
        from .folder import write_run

        import_estimators(settings.estimators)
        (problem,) = built()
    for sentence in preliminary_remarks(problem):
        click.echo(sentence)
    if 0 < settings.batch_up_to < int(problem.mask.sum()) and "isam2" in settings.estimators:
        many = plural(int(problem.mask.sum()), "observation")
        progress.print_line(
            f"batch is left out: {many}, by default up to {settings.batch_up_to:,}; --estimators adds it"
        )
    solved = solve(problem, settings, progress.estimator, held, cores(), added)
    for name, result in solved.results.items():
        if not result.answered:
            progress.print_line(f"{name} failed: {result.estimate.reason}")
    progress.print_line("writing the report")
    with atomic_folder(place, force=force, mark=SUMMARY) as folder:
        summary = write_run(solved, folder, cores(), pictures)
        if pictures.size is not None:
            write_npz(sequence, folder / TRACKS, tracks=sequence.observations)
        if rerun_file is not None:
            from .rerun import write_rerun

            write_rerun(solved, rerun_file)
    print_table(terminal_table(solved, summary.content["estimators"]), width=UNWRAPPED)
    click.echo()
    print_sentences(verdict(solved), FIRST)
    print_sentences([f"{name}: {text}." for name, text in solved.added.items()], mark="")
    announce(place / "report.html", opened=opened)
    return 0 if len(solved.answered) == len(solved.results) else FAILED


def export(settings: RunSettings, out: Path, *, force: bool) -> int:
    """Writes the problem of a recording into a folder and prints its contents; returns 0."""
    require_free(out, force=force, mark=layout.SCALARS)
    sequence, held = hold_out_tracks(read_sequence(settings), settings)
    problem = build_problem(sequence, settings)
    with atomic_folder(out, force=force, mark=layout.SCALARS) as folder:
        write_problem(problem, folder)
    for sentence in _contents(problem):
        click.echo(sentence)
    if held is not None:
        click.echo(f"Held out, not in the problem: {plural(held.n_tracks, 'track')}")
    click.echo(f"\nThe problem is in {out}; docs/export.md describes its files")
    return 0


def _contents(problem: Problem) -> list[str]:
    sigma = problem.pixel_variance**0.5
    kernel = "no kernel" if problem.kernel is None else f"Huber kernel at {problem.kernel.threshold:g} sigma"
    prior = "no landmark prior" if problem.landmark_prior is None else "a prior on every landmark"
    excluded = int((problem.excluded != Excluded.NO).sum())
    return [
        f"{problem.sequence.name}, {problem.preset}: {plural(problem.n_frames, 'frame')}, "
        f"{plural(int(problem.mask.sum()), 'observation')} of {plural(len(problem.features), 'landmark')}; "
        f"{plural(excluded, 'observation')} excluded",
        f"Pixel sigma {sigma:.3g} px, {kernel}, {prior}",
        *problem.remarks,
        *problem.repairs,
    ]
