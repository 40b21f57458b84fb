"""`assert_accuracy`, the helper and the fixture, for people whose CI is pytest."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evo.core import metrics
from evo.core.trajectory import PoseTrajectory3D

from fgbaseline.compare import time_coverage
from fgbaseline.data import Estimate, Status, Trajectory, Truth, write_tum
from fgbaseline.data.velocity_increments import dead_reckoned_path
from fgbaseline.geometry import FloatArray, InputError, se3, so3
from fgbaseline.reports.accuracy_check import assert_accuracy
from fgbaseline.reports.comparison import compare

from ..builders.commands import environment

T = 200
STAMPS = 1.5e9 + 0.1 * np.arange(T)


def true_path() -> FloatArray:
    twist = np.tile([8.0, 0.1, -0.2, 0.01, -0.02, 0.12], (T - 1, 1))
    return dead_reckoned_path(0.1 * twist)


def estimated(meters: float = 0.3, seed: int = 4) -> FloatArray:
    """The path from another world, each pose off by about so many meters."""
    random = np.random.default_rng(seed)
    off = se3.exp(np.column_stack([meters / np.sqrt(3.0) * random.normal(size=(T, 3)), np.zeros((T, 3))]))
    return se3.exp([4.0, -2.0, 1.0, 0.3, 0.2, -0.6]) @ true_path() @ off


def evo_ate() -> tuple[float, float]:
    """RMSE and largest of the same as evo has them."""
    here, there = (PoseTrajectory3D(poses_se3=list(p), timestamps=STAMPS) for p in (estimated(), true_path()))
    here.align(there)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((there, here))
    return ape.get_statistic(metrics.StatisticsType.rmse), ape.get_statistic(metrics.StatisticsType.max)


def test_the_figures_are_those_of_evo() -> None:
    rmse, largest = evo_ate()
    values = assert_accuracy((STAMPS, estimated()), (STAMPS, true_path()), ate=1.001 * rmse, ate_max=1.001 * largest)
    assert (values["ate.rmse"], values["ate.max"]) == (pytest.approx(rmse), pytest.approx(largest))
    assert values["coverage"] == 1.0
    for limit in ({"ate": 0.999 * rmse}, {"ate": 1.0, "ate_max": 0.999 * largest}):
        with pytest.raises(AssertionError, match="does not meet its limits"):
            assert_accuracy((STAMPS, estimated()), (STAMPS, true_path()), **limit)


def test_every_kind_of_trajectory_is_taken(tmp_path: Path) -> None:
    file = tmp_path / "mine.tum"
    write_tum(file, STAMPS, estimated())
    truth = (STAMPS, true_path())
    first = assert_accuracy(file, truth, ate=1.0)
    assert assert_accuracy(str(file), Trajectory(*truth), ate=1.0) == pytest.approx(first)
    answer = Estimate("mine", estimated(), np.zeros(0, dtype=np.bool_))
    by_frame = assert_accuracy(answer, Truth(true_path()), ate=1.0)
    assert by_frame["ate.rmse"] == pytest.approx(first["ate.rmse"])
    assert assert_accuracy(estimated(), Truth(true_path()), ate=1.0) == pytest.approx(by_frame)
    positions = assert_accuracy((STAMPS, estimated()[:, :3, 3]), truth, ate=1.0)
    assert positions["ate.rmse"] == pytest.approx(first["ate.rmse"])


def test_the_message_shows_the_table_and_where_the_figure_is(tmp_path: Path) -> None:
    figure = tmp_path / "figures" / "mine.png"
    with pytest.raises(AssertionError) as error:
        assert_accuracy((STAMPS, estimated()), (STAMPS, true_path()), ate=0.1, divergence=100.0, figure=figure)
    lines = str(error.value).splitlines()
    assert lines[0] == "estimate does not meet its limits, against reference:"
    assert lines[1].split() == ["limit", "metric", "value", "bound", "margin"]
    assert re.match(r"violated  ate\.rmse \(m\) +0\.\d+ +<= 0\.1 +-0\.\d+$", lines[2])
    assert re.match(r"holds     divergence\.rmse \(m\) +\d", lines[3])
    assert re.match(r"holds     coverage +1 +>= 0\.95 +\+0\.05$", lines[4])
    assert "SE(3)-aligned over all 200 poses" in lines[5]
    assert lines[6] == f"The figure is in {figure}"
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_without_a_place_the_figure_has_one_of_its_own() -> None:
    with pytest.raises(AssertionError) as error:
        assert_accuracy((STAMPS, estimated()), (STAMPS, true_path()), ate=0.1)
    figure = Path(str(error.value).rpartition("The figure is in ")[2])
    assert figure.is_file()
    figure.unlink()
    figure.parent.rmdir()


def test_an_estimate_that_stops_half_way_does_not_pass(tmp_path: Path) -> None:
    half = estimated(0.0)
    half[T // 2 :] = np.nan
    with pytest.raises(AssertionError, match=r"violated  coverage +0\.49"):
        assert_accuracy((STAMPS, half), (STAMPS, true_path()), ate=1.0, figure=tmp_path / "x.png")
    values = assert_accuracy((STAMPS, half), (STAMPS, true_path()), ate=1.0, coverage=0.4)
    assert values["coverage"] == pytest.approx(99 / 199)


def test_an_estimator_that_failed_does_not_pass() -> None:
    failed = Estimate.failed("mine", "it lost its way", T, 0)
    with pytest.raises(AssertionError, match="mine failed: it lost its way"):
        assert_accuracy(failed, Truth(true_path()), ate=1e9)
    halfway = replace(Estimate("mine", estimated(), np.zeros(0, dtype=np.bool_)), status=Status.FAILED, reason="late")
    with pytest.raises(AssertionError, match="late"):
        assert_accuracy(halfway, Truth(true_path()), ate=1e9)


def test_coverage_asks_for_no_more_than_the_reference_has() -> None:
    t = np.arange(100.0)
    assert time_coverage(t, t) == 1.0
    assert time_coverage(t[::5], t) == pytest.approx(95 / 99)
    assert time_coverage(t[10:], t) == pytest.approx(89 / 99)
    gap = np.concatenate([t[:40], t[60:]])
    assert time_coverage(gap, gap) == 1.0
    assert time_coverage(gap, t) == pytest.approx(78 / 99)
    assert time_coverage(t[:1], t) == 0.0
    assert time_coverage(t[:1], t[:1]) == 1.0


def test_assert_accuracy_refuses_missing_limits_and_unmatched_trajectories() -> None:
    truth = (STAMPS, true_path())
    with pytest.raises(InputError, match=r"there is no limit; give ate=0\.5"):
        assert_accuracy(truth, truth)
    with pytest.raises(InputError, match=r"limit on ate\.rmse is nan"):
        assert_accuracy(truth, truth, ate=float("nan"))
    with pytest.raises(InputError, match="have no time stamps"):
        assert_accuracy(Truth(true_path()), truth, ate=1.0)
    with pytest.raises(InputError, match="100 frames and the reference 200"):
        assert_accuracy(Truth(true_path()[:100]), Truth(true_path()), ate=1.0)
    with pytest.raises(InputError, match="58 frames and the reference 60"):
        assert_accuracy(true_path()[:58], true_path()[:60], ate=1.0)
    with pytest.raises(AssertionError, match="estimate does not meet its limits, against reference:"):
        assert_accuracy(estimated(), true_path(), ate=0.01)
    with pytest.raises(InputError, match=r"within 0\.01 s"):
        assert_accuracy((STAMPS + 1e5, true_path()), truth, ate=1.0)


USERS_TESTS = """
import sys
import pytest

