"""What a person sees of a reproduction: progress, the claims, and where the report is."""

from collections.abc import Sequence as Several
from pathlib import Path

import click
from threadpoolctl import threadpool_limits

from fgbaseline.geometry import InputError

from ..cli.progress import reporter
from ..whole_folder import require_free, whole_folder
from .claim import Claim
from .claims import claims_of, missing_claims
from .folder import MARK, Reproduction, write
from .study import SweepSettings, stages_of, study
from .subjects import read_subjects

UNWRAPPED = 150
"""columns of the table where no terminal says how many there are"""


def reproduce(paths: Several[Path], out: Path, sweep: SweepSettings, *, force: bool) -> int:
    """Studies the recordings, writes the folder and tells of the claims; gives the exit code.

    Raises InputError for what cannot be read, and where the folder may not be written.
    """
    require_free(out, force=force, mark=MARK)
    _check(sweep)
    told = reporter()
    subjects = read_subjects(paths)
    studies = []
    with threadpool_limits(limits=1, user_api="blas"):
        for subject in subjects:
            if subject.stand_in is None:
                told.say(f"{subject.name}: diagnosing the recording")
            else:
                told.say(f"{subject.name}: {subject.stand_in.remark}")
            found = stages_of(subject)
            with told.estimator(subject.name) as progress:
                studies.append(study(subject, sweep, found, progress))
    claims = [*(claim for one in studies for claim in claims_of(one)), *missing_claims(studies)]
    told.say("writing the report")
    with whole_folder(out, force=force, mark=MARK) as folder:
        write(Reproduction(studies, claims), folder)
    _print(claims)
    click.echo(f"\nThe report is in {out / 'report.html'}")
    return 0


def _check(sweep: SweepSettings) -> None:
    for name, values in (("sweep-features", sweep.features), ("sweep-noise", sweep.pixel_variances)):
        if len(set(values)) < len(values):
            raise InputError(f"{name}: a value is given twice in {', '.join(f'{v:g}' for v in values)}; give each once")


def _print(claims: Several[Claim]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 1, 0))
    for title in ("recording", "the report says", "verdict", "measured"):
        table.add_column(title, overflow="fold")
    for claim in claims:
        name = f"{claim.recording} (simulated)" if claim.simulated else claim.recording
        table.add_row(*map(Text, (name, claim.claim, str(claim.verdict), claim.measured)))
    console = Console()
    Console(width=None if console.is_terminal else max(console.width, UNWRAPPED), highlight=False).print(table)
