"""What the diagnosis found, as the page's table has it."""

from fgbaseline.reports.comparison import Run

from ..formatting import quantity


def findings(run: Run) -> list[dict[str, str]]:
    """Sentence, certainty (empty for what is counted), and the figures before and after, as text."""
    return [
        {
            "sentence": finding.sentence,
            "certainty": "" if finding.certainty == "counted" else finding.certainty,
            "before": quantity(finding.before, finding.unit),
            "after": quantity(finding.after, finding.unit),
        }
        for finding in run.problem.findings
    ]
