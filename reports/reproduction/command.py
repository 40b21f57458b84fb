"""`fgbaseline reproduce`, from the recordings to the exit code: progress, claims, and the report's folder."""

from collections.abc import Sequence as Several
from pathlib import Path

import click
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.geometry import InputError

from ..progress import reporter
from ..tables import print_table
from .claims import claims_of, missing_claims
from .folder import MARK, Reproduction, write
from .page import claims_table
from .recordings import read_subjects
from .study import SweepSettings, stages_of, study

UNWRAPPED = 150
"""columns of the table where no terminal says how many there are"""


def reproduce(paths: Several[Path], out: Path, sweep: SweepSettings, *, force: bool) -> int:
    """Studies the recordings, writes the folder and prints the claims; returns the exit code.

    Raises InputError for what cannot be read, and where the folder may not be written.
    """
    require_free(out, force=force, mark=MARK)
    _check(sweep)
    progress_of = reporter()
    subjects = read_subjects(paths)
    studies = []
    with threadpool_limits(limits=1, user_api="blas"):
        for subject in subjects:
            if subject.stand_in is None:
                progress_of.say(f"{subject.name}: diagnosing the recording")
            else:
                progress_of.say(f"{subject.name}: {subject.stand_in.remark}")
            found = stages_of(subject)
            with progress_of.estimator(subject.name) as progress:
                studies.append(study(subject, sweep, found, progress))
    claims = [*(claim for one in studies for claim in claims_of(one)), *missing_claims(studies)]
    progress_of.say("writing the report")
    with atomic_folder(out, force=force, mark=MARK) as folder:
        write(Reproduction(studies, claims), folder)
    print_table(claims_table(claims), width=UNWRAPPED, spaced=True)
    click.echo(f"\nThe report is in {out / 'report.html'}")
    return 0


def _check(sweep: SweepSettings) -> None:
    for name, values in (("sweep-features", sweep.features), ("sweep-noise", sweep.pixel_variances)):
        if len(set(values)) < len(values):
            raise InputError(f"{name}: a value is given twice in {', '.join(f'{v:g}' for v in values)}; give each once")
