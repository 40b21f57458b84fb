"""A bench gives the same tables whoever does its jobs, in whatever order, and however often it is killed on the way."""

import json
import os
import random
import shutil
import signal
import subprocess
import time
import warnings
from pathlib import Path

import pytest

from ..builders.benches import N_RUNS, SUITE, tables_of, written
from ..builders.commands import fgbaseline, started


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    written(folder)
    return folder


@pytest.fixture(scope="module")
def timed(place: Path) -> tuple[Path, float]:
    """The folder of a bench by two processes, and the seconds that it took."""
    begin = time.monotonic()
    result = fgbaseline("bench", "suite.toml", "--out", "undisturbed", "--workers", "2", cwd=place, drawing=False)
    assert result.returncode == 0, result.stderr
    assert f"{N_RUNS} of {N_RUNS}: " in result.stderr
    return place / "undisturbed", time.monotonic() - begin


@pytest.fixture(scope="module")
def undisturbed(timed: tuple[Path, float]) -> Path:
    return timed[0]


def killed(place: Path, out: str, after: float) -> bool:
    """Whether SIGKILL came before the bench was done, so many seconds after its start."""
    process = started("bench", "suite.toml", "--out", out, "--workers", "2", cwd=place)
    try:
        process.wait(timeout=after)
    except subprocess.TimeoutExpired:
        process.kill()
    process.communicate()
    return process.returncode == -signal.SIGKILL


@pytest.mark.slow
def test_killed_three_times_and_resumed_it_ends_with_the_same_tables(place: Path, timed: tuple[Path, float]) -> None:
    undisturbed, seconds = timed
    kills = [killed(place, "killed", seconds * random.uniform(0.1, 0.6)) for _ in range(3)]  # other moments every time
    assert any(kills)
    last = fgbaseline("bench", "suite.toml", "--out", "killed", "--workers", "1", cwd=place, drawing=False)
    assert last.returncode == 0, last.stderr
    assert tables_of(place / "killed") == tables_of(undisturbed)
    left = {path.name for path in (place / "killed").rglob("*") if "partial" in path.name or path.name == "progress"}
    assert not left


@pytest.mark.slow
def test_the_workers_of_a_dask_cluster_give_the_same_tables(place: Path, undisturbed: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what Dask has to say of itself
        distributed = pytest.importorskip("distributed")
        cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)
        try:
            address = cluster.scheduler_address
            asked = ("--out", "cluster", "--scheduler", address)
            result = fgbaseline("bench", "suite.toml", *asked, cwd=place, drawing=False)
        finally:
            cluster.close()
    assert result.returncode == 0, result.stderr
    assert f"{N_RUNS} of {N_RUNS}: " in result.stderr
    assert tables_of(place / "cluster") == tables_of(undisturbed)


@pytest.mark.slow
def test_force_runs_all_anew_and_one_process_gives_the_same_tables(place: Path, undisturbed: Path) -> None:
    shutil.copytree(undisturbed, place / "again")
    result = fgbaseline("bench", "suite.toml", "--out", "again", "--force", "--workers", "1", cwd=place, drawing=False)
    assert result.returncode == 0, result.stderr
    assert f"{N_RUNS} of {N_RUNS}: " in result.stderr
    assert "done already" not in result.stderr
    assert tables_of(place / "again") == tables_of(undisturbed)


@pytest.mark.slow
def test_an_interrupt_keeps_complete_results_and_leaves_no_partial_ones(place: Path, undisturbed: Path) -> None:
    process = started("bench", "suite.toml", "--out", "interrupted", "--workers", "1", cwd=place)
    assert process.stderr is not None
    assert process.stderr.readline().startswith(f"1 of {N_RUNS}, about ")
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert f"of {N_RUNS} runs kept; the same command resumes from there" in said
    assert "Traceback" not in said
    folder = place / "interrupted"
    assert {path.name for path in folder.iterdir()} == {"bench.json", "runs"}
    kept = {path.name for path in (folder / "runs").iterdir()}
    assert 1 <= len(kept) < N_RUNS
    assert kept < {path.name for path in (undisturbed / "runs").iterdir()}
    assert not any("partial" in name for name in kept)


@pytest.mark.slow
def test_adding_to_a_suite_runs_only_what_is_new_and_leaves_no_old_runs(place: Path, undisturbed: Path) -> None:
    (place / "more.toml").write_text(SUITE.replace("count = 2", "count = 3").replace("[8, 12]", "8"))
    shutil.copytree(undisturbed, place / "more")
    result = fgbaseline("bench", "more.toml", "--out", "more", "--workers", "1", cwd=place, drawing=False)
    assert "3 of 4 runs done already" in result.stderr
    assert "1 of 1: town seed=3" in result.stderr
    assert len(list((place / "more" / "runs").iterdir())) == 4


@pytest.mark.slow
def test_workers_end_with_a_bench_that_is_killed(place: Path) -> None:
    process = started("bench", "suite.toml", "--out", "orphans", "--workers", "2", cwd=place)
    progress = place / "orphans" / "progress"
    workers: list[int] = []
    while len(workers) < 2:
        time.sleep(0.1)
        workers = [int(path.name) for path in progress.glob("*") if path.suffix == ""]
        assert process.poll() is None
    process.kill()
    process.communicate()
    until = time.monotonic() + 30.0
    while any(map(alive, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(map(alive, workers))


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_check_holds_every_run_to_limits(place: Path, undisturbed: Path) -> None:
    (place / "limits.toml").write_text(
        'smallest_sample = 20\n[[limit]]\nmetric = "ate.rmse"\nestimators = ["isam2", "joint-ekf"]\nruns = "town *"\n'
        "at_most = 1.0\n"
    )
    result = fgbaseline("check", undisturbed, "--limits", "limits.toml", cwd=place)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "all 4 limits hold" in result.stdout.lower()


def test_tables_do_not_depend_on_time_or_place(undisturbed: Path) -> None:
    document = json.loads((undisturbed / "summary.json").read_text())
    assert document["schema"] == "fgbaseline/bench/1"
    text = b"".join(tables_of(undisturbed).values())
    for word in (b"seconds", b"frames_per_second", b"memory", str(undisturbed.parent).encode()):
        assert word not in text


def test_a_folder_without_the_mark_is_left_unchanged(place: Path) -> None:
    (place / "letters").mkdir(exist_ok=True)
    (place / "letters" / "dear.txt").write_text("diary")
    result = fgbaseline("bench", "suite.toml", "--out", "letters", "--force", cwd=place)
    assert result.returncode == 2
    assert "is not the folder of a bench" in result.stderr
    assert [path.name for path in (place / "letters").iterdir()] == ["dear.txt"]


def test_a_missing_cluster_is_reported_in_one_sentence(place: Path) -> None:
    pytest.importorskip("distributed")
    result = fgbaseline("bench", "suite.toml", "--out", "nowhere", "--scheduler", "tcp://127.0.0.1:9", cwd=place)
    assert result.returncode == 2
    assert "no Dask scheduler answers there" in result.stderr
    assert "Traceback" not in result.stderr
