"""A run as a recording for the viewer Rerun: read back with its own reader where the extra is installed."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline.geometry import InputError
from fgbaseline.reports.cli import main
from fgbaseline.reports.run import rerun as rerun_file

from ..builders.runs import standard_run


def test_without_the_extra_one_sentence_names_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rerun_file, "find_spec", lambda _: None)
    with pytest.raises(SystemExit) as ended:
        main(["run", "--rerun", str(tmp_path / "a.rrd"), "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'fgbaseline[rerun]'" in said
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_refused_before_anything_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(rerun_file, "find_spec", lambda _: object())
    for file in (tmp_path, tmp_path / "no" / "folder.rrd"):
        with pytest.raises(InputError, match="choose another"):
            rerun_file.require_rerun(file)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if importlib.util.find_spec("rerun") is None:
        pytest.skip("rerun-sdk is not installed (the extra fgbaseline[rerun])")
    file = tmp_path_factory.mktemp("rerun") / "drive.rrd"
    rerun_file.write_rerun(standard_run(), file)
    return file


def test_the_viewer_finds_paths_cameras_landmarks_errors_and_matches(written: Path) -> None:
    held = columns(written)
    for name in ("dead-reckoning", "ekf", "isam2"):
        for part in ("path", "landmarks", "camera"):
            assert any(path.startswith(f"/world/{name}/{part}:") for path in held), (name, part)
    assert any(path.startswith("/world/truth:") for path in held)
    assert any(path.startswith("/left_image/in_the_problem:") for path in held)
    run = standard_run()
    errors = np.concatenate(held["/series/divergence/ekf:Scalars:scalars"])
    assert run.results["ekf"].divergence is not None
    np.testing.assert_allclose(errors, run.results["ekf"].divergence["position"])
    assert [path.name for path in written.parent.iterdir()] == ["drive.rrd"]


def columns(file: Path) -> dict[str, Any]:
    """Every column of a recording, its empty rows left out."""
    from rerun.chunk import RrdReader

    held: dict[str, Any] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            key = f"{chunk.entity_path}:{name}"
            held[key] = [*held.get(key, []), *(value for value in column.to_pylist() if value)]
    return held
