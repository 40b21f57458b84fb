"""From a folder of images to the report: run, diagnose and export on rendered images, with the truth of the folder."""

import json
from pathlib import Path

import numpy as np
import pytest

from fgbaseline.data import Observations, Sequence, read, read_problem
from fgbaseline.geometry import StereoCamera
from fgbaseline.reports.phrases.run import track_sentences

from ..builders.commands import fgbaseline
from ..builders.rendered import HEIGHT, WIDTH, Room

pytest.importorskip("cv2")
N = 24
ESTIMATORS = ("isam2", "ekf", "joint-ekf")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Room(N).write_euroc(tmp_path_factory.mktemp("images") / "room_01")


@pytest.fixture(scope="module")
def place(folder: Path) -> Path:
    arguments = ("run", "room_01", "--estimators", ",".join(ESTIMATORS), "--out", "out")
    result = fgbaseline(*arguments, cwd=folder.parent, drawing=False)
    assert result.returncode == 0, result.stderr
    return folder.parent / "out"


def test_a_folder_of_images_becomes_a_run_with_the_truth_in_it(place: Path) -> None:
    summary = json.loads((place / "summary.json").read_text())
    assert summary["sequence"]["form"] == "euroc"
    assert summary["reference"]["name"] == "isam2"
    for name in ESTIMATORS:
        assert summary["estimators"][name]["ate"]["rmse"] < 0.02
    tracks = read(place / "tracks.npz")
    assert tracks.imu is not None
    assert tracks.truth is not None
    assert len(tracks.observations) >= summary["sequence"]["observations"]


def test_the_page_has_both_images_of_every_frame_and_says_where_tracks_are(place: Path) -> None:
    page = (place / "report.html").read_text()
    assert len(page) < 20_000_000
    data = json.loads(page.split('<script type="application/json" id="run">')[1].split("</script>")[0])
    assert sorted(map(int, data["images"])) == list(range(N))
    assert all(uri.startswith("data:image/jpeg;base64,") for pair in data["images"].values() for uri in pair)
    assert (data["camera"]["width"], data["camera"]["height"]) == (WIDTH, HEIGHT)
    assert "observations a frame on average" in page
    assert "of the 3 x 3 grid" in page


def test_diagnose_and_export_read_the_folder(folder: Path, tmp_path: Path) -> None:
    found = fgbaseline("diagnose", folder, "--json", cwd=tmp_path)
    assert found.returncode in (0, 1), found.stderr
    assert json.loads(found.stdout)["imu"]["samples"] > N
    exported = fgbaseline("export", folder, "--out", "problem", cwd=tmp_path)
    assert exported.returncode == 0, exported.stderr
    assert read_problem(tmp_path / "problem").imu is not None


def test_empty_parts_of_the_image_are_named() -> None:
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0.0, 300.0, 900), rng.uniform(0.0, 200.0, 900)
    pixel = np.stack([u, v, u - 5.0, v], axis=1)[(u < 200.0) | (v < 133.0)]
    n = len(pixel)
    observations = Observations.sort(np.arange(n) % 3, np.arange(n) // 3, pixel)
    still, t = np.zeros((3, 3)), np.arange(3.0)
    camera = StereoCamera(200.0, 200.0, 150.0, 100.0, 0.1)
    sequence = Sequence("drive", t, still, still, camera, np.eye(4), observations, (n + 2) // 3)
    assert track_sentences(sequence, (300.0, 200.0))[-1].endswith("bottom right.")
    whole = track_sentences(sequence, (200.0, 133.0))
    assert whole[0].startswith(f"{(n + 2) // 3} tracks of ")
