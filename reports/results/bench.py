"""Results of a bench: one row per run and estimator, costs apart from the figures that repeat."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from fgbaseline.geometry import FloatArray

from ..bench.job import Planned

OF_THE_RUN = ("run", "case", "sequence", "seed", "reference", "trust", "frames", "features", "observations")
COSTS = ("run", "case", "estimator", "frames", "observations", "seconds", "memory_mb")
ANSWERED = ("ok", "recovered")


@dataclass(frozen=True, eq=False, slots=True)
class Results:
    """All runs of a bench."""

    planned: Sequence[Planned]
    runs: pd.DataFrame
    """one row per run and estimator: `OF_THE_RUN`, the settings that vary, estimator, status, reason and the metrics"""
    costs: pd.DataFrame
    """`COSTS`, one row per run and estimator"""
    summaries: Mapping[str, Mapping[str, Any]]
    """of the runs that did not fail, by name, without timings"""
    failures: Mapping[str, str]
    """of whole runs, by name"""
    nees: Mapping[tuple[str, str], list[FloatArray]]
    """(T,) of each run that has any, by case and estimator"""
    seconds: float
    """of all runs together"""

    @property
    def cases(self) -> list[str]:
        """Their names in the suite's order."""
        return list(dict.fromkeys(planned.case for planned in self.planned))

    @property
    def estimators(self) -> list[str]:
        """Their names in the suite's order."""
        return list(self.planned[0].job.estimators)

    @property
    def references(self) -> dict[str, str]:
        """The reference of each case, where all its runs have the same."""
        of_case = {str(case): set(names) for case, names in self.runs.groupby("case")["reference"]}
        return {case: str(*names) for case, names in of_case.items() if len(names) == 1}

    @property
    def reference(self) -> str | None:
        """The reference of all runs that did not fail; None where they have different ones, or there are none."""
        names = {str(summary["reference"]["name"]) for summary in self.summaries.values()}
        return names.pop() if len(names) == 1 else None
