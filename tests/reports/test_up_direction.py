"""Up in a comparison of trajectory files: from the files themselves, or stated as an assumption."""

from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface

from fgbaseline import data
from fgbaseline.data.formats.trajectories.reader import read_trajectory_file
from fgbaseline.geometry import FloatArray, InputError, se3
from fgbaseline.reports.comparison import ComparisonReport, compare
from fgbaseline.reports.figures.comparison_data import of_comparison
from fgbaseline.reports.html.comparison_page import comparison_plots
from fgbaseline.reports.run.folder import write_numbers

from ..builders.runs import standard_run

UP = np.array([0.1, 0.0, -0.995]) / np.linalg.norm([0.1, 0.0, -0.995])
ASSUMED = "Up is not known from these files"
CONTRADICTED = "states another up direction"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of a run whose world has z down, nearly."""
    place = tmp_path_factory.mktemp("run")
    write_numbers(standard_run(up_imu=UP), place)
    return place


def charts(report: ComparisonReport) -> object:
    """Every chart of the page."""
    return comparison_plots(report, of_comparison(report))["charts"]


def test_files_of_a_run_are_compared_as_the_run_itself_is(folder: Path, tmp_path: Path) -> None:
    """Heights, left, above and headings of trajectories/*.tum are those of a comparison with the folder."""
    paths = [folder / "trajectories" / f"{name}.tum" for name in ("isam2", "dead-reckoning", "ekf")]
    by_files = compare(paths[0], *paths[1:], align="none")
    by_run = compare(folder, beside="all", align="none")
    np.testing.assert_array_equal(by_files.up, UP)
    assert list(by_files.results) == list(by_run.results)
    for name, result in by_files.results.items():
        for column, values in by_run.results[name].divergence.items():
            np.testing.assert_array_equal(result.divergence[column], values, err_msg=f"{name} {column}")
    assert charts(by_files) == charts(by_run)
    assert "Up is (0.1, 0, -0.995) in the world frame of isam2 (source: the file of isam2)" in by_files.caption
    assert not any(ASSUMED in sentence or CONTRADICTED in sentence for sentence in by_files.verdict)
    by_files._fill_tables(tmp_path)
    again = compare(*(tmp_path / "trajectories" / path.name for path in paths), align="none")
    np.testing.assert_array_equal(again.up, UP)


def test_a_stated_up_is_read_by_us_and_ignored_by_evo(tmp_path: Path) -> None:
    t, poses = _path()
    data.write_tum(tmp_path / "bare.tum", t, poses)
    data.write_tum(tmp_path / "up.tum", t, poses, UP)
    bare, stated = (read_trajectory_file(tmp_path / f"{name}.tum") for name in ("bare", "up"))
    assert (bare.up, bare.up_stated, stated.up_stated) == (None, False, True)
    assert stated.up is not None
    np.testing.assert_allclose(stated.up, UP, rtol=1e-15)
    np.testing.assert_array_equal(data.read_tum(tmp_path / "up.tum")[1], data.read_tum(tmp_path / "bare.tum")[1])
    evos = file_interface.read_tum_trajectory_file(tmp_path / "up.tum")
    np.testing.assert_array_equal(evos.positions_xyz, poses[:, :3, 3])
    np.testing.assert_array_equal(evos.timestamps, t)
    text = (tmp_path / "up.tum").read_text()
    (tmp_path / "words.tum").write_text(text.replace(" ".join(map(repr, UP.tolist())), "is not known"))
    assert read_trajectory_file(tmp_path / "words.tum").up is None
    (tmp_path / "zero.tum").write_text(text.replace(" ".join(map(repr, UP.tolist())), "0 0 0"))
    with pytest.raises(InputError, match=r"zero\.tum: its comment '# up 0 0 0' gives no direction"):
        data.read_tum(tmp_path / "zero.tum")


def test_the_option_goes_before_the_files_and_a_file_before_the_assumption(tmp_path: Path) -> None:
    t, poses = _path()
    turn = se3.exp([5.0, 0.0, 1.0, 2.0, 0.3, 0.1])
    data.write_tum(tmp_path / "bare.tum", t, poses)
    data.write_tum(tmp_path / "other.tum", t, poses)
    data.write_tum(tmp_path / "turned.tum", t, turn @ poses, turn[:3, :3] @ UP)
    nothing = compare(tmp_path / "bare.tum", tmp_path / "other.tum")
    assert (nothing.up_from, nothing.up.tolist()) == ("assumed", [0.0, 0.0, 1.0])
    assumed = f"{ASSUMED}; (0, 0, 1) in the world of bare is assumed (--up sets it)."
    assert f"{assumed} View, height, left, above and heading depend on it." in nothing.verdict
    by_estimate = compare(tmp_path / "bare.tum", tmp_path / "other.tum", tmp_path / "turned.tum")
    assert by_estimate.up_from == "the file of turned"
    np.testing.assert_allclose(by_estimate.up, UP, atol=1e-9)
    by_option = compare(tmp_path / "bare.tum", tmp_path / "turned.tum", up=(0.0, 1.0, 0.0))
    assert (by_option.up_from, by_option.up.tolist()) == ("--up", [0.0, 1.0, 0.0])
    for report in (by_estimate, by_option):
        assert not any(ASSUMED in sentence or CONTRADICTED in sentence for sentence in report.verdict)


def test_files_that_contradict_each_other_on_up_are_named(tmp_path: Path) -> None:
    t, poses = _path()
    data.write_tum(tmp_path / "down.tum", t, poses, UP)
    data.write_tum(tmp_path / "mine.tum", t, poses, -UP)
    found = compare(tmp_path / "down.tum", tmp_path / "mine.tum")
    np.testing.assert_array_equal(found.up, UP)
    (said,) = (sentence for sentence in found.verdict if CONTRADICTED in sentence)
    assert said == (
        "The file of mine states another up direction: after alignment it is 180° off that of the comparison "
        "(the file of down)."
    )
    with pytest.raises(InputError, match=r"mine\.tum: up in its world is 180 degrees off that of down"):
        compare(tmp_path / "down.tum", tmp_path / "mine.tum", align="yaw")


def _path() -> tuple[FloatArray, FloatArray]:
    step = se3.exp([0.5, 0.0, 0.05, 0.01, 0.02, 0.03])
    return 0.1 * np.arange(60), se3.compose(np.tile(step, (59, 1, 1)))


def test_a_given_up_is_a_direction_of_any_length(folder: Path) -> None:
    paths = [folder / "trajectories" / f"{name}.tum" for name in ("isam2", "ekf")]
    np.testing.assert_allclose(compare(*paths, align="none", up=(0.0, 3.0, 4.0)).up, [0.0, 0.6, 0.8])