def test_without_it():
    assert not [name for name in ("numpy", "pandas", "gtsam", "matplotlib", "fgbaseline.data") if name in sys.modules]

@pytest.mark.parametrize("limit", [9.0, 0.1])
def test_filter(assert_accuracy, limit):
    assert_accuracy("mine.tum", "truth.tum", ate=limit)
"""


def users_pytest(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Pytest in a project that knows fgbaseline only as installed."""
    write_tum(folder / "mine.tum", STAMPS, estimated())
    write_tum(folder / "truth.tum", STAMPS, true_path())
    (folder / "test_users.py").write_text(USERS_TESTS)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(folder), *arguments]
    result = subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True, check=False)
    assert "Warning" not in result.stdout + result.stderr
    return result


def test_the_fixture_is_there_once_fgbaseline_is_installed(tmp_path: Path) -> None:
    result = users_pytest(tmp_path, "--accuracy-figures", "figures", "--basetemp", str(tmp_path / "base"))
    assert result.returncode == 1
    assert "1 failed, 2 passed" in result.stdout
    assert re.search(r"E +violated  ate\.rmse \(m\)", result.stdout)
    assert "The figure is in figures/test_filter_0.1_.png" in result.stdout
    assert "in asserted" not in result.stdout
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["test_filter_0.1_.png"]


