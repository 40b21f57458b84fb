"""The wheel has all our packages and nothing else, installs into an empty environment, and shadows no other module."""

import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from ..builders.commands import environment

ROOT = Path(__file__).parents[2]
ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare", "reports")
TOP = "package"
"""the folder of the package itself, beside its rooms"""
DESCRIBED = ("pyproject.toml", "README.md", "LICENSE", "MANIFEST.in")


@dataclass(frozen=True)
class Built:
    """The two forms a release has."""

    wheel: Path
    sdist: Path


def run(*command: str | Path, cwd: Path, **env: str) -> str:
    """Standard output of a command that must succeed."""
    result = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=environment(**env),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, f"{command}: {result.stdout}{result.stderr}"
    return result.stdout


def files_of_ours() -> Iterator[str]:
    """Every file of ours that belongs into a release, from the root."""
    for folder in (TOP, *ROOMS):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                yield path.relative_to(ROOT).as_posix()


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Both, built from a copy, so that what earlier builds left in the working tree cannot help or harm."""
    source = tmp_path_factory.mktemp("source")
    for folder in (TOP, *ROOMS, "tests"):
        shutil.copytree(ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for file in DESCRIBED:
        shutil.copy(ROOT / file, source / file)
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", "dist", cwd=source)
    (wheel,), (sdist,) = (source / "dist").glob("*.whl"), (source / "dist").glob("*.tar.gz")
    return Built(wheel, sdist)


def test_the_wheel_holds_our_packages_and_nothing_at_the_top(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as archive:
        names = set(archive.namelist())
        (top_level,) = (name for name in names if name.endswith("top_level.txt"))
        assert archive.read(top_level).decode().split() == ["fgbaseline"]
    described = {name for name in names if name.partition("/")[0].endswith(".dist-info")}
    assert names - described == {f"fgbaseline/{name.removeprefix(f'{TOP}/')}" for name in files_of_ours()}
    assert "fgbaseline/py.typed" in names
    assert any(name.endswith("licenses/LICENSE") for name in described)


def test_the_sdist_holds_what_the_wheel_is_made_of_and_no_tests(built: Built) -> None:
    with tarfile.open(built.sdist) as archive:
        names = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    made = {name for name in names if ".egg-info/" in name} | {"PKG-INFO", "setup.cfg"}
    assert names - made == {*files_of_ours(), *DESCRIBED}


@dataclass(frozen=True)
class Environment:
    """A virtual environment with nothing in it, served by the pip of this one."""

    folder: Path

    @staticmethod
    def make(folder: Path) -> "Environment":
        run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder.parent)
        return Environment(folder)

    @property
    def python(self) -> Path:
        return self.folder / "bin" / "python"

    @property
    def packages(self) -> Path:
        (folder,) = (self.folder / "lib").glob("python*/site-packages")
        return folder

    def pip(self, *arguments: str | Path) -> None:
        run(sys.executable, "-m", "pip", "--python", self.python, *arguments, cwd=self.folder)

    def fill(self, wheel: Path) -> None:
        """Installs a wheel with all that it asks for: by uv, in a tenth of pip's time, or by pip where uv cannot."""
        uv = Path(sys.executable).with_name("uv")
        command = [uv, "pip", "install", "--quiet", "--system-certs", "--python", self.python, wheel]
        if subprocess.run(command, cwd=self.folder, stdin=subprocess.DEVNULL, check=False).returncode != 0:
            self.pip("install", "--quiet", "--no-compile", wheel)


USERS_OWN = 'OWNER = "the user"\n'
BOTH = """
import compare as c, data as d, ekf as e
from fgbaseline import compare, data, diagnosis, ekf, geometry, reports, smoother
from importlib.metadata import entry_points

assert {c.OWNER, d.OWNER, e.OWNER} == {"the user"}
for ours in (compare, data, diagnosis, ekf, geometry, reports, smoother):
    assert not hasattr(ours, "OWNER")
    print(ours.__file__)
for estimator in entry_points(group="fgbaseline.estimators"):
    assert callable(estimator.load())
sequence = data.read("drive.npz")
problem = diagnosis.calibrated(sequence)
assert len(compare.divergence(ekf.dead_reckoning(problem), smoother.isam2(problem), sequence.up)) == sequence.n_frames
"""


