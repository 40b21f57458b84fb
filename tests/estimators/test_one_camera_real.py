"""EuRoC V1_01 as seen by one camera, 30 s, by the converter of docs/imu.md: started by its own initialization."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fgbaseline import compare, data, diagnosis, ekf, smoother
from fgbaseline.compare import Align
from fgbaseline.data import Estimate, Problem

from ..builders.documents import DOCUMENTS, blocks

TRUTH = "euroc/V1_01_standing/mav0/state_groundtruth_estimate0/data.csv"


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory, recordings: Callable[[str], Path]) -> Problem:
    truth, folder = recordings(TRUTH), tmp_path_factory.mktemp("v1_01")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        exec(converter(), {})
    return diagnosis.calibrated(data.read(folder / "v1_01_left.npz", truth=truth, truth_frame="imu"))


def converter() -> str:
    """The block of docs/imu.md that writes v1_01_left.npz."""
    (document,) = [path for path in DOCUMENTS if path.name == "imu.md"]
    (text,) = [block.text for block in blocks(document.read_text()) if "eqvio_processed_30s.csv" in block.text]
    return text


def errors(estimate: Estimate, problem: Problem) -> tuple[float, float]:
    """RMSE after SE(3) alignment, m, and scale of the estimate over that of the truth."""
    truth = problem.sequence.truth
    assert truth is not None
    known = truth.known
    poses, true = estimate.world_T_imu[known], truth.world_T_imu[known]
    apart = compare.align(poses, true, Align.SE3).apply(poses)[:, :3, 3] - true[:, :3, 3]
    return float((apart**2).sum(axis=1).mean() ** 0.5), 1.0 / compare.align(poses, true, Align.SIM3).scale


def test_the_start_stands_and_the_motion_determines_the_scale(problem: Problem) -> None:
    assert problem.start is not None
    assert "standing start" in problem.start.source
    assert not any(finding.code == "scale_not_excited" for finding in problem.findings)


def test_isam2_finds_path_and_scale(problem: Problem) -> None:
    rmse, scale = errors(smoother.isam2(problem), problem)
    assert rmse < 0.03
    assert abs(scale - 1.0) < 0.02


def test_the_joint_filter_finds_path_and_scale(problem: Problem) -> None:
    rmse, scale = errors(ekf.joint_ekf(problem), problem)
    assert rmse < 0.1
    assert abs(scale - 1.0) < 0.05
