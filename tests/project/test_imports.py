"""Heavy packages are imported where they are used: which ones each command loads, and names imported on first use."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data

HEAVY = ("numpy", "scipy", "pandas", "pydantic", "matplotlib", "gtsam", "rich", "jinja2", "PIL", "joblib", "yaml")
LAZY = (
    "fgbaseline.geometry",
    "fgbaseline.data",
    "fgbaseline.data.formats",
    "fgbaseline.compare",
    "fgbaseline.reports.figures",
)
LOADED = f"import sys; print(*(name for name in {HEAVY!r} if name in sys.modules), file=sys.stderr)"
COMMAND = f"""
import atexit
atexit.register(lambda: exec({LOADED!r}, {{}}))
from fgbaseline.reports.cli import main
main()
"""


def loaded(code: str, *arguments: object) -> set[str]:
    """Heavy packages that are loaded when the code, with these arguments, has ended."""
    words = [sys.executable, "-c", code, *map(str, arguments)]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    return set(ended.stderr.splitlines()[-1].split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("imports")
    poses = np.repeat(np.eye(4)[None], 60, axis=0)
    poses[:, 0, 3] = np.arange(60.0)
    poses[:, 1, 3] = np.sin(np.arange(60.0))
    data.write_tum(place / "truth.tum", 0.1 * np.arange(60), poses)
    poses[:, 2, 3] = 0.01 * np.arange(60.0)
    data.write_tum(place / "mine.tum", 0.1 * np.arange(60), poses)
    data.write_tum(place / "later.tum", 1e3 + 0.1 * np.arange(60), poses)
    (place / "broken.tum").write_text("0 0 0 0 0 0 0 1\n1 here 0 0 0 0 0 1\n")
    (place / "run").mkdir()
    (place / "run" / "summary.json").write_text("{")
    (place / "limits.toml").write_text("limit = 1\n")
    (place / "broken.toml").write_text("limit = [\n")
    return place


def test_help_and_faults_of_files_load_nothing_heavy(folder: Path) -> None:
    truth, limits = folder / "truth.tum", folder / "limits.toml"
    for arguments in (
        ["--help"],
        ["compare", truth, folder / "missing.tum"],
        ["compare", truth, folder / "broken.tum"],
        ["check", folder / "missing", "--limits", limits],
        ["check", folder / "run", "--limits", limits],
        ["check", folder / "run", "--limits", folder / "broken.toml"],
        ["figures", folder / "missing"],
        ["figures", folder / "run"],
    ):
        assert not loaded(COMMAND, *arguments), arguments


def test_a_comparison_on_the_terminal_loads_numpy_and_rich(folder: Path) -> None:
    assert loaded(COMMAND, "compare", folder / "truth.tum", folder / "mine.tum") == {"numpy", "rich"}


def test_poses_without_partners_are_refused_before_what_draws_is_imported(folder: Path) -> None:
    given = ["compare", folder / "truth.tum", folder / "later.tum", "--out", folder / "none"]
    assert loaded(COMMAND, *given) <= {"numpy"}


def test_its_page_loads_no_pandas_no_scipy_and_no_gtsam(folder: Path) -> None:
    given = ["compare", folder / "truth.tum", folder / "mine.tum", "--out", folder / "out"]
    assert not loaded(COMMAND, *given) & {"pandas", "scipy", "gtsam", "joblib"}


@pytest.mark.parametrize("what", ["fgbaseline.compare", "fgbaseline.reports.comparison", *LAZY])
def test_importing_a_package_loads_nothing_heavy(what: str) -> None:
    assert not loaded(f"import {what}\n{LOADED}")


@pytest.mark.parametrize("package", [*LAZY, "fgbaseline.reports.comparison"])
def test_names_imported_on_use_are_those_that_type_checkers_see(package: str) -> None:
    """The imports under TYPE_CHECKING, the table of `lazy_names` and `__all__` agree, name by name."""
    module = import_module(package)
    assert module.__file__ is not None
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    imported = {
        alias.name: node.module or alias.name
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    (table,) = (node for each in block.orelse for node in ast.walk(each) if isinstance(node, ast.Dict))
    homes = {name: home for home, names in ast.literal_eval(table).items() for name in names.split()}
    assert homes == imported
    eager = {a.name for node in tree.body if isinstance(node, ast.ImportFrom) and node.level for a in node.names}
    assert {*homes, *eager} == set(module.__all__)
    assert {*module.__all__} <= {*dir(module)}  # what editors complete
    for name in module.__all__:
        getattr(module, name)


@pytest.mark.parametrize("package", LAZY)
def test_no_name_is_also_that_of_a_module_beside_it(package: str) -> None:
    """Importing a module sets its name in the package, which would hide a function of the same name."""
    module = import_module(package)
    beside = {path.stem for place in module.__path__ for path in Path(place).iterdir()}
    attributes = {name: getattr(module, name) for name in module.__all__ if name in beside}
    assert all(type(found).__name__ == "module" for found in attributes.values()), attributes


def test_every_benchmark_can_be_imported() -> None:
    root = Path(__file__).parents[2]
    modules = [f"benchmarks.{path.stem}" for path in sorted((root / "benchmarks").glob("*.py"))]
    code = f"from importlib import import_module\nfor name in {modules!r}: import_module(name)"
    result = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