def use_beside_the_users_own_modules(env: Environment, folder: Path, *, with_a_report: bool) -> None:
    """The command and the four lines of Python, in a folder whose modules have the names of our rooms."""
    (folder / "data").mkdir(parents=True)
    for name in ("ekf.py", "compare.py", "data/__init__.py"):
        (folder / name).write_text(USERS_OWN)
    command = env.folder / "bin" / "fgbaseline"
    few = ("--duration", "4", "--features-per-frame", "20")
    dead_reckoning = ("--estimators", "dead-reckoning", "--out", "out")
    first = {"PYTHONPATH": str(folder)}  # the user's folder before everything else
    run(command, "simulate", "drive.npz", *few, cwd=folder, **first)
    if with_a_report:
        printed = run(command, "run", "drive.npz", *dead_reckoning, cwd=folder, **first)
        assert "The report is in out/report.html" in printed
    for line in run(env.python, "-c", BOTH, cwd=folder).splitlines():
        assert Path(line).is_relative_to(env.packages)
    for name in ("ekf.py", "compare.py", "data/__init__.py"):
        assert (folder / name).read_text() == USERS_OWN
    top = {path.name for path in env.packages.iterdir()}
    assert "fgbaseline" in top
    assert not top & {TOP, *ROOMS, "tests", "docs", "benchmarks"}


@pytest.mark.slow
def test_each_installs_into_an_empty_environment_and_works_beside_the_users_own_modules(
    built: Built, tmp_path: Path
) -> None:
    with_wheel = Environment.make(tmp_path / "wheel")
    with_wheel.fill(built.wheel)
    with_wheel.pip("check")
    use_beside_the_users_own_modules(with_wheel, tmp_path / "project", with_a_report=True)

    # The sdist's requirements are the wheel's (below): they are lent from there, to install them only once.
    with_wheel.pip("uninstall", "--quiet", "--yes", "fgbaseline")
    with_sdist = Environment.make(tmp_path / "sdist")
    with_sdist.pip("install", "--quiet", "--no-deps", built.sdist)
    (with_sdist.packages / "lent.pth").write_text(f"{with_wheel.packages}\n")
    with_sdist.pip("check")
    use_beside_the_users_own_modules(with_sdist, tmp_path / "another project", with_a_report=False)


SCRIPT = """
import fgbaseline
import numpy as np
from fgbaseline import data, ekf
from fgbaseline.data import Estimate, Problem


def mine(problem: Problem, progress: object = None) -> Estimate:
    answer = ekf.dead_reckoning(problem)
    return Estimate("mine", answer.world_T_imu, answer.used)


sequence = data.read("drive.npz")
result = fgbaseline.run(sequence, estimators=["ekf", "isam2", mine], preset="calibrated", features="all")
reveal_type(fgbaseline.__version__)
reveal_type(result)
reveal_type(result.table)
reveal_type(result.figures())
reveal_type(result.report("out/drive", force=True))
path = (sequence.t, result.results["mine"].estimate.world_T_imu)
reveal_type(fgbaseline.compare_trajectories(result, {"mine": path}, align="yaw", deltas=["1s"]))
reveal_type(fgbaseline.compare_trajectories("truth.tum", ["a.tum", path, np.zeros((3, 4, 4))]).verdict)
fgbaseline.run(sequence, preset="best")
fgbaseline.run(sequence, sead=3)
fgbaseline.compare_trajectories(path, path, align="best")
fgbaseline.nothing
"""
REVEALED = (
    "str",
    "RunReport",
    "DataFrame",
    "dict[str, matplotlib.figure.Figure]",
    "Path",
    "ComparisonReport",
    "list[str]",
)
REFUSED = ("arg-type", "call-arg", "arg-type", "attr-defined")


def test_a_users_script_is_checked_against_the_types_of_the_wheel(built: Built, tmp_path: Path) -> None:
    with zipfile.ZipFile(built.wheel) as archive:
        archive.extractall(tmp_path / "site")
    (tmp_path / "script.py").write_text(SCRIPT)
    # The packages of a path that mypy is given are checked as source; only those installed need py.typed.
    environment_of_user = Environment.make(tmp_path / "user")
    shutil.copytree(tmp_path / "site", environment_of_user.packages, dirs_exist_ok=True)
    (here,) = {Path(p) for p in sys.path if p.endswith("site-packages")}
    (environment_of_user.packages / "lent.pth").write_text(f"{here}\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--python-executable", environment_of_user.python, "script.py"]
    checked = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
    notes = [line for line in checked.stdout.splitlines() if ": note: Revealed type" in line]
    assert len(notes) == len(REVEALED), checked.stdout
    for line, revealed in zip(notes, REVEALED, strict=True):
        assert f'{revealed}"' in line or f"{revealed}[" in line, line
    errors = [line for line in checked.stdout.splitlines() if ": error: " in line]
    assert [line.rpartition("[")[2].rstrip("]") for line in errors] == list(REFUSED), checked.stdout


def test_both_ask_for_the_same(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith("dist-info/METADATA"))
        wheel = archive.read(name).decode()
    with tarfile.open(built.sdist) as sdists:
        member = sdists.extractfile(f"{built.sdist.name.removesuffix('.tar.gz')}/PKG-INFO")
        assert member is not None
        assert member.read().decode() == wheel
