"""Do the tests notice a small error in `compare` or `ekf`? `python -m benchmarks.mutants` writes docs/mutants.md.

mutmut needs the package where Python imports it from, and our rooms are renamed when they are installed: so it works
on a copy in out/mutants, in which they are folders of `fgbaseline`. Of the mutants of each module a random sample is
tried.
"""

import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import click
from scipy.stats import beta

from . import docs_table
from .packages import ROOMS, TOP

PLACE = Path("out/mutants")
PAGE = Path("docs/mutants.md")
DIED = (1, 3, 24, -24, 36, 152, 255, -9, -11)
"""exit codes: a test failed, pytest itself did, the time ran out, the process was lost"""
SURVIVED = 0


@dataclass(frozen=True)
class Mutant:
    """A change of one expression, and what the tests said to it (None: it was not tried)."""

    name: str
    module: str
    code: int | None


def copied() -> None:
    """The tree as it is installed, with its tests; what an earlier run has found is kept for what did not change."""
    shutil.copytree(TOP, PLACE / "fgbaseline", dirs_exist_ok=True)
    for room in ROOMS:
        shutil.copytree(room, PLACE / "fgbaseline" / room, dirs_exist_ok=True)
    for folder in ("tests", "docs", "suites"):
        shutil.copytree(folder, PLACE / folder, dirs_exist_ok=True)
    shutil.copy("pyproject.toml", PLACE)


def mutants() -> list[Mutant]:
    """All there are, by module."""
    found = []
    root = PLACE / "mutants" / "fgbaseline"
    for path in sorted(root.rglob("*.meta")):
        module = path.relative_to(root).as_posix().removesuffix(".meta")
        codes = json.loads(path.read_text(encoding="utf-8"))["exit_code_by_key"]
        found += [Mutant(name, module, code) for name, code in codes.items()]
    return found


def mutmut(*arguments: str) -> None:
    """Runs it in the copy."""
    recordings = Path(os.environ.get("FGBASELINE_RECORDINGS", "../shared/data")).resolve()
    env = {**os.environ, "FGBASELINE_RECORDINGS": str(recordings)}
    program = Path(sys.executable).with_name("mutmut")
    subprocess.run([program, *arguments], cwd=PLACE, env=env, check=False)


def sampled(everything: list[Mutant], per_module: int, seed: int) -> list[Mutant]:
    """So many of each module, the same every time."""
    by_module: dict[str, list[Mutant]] = {}
    for mutant in everything:
        by_module.setdefault(mutant.module, []).append(mutant)
    chosen = []
    for module, of in by_module.items():
        chosen += random.Random(f"{seed} {module}").sample(of, min(per_module, len(of)))
    return chosen


def interval(died: int, n: int) -> tuple[float, float]:
    """95 % of Clopper and Pearson, per cent."""
    low = beta.ppf(0.025, died, n - died + 1) if died else 0.0
    high = beta.ppf(0.975, died + 1, n - died) if died < n else 1.0
    return 100.0 * float(low), 100.0 * float(high)


def table(everything: list[Mutant], tried: list[Mutant]) -> list[str]:
    """A row for each module, each room, and all."""
    rows = ["| module | mutants | tried | died | of those tried |", "|---|---|---|---|---|"]
    modules = sorted({mutant.module for mutant in everything})
    for name in (*modules, "compare/", "ekf/", ""):
        all_of, of = ([m for m in some if m.module.startswith(name)] for some in (everything, tried))
        died = sum(m.code in DIED for m in of)
        title = name if name in modules else f"**{name or 'both'}**"
        if of:
            rows.append(f"| {title} | {len(all_of):,} | {len(of)} | {died} | {100.0 * died / len(of):.0f} % |")
    return rows


def weighted(everything: list[Mutant], tried: list[Mutant]) -> float:
    """Per cent of all mutants that would die: each module's share by how many mutants it has."""
    there, died = Counter(m.module for m in everything), Counter(m.module for m in tried if m.code in DIED)
    of = Counter(m.module for m in tried)
    return 100.0 * sum(there[name] * died[name] / of[name] for name in of) / sum(there[name] for name in of)


def difference(name: str) -> str:
    """The change, on one line."""
    program = Path(sys.executable).with_name("mutmut")
    diff = subprocess.run([program, "show", name], cwd=PLACE, capture_output=True, text=True, check=False).stdout
    changed = [line for line in diff.splitlines() if re.match(r"[-+](?![-+])", line)]
    return "  →  ".join(" ".join(line[1:].split()) for line in changed)


@click.command()
@click.option("--per-module", default=5, show_default=True, help="how many mutants of each module are tried; 0: all")
@click.option("--seed", default=3, show_default=True, help="which of them")
def main(per_module: int, seed: int) -> None:
    """Try mutants, and write the table; survivors are printed with their change."""
    copied()
    stats = PLACE / "mutants" / "mutmut-stats.json"
    if not stats.is_file():
        mutmut("run", "--max-children", "1", "fgbaseline.compare.acceptance_limits.*")
    if not stats.is_file():
        raise click.ClickException("the selected tests do not pass without a mutant: see above")
    chosen = {mutant.name for mutant in sampled(mutants(), per_module or 10**9, seed)}
    mutmut("run", "--max-children", "1", *sorted(chosen))
    everything = mutants()
    tried = [mutant for mutant in everything if mutant.name in chosen]
    counts = Counter("died" if m.code in DIED else "survived" if m.code == SURVIVED else "no test" for m in tried)
    low, high = interval(counts["died"], len(tried))
    share = 100.0 * counts["died"] / len(tried)
    said = (
        f"Of {len(everything):,} mutants {len(tried)} were tried: {counts['died']} died, {counts['survived']} survived,"
        f" {counts['no test']} are in functions that no selected test runs. {share:.1f} % died (95 % interval {low:.1f}"
        f" to {high:.1f} %); {weighted(everything, tried):.1f} % where each module counts by its mutants."
    )
    docs_table.write(PAGE, "mutants", [said, "", *table(everything, tried)])
    for mutant in tried:
        if mutant.code not in DIED:
            click.echo(f"{mutant.name}\n    {difference(mutant.name)}")


if __name__ == "__main__":
    main()
