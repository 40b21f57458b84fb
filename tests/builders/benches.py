"""A small bench, and what of its folder has to be the same however it came about."""

from pathlib import Path

SUITE = """
name = "small"
estimators = ["dead-reckoning", "joint-ekf", "isam2"]

[[sequence]]
name = "town"
simulate = { path = "town", duration = 2, features_per_frame = 10 }
seeds = { count = 2, first = 1 }

[[sequence]]
name = "room"
simulate = { path = "handheld", duration = 1.5, features_per_frame = [8, 12] }
"""
N_RUNS = 4


def written(folder: Path, text: str = SUITE) -> Path:
    """The suite's file."""
    path = folder / "suite.toml"
    path.write_text(text)
    return path


def tables_of(folder: Path) -> dict[str, bytes]:
    """Every table by name, `summary.json` among them; timings are in others."""
    tables = {path.name: path.read_bytes() for path in (folder / "tables").iterdir()}
    assert {"cases.csv", "runs.csv", "rankings.csv", "consistency.csv", "nees_over_time.csv", "table.md"} <= set(tables)
    return {**tables, "summary.json": (folder / "summary.json").read_bytes()}
