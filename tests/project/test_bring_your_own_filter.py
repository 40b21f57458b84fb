"""A filter from a package of its own: registered and run beside ours, or on exported files and back by `compare`."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from fgbaseline import data, ekf
from fgbaseline.data import read_problem
from fgbaseline.reports.comparison import compare

from ..builders.commands import fgbaseline
from ..builders.synthetic import drive

METADATA = """\
Metadata-Version: 2.1
Name: theirs
Version: 1.0
"""
ENTRY_POINTS = """\
[fgbaseline.estimators]
their-filter = theirs.plugin:solve
broken-filter = theirs.missing:solve
"""
PLUGIN = '''\
"""An estimator as a user writes it: the increments added up, and landmarks from their first sight."""

import numpy as np
from fgbaseline.data import Estimate, Landmarks, Problem
from fgbaseline.geometry import se3


def solve(problem: Problem, progress=None) -> Estimate:
    poses = [problem.initial_pose]
    for increment in problem.increment:
        poses.append(poses[-1] @ se3.exp(increment))
        if progress is not None:
            progress(len(poses), problem.n_frames)
    world_T_imu = np.array(poses)
    seen = problem.observations()
    index, first = np.unique(seen.landmark, return_index=True)
    points = problem.sequence.camera.triangulate(seen.pixel[first])
    world_T_cam = world_T_imu[seen.frame[first]] @ problem.sequence.imu_T_cam
    return Estimate(
        name="their-filter",
        world_T_imu=world_T_imu,
        used=problem.scatter_mask(np.ones(len(seen), dtype=bool)),
        landmarks=Landmarks(index, se3.transform(world_T_cam, points)),
    )
'''
STANDALONE = '''\
"""The same filter without a line of ours: what a program in another language does with the exported files."""

import csv
import json
import math
import sys
from pathlib import Path

folder, trajectory, landmarks = map(Path, sys.argv[1:])
words = json.loads((folder / "problem.json").read_text())
assert words["schema"] == "fgbaseline/problem/1"


def rows(name):
    with (folder / name).open() as file:
        return list(csv.DictReader(file))


def product(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(len(B))) for j in range(len(B[0]))] for i in range(len(A))]


def exp(twist):
    """The matrix exponential of hat(twist), by its series: increments are small."""
    (vx, vy, vz, wx, wy, wz) = twist
    X = [[0.0, -wz, wy, vx], [wz, 0.0, -wx, vy], [-wy, wx, 0.0, vz], [0.0] * 4]
    term = total = [[float(i == j) for j in range(4)] for i in range(4)]
    for n in range(1, 25):
        term = [[x / n for x in row] for row in product(term, X)]
        total = [[a + b for a, b in zip(r, s)] for r, s in zip(total, term)]
    return total


def quaternion(R):
    """x y z w; the turn stays below half a circle on this path."""
    w = 0.5 * math.sqrt(max(0.0, 1.0 + R[0][0] + R[1][1] + R[2][2]))
    return [(R[2][1] - R[1][2]) / (4 * w), (R[0][2] - R[2][0]) / (4 * w), (R[1][0] - R[0][1]) / (4 * w), w]


frames, poses = rows("frames.csv"), [words["initial_pose"]]
for row in rows("increments.csv"):
    poses.append(product(poses[-1], exp([float(row[k]) for k in ("vx", "vy", "vz", "wx", "wy", "wz")])))
with trajectory.open("w") as file:
    for row, T in zip(frames, poses):
        print(row["t"], *(T[i][3] for i in range(3)), *quaternion(T), file=file)

camera, points = words["camera"], {}
for row in rows("observations.csv"):
    if row["excluded"] == "0" and row["landmark"] not in points:
        uL, vL, uR = (float(row[k]) for k in ("uL", "vL", "uR"))
        z = camera["fu"] * camera["baseline"] / (uL - uR)
        seen = [[(uL - camera["cu"]) / camera["fu"] * z], [(vL - camera["cv"]) / camera["fv"] * z], [z], [1.0]]
        points[row["landmark"]] = product(product(poses[int(row["frame"])], words["imu_T_cam"]), seen)
with landmarks.open("w") as file:
    print("id,x,y,z", file=file)
    for index, point in points.items():
        print(index, *(point[i][0] for i in range(3)), sep=",", file=file)
'''


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `pip install --target` leaves it: the package, and the metadata that registers its estimator."""
    target = tmp_path_factory.mktemp("target")
    (target / "theirs").mkdir()
    (target / "theirs" / "__init__.py").touch()
    (target / "theirs" / "plugin.py").write_text(PLUGIN)
    (target / "theirs-1.0.dist-info").mkdir()
    (target / "theirs-1.0.dist-info" / "METADATA").write_text(METADATA)
    (target / "theirs-1.0.dist-info" / "entry_points.txt").write_text(ENTRY_POINTS)
    return target


