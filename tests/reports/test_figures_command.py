"""`fgbaseline figures`: a run's folder is enough to draw from, and what cannot be drawn is said in a sentence."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline.data import Status
from fgbaseline.geometry import InputError
from fgbaseline.reports import figures
from fgbaseline.reports.cli import main
from fgbaseline.reports.figures.comparison_data import of_comparison, of_comparison_folder
from fgbaseline.reports.figures.style import PAPER
from fgbaseline.reports.run.folder import write_run

from ..builders.empty_figures import figures_left_out
from ..builders.runs import answer, failed, run_of, scene, standard_run
from ..builders.synthetic import plain_problem
from .test_page_comparison import six

NEAR: dict[str, Any] = {"atol": 1e-7, "rtol": 1e-6}
"""as near as nine digits of a CSV file bring a table"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run's folder, without the run's own figures: these are drawn from the rest."""
    place = tmp_path_factory.mktemp("drive")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "draw", lambda _: {})
        write_run(standard_run(name="a $drive_"), place)
    return place


def call(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> tuple[int, str]:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    written = capsys.readouterr()
    return int(ended.value.code or 0), written.out + written.err


def test_every_figure_is_there_in_every_format_with_a_caption(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "all"
    code, said = call(capsys, "figures", folder, "--format", "pdf,svg,png", "--out", out)
    assert (code, said) == (0, f"8 figures as pdf, svg, png in {out}\n")
    captions = json.loads((out / "captions.json").read_text())
    names = "paths landmarks divergence error_to_truth reprojection consistency map_difference time_per_frame"
    assert list(captions) == names.split()
    assert all("{" not in caption for caption in captions.values())
    assert "a $drive_" in captions["paths"]
    assert {path.name for path in out.iterdir()} == {
        "captions.json",
        *(f"{name}.{form}" for name in captions for form in ("pdf", "svg", "png")),
    }
    width = re.search(r'width="([\d.]+)pt"', (out / "divergence.svg").read_text())
    assert width is not None
    assert float(width[1]) == pytest.approx(72 * PAPER.width)


def test_the_same_folder_gives_the_same_bytes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        assert call(capsys, "figures", folder, "--format", "pdf", "--out", folder / name)[0] == 0
    for path in (folder / "one").iterdir():
        assert path.read_bytes() == (folder / "two" / path.name).read_bytes(), path.name


def test_a_run_is_read_back_as_it_was_written(folder: Path) -> None:
    run, read = standard_run(), figures.of_folder(folder)
    for name, result in run.results.items():
        there = result.estimate.world_T_imu[:, :3, 3]
        np.testing.assert_allclose(np.linalg.norm(read.paths[name], axis=1), np.linalg.norm(there, axis=1), atol=1e-9)
        np.testing.assert_allclose(read.paths[name][:, 2], there @ run.problem.sequence.up, atol=1e-9)
        assert result.divergence is not None
        np.testing.assert_allclose(read.series[name]["divergence_position"], result.divergence["position"], atol=1e-7)
    assert read.truth is not None
    assert read.paths["isam2"][-1, 0] > 10.0  # the camera looks ahead


def test_an_existing_folder_is_replaced_only_with_force(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("figures", folder, "--format", "svg")
    assert call(capsys, *arguments)[0] == 0
    code, said = call(capsys, *arguments)
    assert code == 2
    assert "--force" in said
    assert call(capsys, *arguments, "--force")[0] == 0


def test_figures_without_data_are_not_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "draw", lambda _: {})
    problem = plain_problem(scene(truth=None))
    write_run(
        run_of(
            problem,
            answer(problem, "dead-reckoning", covariance=None, status=Status.RECOVERED, reason="it slipped"),
            failed(problem, "ekf", "the covariance of frame 5 is singular"),
        ),
        tmp_path,
    )
    read = figures.of_folder(tmp_path)
    assert read.names == ("dead-reckoning",)
    assert read.truth is None
    assert set(figures.draw_for_paper(read)) == {"paths", "landmarks", "reprojection", "time_per_frame"}


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a comparison, without the comparison's own figures."""
    place = tmp_path_factory.mktemp("compared") / "six"
    with pytest.MonkeyPatch.context() as patch:
        figures_left_out(patch)
        six().report(place)
    return place


def test_a_comparison_is_drawn_from_its_folder_as_from_memory(
    compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    read, had = of_comparison_folder(compared), of_comparison(six())
    assert (read.reference, read.names, read.alignment, read.axes) == (
        had.reference,
        had.names,
        had.alignment,
        had.axes,
    )
    assert list(read.rmse) == list(had.rmse)
    assert read.rmse == pytest.approx(had.rmse)
    for name, path in had.paths.items():
        np.testing.assert_allclose(read.paths[name], path, atol=1e-7)
    for name, table in had.series.items():
        np.testing.assert_allclose(read.t[name], had.t[name], atol=1e-6)
        for column in list(table)[1:]:
            np.testing.assert_allclose(read.series[name][column], table[column], **NEAR, err_msg=column)
    assert read.relative.keys() == had.relative.keys()
    for delta, motions in had.relative.items():
        for name, table in motions.items():
            for column in ("translation", "rotation_deg"):
                np.testing.assert_allclose(read.relative[delta][name][column], table[column], **NEAR)
    for name, table in had.segments.items():
        assert read.segments[name].keys() == table.keys()
        for column, values in table.items():
            np.testing.assert_allclose(read.segments[name][column], values, **NEAR)
    code, said = call(capsys, "figures", compared, "--format", "svg", "--out", compared / "paper")
    assert (code, said) == (0, f"5 figures as svg in {compared / 'paper'}\n")
    captions = json.loads((compared / "paper/captions.json").read_text())
    assert list(captions) == ["paths", "errors", "growth", "relative", "segments"]
    assert "SE(3)-aligned" in captions["paths"]
    width = re.search(r'width="([\d.]+)pt"', (compared / "paper/errors.svg").read_text())
    assert width is not None
    assert float(width[1]) == pytest.approx(72 * PAPER.width)


def test_a_damaged_comparison_is_refused_by_file_name(compared: Path, tmp_path: Path) -> None:
    summary = json.loads((compared / "comparison.json").read_text())
    del summary["up"]
    (tmp_path / "comparison.json").write_text(json.dumps(summary))
    with pytest.raises(InputError, match=r"comparison\.json: it is not that of a comparison"):
        of_comparison_folder(tmp_path)
    (tmp_path / "comparison.json").write_text((compared / "comparison.json").read_text())
    with pytest.raises(InputError, match=r"truth\.tum: there is no such file"):
        of_comparison_folder(tmp_path)


def test_bad_input_is_refused_in_one_sentence(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, said = call(capsys, "figures", tmp_path)
    assert code == 2
    assert re.fullmatch(
        r"fgbaseline: .*: it holds no summary.json; give one that fgbaseline run or compare wrote\n", said
    )
    code, said = call(capsys, "figures", folder, "--format", "eps")
    assert code == 2
    assert "choose from pdf, svg and png" in said
    (tmp_path / "summary.json").write_text('{"estimators": {}}')
    code, said = call(capsys, "figures", tmp_path)
    assert code == 2
    assert "not the summary of a run" in said
    summary = json.loads((folder / "summary.json").read_text())
    del summary["sequence"]["ahead"]
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(InputError, match="earlier version"):
        figures.of_folder(tmp_path)
