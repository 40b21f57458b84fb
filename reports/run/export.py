"""Export of a posed problem into a folder, with a summary of it on the terminal."""

from pathlib import Path

import click

from fgbaseline.data import Excluded, Problem
from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.data.plural import plural
from fgbaseline.data.problem_export import layout, write_problem
from fgbaseline.reports.run.problem import RunSettings, pose_problem, read_sequence, split


def export(settings: RunSettings, out: Path, *, force: bool) -> int:
    """Poses the problem of a recording, writes it into the folder and prints what it holds; gives the exit code."""
    require_free(out, force=force, mark=layout.SCALARS)
    sequence, held = split(read_sequence(settings), settings)
    problem = pose_problem(sequence, settings)
    with atomic_folder(out, force=force, mark=layout.SCALARS) as folder:
        write_problem(problem, folder)
    for sentence in _sentences(problem):
        click.echo(sentence)
    if held is not None:
        click.echo(f"Held out, and not in the problem: {plural(held.n_tracks, 'track')}")
    click.echo(f"\nThe problem is in {out}; docs/export.md describes its files")
    return 0


def _sentences(problem: Problem) -> list[str]:
    sequence = problem.sequence
    sigma = problem.pixel_variance**0.5
    kernel = "no kernel" if problem.kernel is None else f"Huber's kernel at {problem.kernel.threshold:g} sigma"
    left_out = int((problem.excluded != Excluded.NO).sum())
    return [
        f"{sequence.name}, {problem.preset}: {plural(problem.n_frames, 'frame')}, "
        f"{plural(int(problem.mask.sum()), 'observation')} of "
        f"{plural(len(problem.features), 'landmark')}; left out: {left_out:,}",
        f"{sigma:.3g} px, {kernel}, "
        + ("no prior on landmarks" if problem.landmark_prior is None else "a prior on every landmark"),
        *problem.remarks,
        *problem.repairs,
    ]