def test_without_a_folder_figures_go_to_that_of_the_test(tmp_path: Path) -> None:
    result = users_pytest(tmp_path, "--basetemp", str(tmp_path / "base"), "-k", "filter")
    figure = Path(result.stdout.partition("The figure is in ")[2].partition("\n")[0])
    assert figure.is_relative_to(tmp_path / "base")
    assert figure.is_file()


def test_the_pytest_plugin_imports_nothing_of_the_package_before_its_use(tmp_path: Path) -> None:
    assert users_pytest(tmp_path, "-k", "without_it").returncode == 0


def rows_of(poses: FloatArray) -> list[list[str]]:
    """Position and quaternion, x y z w, as text."""
    numbers = np.concatenate([poses[:, :3, 3], so3.quaternion_xyzw(poses[:, :3, :3])], axis=1)
    return [list(map(repr, row)) for row in numbers.tolist()]


def test_the_units_of_files_are_determined_from_each_other_as_in_compare(tmp_path: Path) -> None:
    truth, mine = tmp_path / "truth.tum", tmp_path / "mine.txt"
    write_tum(truth, STAMPS, true_path())
    lines = [
        " ".join([str(round(t * 1e9)), *row[:3], row[6], *row[3:6]])
        for t, row in zip(STAMPS, rows_of(estimated()), strict=True)
    ]
    mine.write_text("\n".join(lines) + "\n")
    values = assert_accuracy(mine, truth, ate=1.0, rotation_deg=2.0)
    table = compare(truth, mine).metrics.set_index("metric")["value"]
    for ours, theirs in (("ate.rmse", "translation.rmse"), ("rotation.rmse", "rotation_deg.rmse")):
        assert values[ours] == pytest.approx(float(table[theirs]), rel=1e-12)
    plain = assert_accuracy((STAMPS, estimated()), (STAMPS, true_path()), ate=1.0)
    assert values == pytest.approx(plain, rel=1e-6)
    with pytest.raises(AssertionError, match="mine: its quaternions are read as w x y z") as error:
        assert_accuracy(mine, truth, ate=0.1, figure=tmp_path / "x.png")
    assert "mine: its time stamps are in nanoseconds" in str(error.value)


def test_positions_are_compared_in_positions_only(tmp_path: Path) -> None:
    truth = tmp_path / "truth.txt"
    rows = zip(STAMPS.tolist(), rows_of(true_path()), strict=True)
    truth.write_text("".join(f"{t!r} {' '.join(row[:3])}\n" for t, row in rows))
    values = assert_accuracy((STAMPS, estimated()), truth, ate=1.0)
    assert "rotation.rmse" not in values
    assert values["ate.rmse"] == pytest.approx(evo_ate()[0])
    for options in ({"rotation_deg": 1.0}, {"align": "first-pose"}):
        with pytest.raises(InputError, match=r"truth\.txt: it has no orientations"):
            assert_accuracy((STAMPS, estimated()), truth, ate=1.0, **options)


def test_undetermined_units_are_refused(tmp_path: Path) -> None:
    names = ("truth.txt", "mine.txt")
    for name, poses in zip(names, (true_path(), estimated()), strict=True):
        rows = zip(100 * np.arange(T), rows_of(poses), strict=True)
        (tmp_path / name).write_text("".join(f"{t} {' '.join(row)}\n" for t, row in rows))
    truth, mine = (tmp_path / name for name in names)
    with pytest.raises(InputError, match="give --time-unit"):
        assert_accuracy(mine, truth, ate=1.0)
    assert assert_accuracy(mine, truth, ate=1.0, time_unit="ms")["ate.rmse"] == pytest.approx(evo_ate()[0])