def test_a_filter_on_exported_files_alone_comes_back_through_compare(tmp_path: Path) -> None:
    data.write_npz(drive(features_per_frame=20.0), tmp_path / "drive.npz")
    finished = fgbaseline("export", "drive.npz", "--out", "problem", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    (tmp_path / "filter.py").write_text(STANDALONE)
    command = [sys.executable, "-I", "filter.py", "problem", "mine.tum", "mine.csv"]
    solved = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert solved.returncode == 0, solved.stderr
    problem = read_problem(tmp_path / "problem")
    ours = ekf.dead_reckoning(problem)
    data.write_tum(tmp_path / "ours.tum", problem.sequence.t, ours.world_T_imu)
    result = compare(
        tmp_path / "ours.tum",
        tmp_path / "mine.tum",
        align="none",
        sequence=tmp_path / "problem",
        landmarks=[tmp_path / "mine.csv"],
    )
    row = result.table["mine"]
    assert row["ATE: max, m"] < 1e-9
    assert row["ATE: rotation RMSE, °"] < 1e-6
    assert row["reprojection error: median, px"] < 10.0
    reference = result.reference_pixels
    mine = result.results["mine"].pixels
    assert mine is not None
    assert reference is not None
    assert mine.own is not None
    assert set(mine.own["landmark"]) == set(problem.features[problem.features < problem.sequence.n_landmarks])


def test_a_registered_filter_has_its_column_beside_ours(installed: Path, tmp_path: Path) -> None:
    data.write_npz(drive(features_per_frame=20.0), tmp_path / "drive.npz")
    names = "dead-reckoning,their-filter,broken-filter"
    asked = ("--estimators", names, "--out", "run")

    def lent() -> None:
        sys.path.insert(0, str(installed))

    finished = fgbaseline("run", "drive.npz", *asked, cwd=tmp_path, drawing=False, first=lent)
    assert finished.returncode == 1, finished.stderr  # the broken one failed, and stopped no other
    summary = json.loads((tmp_path / "run/summary.json").read_text())["estimators"]
    assert summary["their-filter"]["status"] == "ok"
    assert summary["their-filter"]["divergence"]["max"] < 1e-9
    assert summary["their-filter"]["reprojection"]["n"] > 0
    assert summary["broken-filter"]["status"] == "failed"
    assert "theirs.missing" in summary["broken-filter"]["reason"]
    assert "their-filter" in (tmp_path / "run/report.html").read_text()
    result = compare(tmp_path / "run")
    assert list(result.results) == ["their-filter"]


def test_without_the_package_its_name_is_unknown(tmp_path: Path) -> None:
    data.write_npz(drive(), tmp_path / "drive.npz")
    finished = fgbaseline("run", "drive.npz", "--estimators", "their-filter", "--out", "run", cwd=tmp_path)
    assert finished.returncode == 2
    assert "'their-filter'" in finished.stderr
    assert not (tmp_path / "run").exists()
