"""The report of a bench: tables that are the same every time, what depends on the machine apart, figures and page."""

import pandas as pd

from ..figures.bench import draw
from ..figures.saving import encoded
from . import tables
from .grid import main_grid
from .page import render
from .results import Results
from .store import Store
from .summary import summarised
from .text import latex, markdown

TABLES, COSTS, FIGURES = "tables", "costs", "figures"


def write_report(name: str, results: Results, store: Store) -> None:
    """Writes all of it, each file whole or as it was; `summary.json` last."""
    same = {
        "cases": tables.cases(results),
        "runs": results.runs,
        "rankings": tables.rankings(results),
        "overall": tables.overall(results),
        "consistency": tables.consistency(results),
        "nees_over_time": tables.nees_over_time(results),
    }
    for title, table in same.items():
        if len(table):
            store.write(f"{TABLES}/{title}.csv", _csv(table))
    grid = main_grid(results, with_costs=False)
    store.write(f"{TABLES}/table.md", markdown(grid).encode())
    store.write(f"{TABLES}/table.tex", latex(grid).encode())
    store.write(f"{COSTS}/cases.csv", _csv(tables.costs(results)))
    store.write(f"{COSTS}/runs.csv", _csv(results.costs))
    with_costs = main_grid(results, with_costs=True)
    store.write(f"{COSTS}/table.md", markdown(with_costs).encode())
    store.write(f"{COSTS}/table.tex", latex(with_costs).encode())
    figures = draw(results, tables.judge(results), tables.cases(results), tables.costs(results))
    for title, figure in figures.items():
        for form in ("png", "svg"):
            store.write(f"{FIGURES}/{title}.{form}", encoded(figure, form))
    store.write("report.html", render(name, results, figures).encode())
    store.write("summary.json", summarised(name, results).encode())


def _csv(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False, float_format="%.9g", lineterminator="\n").encode()
