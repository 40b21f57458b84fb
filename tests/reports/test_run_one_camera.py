"""From images of one camera to the report: the run finds scale and path, and its page has one image a frame."""

import json
from pathlib import Path

import numpy as np
import pytest

from fgbaseline.data import read
from fgbaseline.reports.problem import ONE_CAMERA_ESTIMATORS

from ..builders.commands import fgbaseline
from ..builders.rendered import SwayingRoom

pytest.importorskip("cv2")
N = 50


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = SwayingRoom(N).write_euroc(tmp_path_factory.mktemp("images") / "room_01", n_cameras=1)
    (folder.parent / "tracker.toml").write_text("max_features = 100\n")
    result = fgbaseline(
        "run",
        "room_01",
        "--cameras",
        "left",
        "--settings",
        "tracker.toml",
        "--out",
        "out",
        cwd=folder.parent,
        drawing=False,
    )
    assert result.returncode == 0, result.stderr
    return folder.parent / "out"


def test_scale_and_path_are_found(place: Path) -> None:
    summary = json.loads((place / "summary.json").read_text())
    assert set(ONE_CAMERA_ESTIMATORS) <= set(summary["estimators"])
    for name in ("isam2", "joint-ekf"):
        figures = summary["estimators"][name]
        assert abs(figures["scale_error"]) < 0.02
        assert figures["ate_sim3"] <= figures["ate_se3"] < 0.03
    assert "scale_not_excited" not in {finding["code"] for finding in summary["problem"]["findings"]}


def test_the_tracks_in_the_folder_are_of_one_camera(place: Path) -> None:
    tracks = read(place / "tracks.npz")
    assert tracks.monocular
    assert np.isnan(tracks.observations.pixel[:, 2:]).all()


def test_the_page_has_one_image_of_every_frame(place: Path) -> None:
    page = (place / "report.html").read_text()
    data = json.loads(page.split('<script type="application/json" id="run">')[1].split("</script>")[0])
    assert sorted(map(int, data["images"])) == list(range(N))
    assert {len(images) for images in data["images"].values()} == {1}
    assert data["camera"]["baseline"] is None
