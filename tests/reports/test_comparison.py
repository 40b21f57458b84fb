"""A comparison from Python: its tables, captions and sentences, whatever the files are and whoever wrote them."""

import json
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pandas as pd
import pytest
from evo.core import metrics
from evo.core.trajectory import PoseTrajectory3D

from fgbaseline import data
from fgbaseline.data import Trajectory
from fgbaseline.data.problem_export import write_problem
from fgbaseline.geometry import FloatArray, InputError, se3
from fgbaseline.reports.comparison import compare
from fgbaseline.reports.results.comparison import Summary
from fgbaseline.reports.tables.writers import latex, markdown

from ..builders.refusals import refused
from ..builders.synthetic import drive, matched


@cache
def truth() -> tuple[FloatArray, FloatArray]:
    """Stamps and poses of a drive of 12 s."""
    sequence = drive(seconds=12.0)
    assert sequence.truth is not None
    return sequence.t, sequence.truth.world_T_imu


def astray(poses: FloatArray, size: float, seed: int) -> FloatArray:
    """The path with an error that wanders."""
    steps = size * np.random.default_rng(seed).normal(size=(len(poses), 6)) * np.repeat([1.0, 0.1], 3)
    return poses @ se3.exp(np.cumsum(steps, axis=0))


@pytest.fixture
def files(tmp_path: Path, written: Path) -> Path:
    """A folder with them that a test may write into."""
    return Path(shutil.copytree(written, tmp_path, dirs_exist_ok=True))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A truth and two estimates, elsewhere in the world, in four forms."""
    tmp_path = tmp_path_factory.mktemp("written")
    t, poses = truth()
    elsewhere = se3.exp([5.0, -3.0, 1.0, 0.1, 0.2, 2.0])
    data.write_tum(tmp_path / "truth.tum", t, poses)
    data.write_euroc(tmp_path / "near.csv", t, elsewhere @ astray(poses, 0.005, 1))
    data.write_trajectory_npz(tmp_path / "far.npz", t, elsewhere @ astray(poses, 0.05, 2))
    data.write_kitti(tmp_path / "frames.txt", elsewhere @ astray(poses, 0.005, 1))
    (tmp_path / "times.txt").write_text("\n".join(map(repr, t.tolist())))
    return tmp_path


def test_three_lines_give_tables_and_figures(files: Path) -> None:
    result = compare(files / "truth.tum", files / "near.csv", files / "far.npz")
    assert list(result.table.columns) == ["near", "far"]
    rmse = result.table.loc["ATE: RMSE, m"]
    assert rmse["near"] < rmse["far"]
    intervals = result.metrics.set_index(["estimate", "metric"])
    low, value, high = intervals.loc[("near", "translation.rmse"), ["low", "value", "high"]]
    assert low <= value == rmse["near"] <= high
    assert "SE(3)-aligned over all" in result.caption
    assert set(result.figures()) == {"paths", "errors", "growth", "relative", "segments"}
    assert set(result.metrics.columns) == {"estimate", "metric", "value", "low", "high"}
    assert result.verdict[0].startswith("The reference, truth, is taken as given")
    assert any(sentence.startswith("Position RMSE against truth, SE(3)-aligned: near ") for sentence in result.verdict)


def test_the_figures_of_the_table_are_evos(files: Path) -> None:
    result = compare(files / "truth.tum", files / "far.npz", deltas=["5frames"], all_pairs=True)
    t, poses = truth()
    theirs = PoseTrajectory3D(poses_se3=list(data.read_trajectory(files / "far.npz").world_T_body), timestamps=t)
    reference = PoseTrajectory3D(poses_se3=list(poses), timestamps=t)
    theirs.align(reference)
    ape, rpe = (
        metrics.APE(metrics.PoseRelation.translation_part),
        metrics.RPE(metrics.PoseRelation.translation_part, 5, metrics.Unit.frames, all_pairs=True),
    )
    ape.process_data((reference, theirs))
    rpe.process_data((reference, theirs))
    row = result.table["far"]
    summary = result.summary.estimates["far"].translation.model_dump()
    titles = {"rmse": "RMSE", "std": "standard deviation", **{name: name for name in ("mean", "median", "min", "max")}}
    for name, title in titles.items():
        evos = pytest.approx(ape.get_statistic(metrics.StatisticsType(name)), rel=1e-9)
        assert row[f"ATE: {title}, m"] == evos
        assert (summary[name] if name in ("min", "max") else summary[name]["value"]) == evos
    assert row["relative error (RPE) over 5 frames: RMSE, m"] == pytest.approx(
        rpe.get_statistic(metrics.StatisticsType.rmse), rel=1e-9
    )


def test_every_form_of_the_same_path_gives_the_same_table(files: Path) -> None:
    expected = compare(files / "truth.tum", f"it={files / 'near.csv'}")
    from_kitti = compare(files / "truth.tum", f"it={files / 'frames.txt'}", times=files / "times.txt")
    at_hand = compare(files / "truth.tum", data.read_trajectory(files / "near.csv", name="it"))
    for other in (from_kitti, at_hand):
        pd.testing.assert_frame_equal(other.table, expected.table, rtol=1e-9)


def test_two_paths_without_stamps_are_compared_by_frame(files: Path) -> None:
    _, poses = truth()
    data.write_kitti(files / "truth.txt", poses)
    result = compare(files / "truth.txt", files / "frames.txt")
    assert "relative error (RPE) over 1 frames: RMSE, m" in result.table.index
    drift = result.results["frames"].drift
    assert drift
    assert "translation per second" not in drift
    with pytest.raises(InputError, match=r"frames\.txt: it has no time stamps, .*--times"):
        compare(files / "truth.tum", files / "frames.txt")


@pytest.mark.parametrize("kind", ["none", "first-pose", "yaw", "se3", "sim3"])
def test_every_alignment_is_reported(files: Path, kind: str) -> None:
    result = compare(files / "truth.tum", files / "near.csv", align=kind)
    said = {"none": "not aligned", "first-pose": "first pose", "yaw": "yaw", "se3": "SE(3)", "sim3": "Sim(3)"}[kind]
    assert said in result.caption
    assert result.summary.estimates["near"].alignment.kind == kind
    assert said.lower() in markdown(result.text_table).lower()


def test_a_time_offset_is_estimated_and_reported(files: Path) -> None:
    t, poses = truth()
    data.write_tum(files / "late.tum", t + 0.25, poses)
    result = compare(files / "truth.tum", files / "late.tum", search_offset=0.5, association="interpolated")
    assert result.results["late"].matched.offset == pytest.approx(-0.25, abs=1e-3)
    assert any("fit best: late 250 ms earlier" in sentence for sentence in result.verdict)


def test_poses_of_the_camera_are_brought_to_the_imu(files: Path) -> None:
    t, poses = truth()
    imu_T_cam = drive().imu_T_cam
    data.write_tum(files / "camera.tum", t, poses @ imu_T_cam)
    data.write_kitti(files / "extrinsic.txt", imu_T_cam[None])
    result = compare(
        files / "truth.tum", files / "camera.tum", extrinsic=files / "extrinsic.txt", estimate_body="camera"
    )
    assert result.table.loc["ATE: max, m", "camera"] < 1e-9
    with pytest.raises(InputError, match=r"camera\.tum: its poses are the camera's; add --sequence or --extrinsic"):
        compare(files / "truth.tum", files / "camera.tum", estimate_body="camera")


def test_up_is_carried_from_the_recording_into_the_worlds_of_others(files: Path) -> None:
    t, poses = truth()
    problem = matched(drive(seconds=12.0))
    (files / "problem").mkdir()
    write_problem(problem, files / "problem")
    turned = se3.exp([1.0, 2.0, 3.0, 2.0, -1.0, 0.5])
    data.write_tum(files / "turned.tum", t, turned @ poses)
    data.write_tum(files / "late.tum", t[7:], (turned @ poses)[7:])
    expected = turned[:3, :3] @ problem.sequence.up
    for name, tolerance in (("turned.tum", 1e-12), ("late.tum", 0.02)):
        result = compare(files / name, files / "near.csv", sequence=files / "problem")
        np.testing.assert_allclose(result.up, expected, atol=tolerance)
    np.testing.assert_array_equal(compare(files / "turned.tum", files / "near.csv").up, [0.0, 0.0, 1.0])


def test_yaw_is_refused_between_worlds_that_are_not_both_level(files: Path) -> None:
    t, poses = truth()
    problem = matched(drive(seconds=12.0))
    (files / "problem").mkdir()
    write_problem(problem, files / "problem")
    data.write_tum(files / "camera_world.tum", t, se3.inverse(problem.sequence.imu_T_cam) @ poses)
    with pytest.raises(InputError, match=r"truth\.tum: up in its world is 9\d degrees off .*--align se3"):
        compare(files / "camera_world.tum", files / "truth.tum", align="yaw", sequence=files / "problem")
    level = compare(files / "truth.tum", f"it={files / 'truth.tum'}", align="yaw", sequence=files / "problem")
    assert level.table.loc["ATE: max, m", "it"] < 1e-9


def test_held_out_tracks_rank_the_paths(files: Path) -> None:
    data.write_npz(drive(seconds=12.0, features_per_frame=30.0), files / "drive.npz")
    t, poses = truth()
    data.write_tum(files / "shaken.tum", t, astray(poses, 0.1, 5))
    given = {"sequence": files / "drive.npz", "held_out": 0.3}
    result = compare(files / "truth.tum", files / "near.csv", files / "shaken.tum", **given)
    assert result.held_out is not None
    assert list(result.held_out.index) == ["truth", "near", "shaken"]
    figures = result.summary.estimates["shaken"].held_out
    assert figures is not None
    assert figures.behind.low is not None
    assert figures.behind.low > 0.0
    assert "held-out error: median, px" in result.table.index
    assert any(sentence.startswith("Held-out error (median over the held-out tracks)") for sentence in result.verdict)
    assert compare(files / "truth.tum", files / "near.csv", sequence=files / "drive.npz").held_out is None


def test_the_divergence_onset_is_reported_only_for_paths_with_a_common_start(files: Path) -> None:
    aligned = compare(files / "truth.tum", files / "far.npz")
    assert aligned.results["far"].passing is None
    assert "do not start together" in aligned.results["far"].notes["passing"]
    together = compare(files / "truth.tum", files / "far.npz", align="first-pose").results["far"]
    assert together.passing is not None
    assert together.divergence["position"][together.passing.frame] > together.bound
    assert (together.divergence["position"][: together.passing.frame] <= together.bound).all()


def test_own_landmarks_and_triangulated_ones_explain_the_pixels(files: Path) -> None:
    problem = matched(drive(seconds=12.0))
    sequence = problem.sequence
    assert sequence.truth is not None
    assert sequence.truth.landmarks is not None
    (files / "problem").mkdir()
    write_problem(problem, files / "problem")
    rows = [f"{i},{x!r},{y!r},{z!r}" for i, (x, y, z) in enumerate(sequence.truth.landmarks.tolist())]
    (files / "landmarks.csv").write_text("\n".join(["id,x,y,z", *reversed(rows)]))
    result = compare(
        files / "truth.tum",
        f"same={files / 'truth.tum'}",
        files / "far.npz",
        sequence=str(files / "problem"),
        landmarks=[f"same={files / 'landmarks.csv'}"],
    )
    row, far = result.table["same"], result.table["far"]
    # Norm of four numbers of 0.5 px each: 0.5 sqrt(chi-square with 4 degrees of freedom), median 0.916.
    assert row["reprojection error: median, px"] == pytest.approx(0.916, abs=0.03)
    assert (
        row["reprojection error: median, triangulated along the trajectory, px"] < row["reprojection error: median, px"]
    )
    assert (
        far["reprojection error: median, triangulated along the trajectory, px"]
        > 2.0 * row["reprojection error: median, triangulated along the trajectory, px"]
    )
    assert result.summary.estimates["far"].notes["reprojection"] == "no landmarks came with it"
    assert "reprojection" in result.figures()


def test_the_nearest_estimator_is_decided_by_paired_errors(files: Path) -> None:
    """Both share an error that makes their own intervals wide; one adds to it everywhere."""
    t, poses = truth()
    shared = se3.compose(se3.exp(np.random.default_rng(0).normal(size=(len(t) - 1, 6)) * 1e-3))
    for name, more in (("one", 0.0), ("two", 0.01), ("three", 0.0)):
        moved = poses @ shared
        moved[:, :3, 3] += (0.02 + more) * np.sin(np.arange(len(t)))[:, None]
        data.write_tum(files / f"{name}.tum", t, moved)
    result = compare(files / "truth.tum", *(files / f"{name}.tum" for name in ("two", "one", "three")), align="none")
    assert result.behind["two"].low > 0.0
    assert result.behind["three"].value == 0.0
    said = " ".join(result.verdict)
    assert "Larger position RMSE than one, by paired bootstrap: two (" in said
    assert "No significant difference from one, by paired bootstrap: three (" in said
    summary = result.summary.estimates
    assert summary["one"].behind is None
    assert summary["two"].behind is not None
    rmse = {name: summary[name].translation.rmse.value or 0.0 for name in ("one", "two")}
    assert summary["two"].behind.value == pytest.approx(rmse["two"] - rmse["one"], rel=1e-9)


def test_stamps_that_are_no_frames_of_the_recording_are_reported(files: Path) -> None:
    t, poses = truth()
    data.write_npz(drive(), files / "drive.npz")
    data.write_tum(files / "later.tum", t + 1e6, poses)
    data.write_tum(files / "later2.tum", t + 1e6, poses)
    result = compare(files / "later.tum", files / "later2.tum", sequence=files / "drive.npz")
    assert any(s.startswith("No pose of later and later2 is at a frame of ") for s in result.verdict)


def test_reported_covariances_are_evaluated_with_and_without_alignment(files: Path) -> None:
    t, poses = truth()
    deviation = np.repeat([0.1, 0.01], 3)
    error = deviation * np.random.default_rng(0).normal(size=(len(t), 6))
    covariance = np.tile(np.diag(deviation**2), (len(t), 1, 1))
    data.write_trajectory_npz(files / "mine.npz", t, poses @ se3.exp(error), covariance)
    result = compare(files / "truth.tum", files / "mine.npz", align="none")
    nees = result.summary.estimates["mine"].nees
    assert nees is not None
    assert nees.mean == pytest.approx(6.0, abs=1.0)
    assert (nees.frames, nees.not_positive_definite) == (len(t), 0)
    assert any("mean NEES" in sentence for sentence in result.verdict)
    figure = result.figures()["three_sigma_mine"]
    assert all(float(panel.get_title(loc="left").split()[-3]) > 95.0 for panel in figure.axes)
    covariance[3] = -covariance[3]
    data.write_trajectory_npz(files / "bad.npz", t, poses @ se3.exp(error), covariance)
    bad = compare(files / "truth.tum", files / "bad.npz", align="none")
    assert any(f"left out by NEES: 1 of the {len(t)} covariances of bad" in s for s in bad.verdict)
    aligned = compare(files / "truth.tum", files / "mine.npz").summary.estimates["mine"]
    assert aligned.nees is not None
    assert aligned.nees.mean == pytest.approx(nees.mean, rel=0.05)
    between = compare(files / "truth.tum", files / "mine.npz", association="interpolated")
    assert any(s.startswith("The covariances of mine are not evaluated: poses were inter") for s in between.verdict)


def test_a_folder_holds_everything_and_keeps_to_its_schema(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    result = compare(files / "truth.tum", files / "near.csv", f"<b>&|%_$={files / 'far.npz'}")
    report = result.report(files / "out")
    written = {path.name for path in (files / "out").iterdir()}
    assert written == {
        "comparison.json", "figures", "metrics.csv", "relative", "report.html", "series", "table.csv", "table.md",
        "table.tex", "trajectories",
    }  # fmt: skip
    summary = json.loads((files / "out" / "comparison.json").read_text())
    jsonschema.validate(summary, json.loads(Summary.json_schema()))
    page = report.read_text()
    assert "<b>&|" not in page
    assert "&lt;b&gt;&amp;|%_$" in page
    assert "default-src 'none'" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    assert r"\textless{}b\textgreater{}\&\textbar{}\%\_\$" in latex(result.text_table)
    aligned = data.read_trajectory(files / "out" / "trajectories" / "near.tum")
    assert np.linalg.norm(aligned.position - truth()[1][:, :3, 3], axis=1).mean() < 0.2
    series = pd.read_csv(files / "out" / "series" / "near.csv")
    assert len(series) == len(truth()[0])
    table = pd.read_csv(files / "out" / "table.csv", index_col="estimate")
    pd.testing.assert_frame_equal(table.T.loc[result.table.index], result.table, rtol=1e-12, check_names=False)
    with pytest.raises(InputError, match="force=True"):
        result.report(files / "out")
    before = {path: path.read_bytes() for path in (files / "out").rglob("*") if path.is_file()}
    again = compare(files / "truth.tum", files / "near.csv", f"<b>&|%_$={files / 'far.npz'}")
    assert again.report(files / "out", force=True) == report
    assert {path: path.read_bytes() for path in (files / "out").rglob("*") if path.is_file()} == before


def test_the_published_schema_is_the_one_that_is_kept_to() -> None:
    published = Path(__file__).parents[2] / "docs" / "comparison.schema.json"
    assert published.read_text() == Summary.json_schema() + "\n"  # make schema writes it


def test_short_and_standing_paths_report_the_missing_metrics(tmp_path: Path) -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    data.write_tum(tmp_path / "standing.tum", np.arange(5.0), poses)
    off = poses.copy()
    off[:, 0, 3] = 0.1
    data.write_tum(tmp_path / "off.tum", np.arange(5.0), off)
    result = compare(tmp_path / "standing.tum", tmp_path / "off.tum", align="none")
    assert result.table.loc["ATE: RMSE, m", "off"] == pytest.approx(0.1)
    notes = result.summary.estimates["off"].notes
    assert set(notes) >= {"segments", "drift", "relative.10 m"}
    assert all(notes.values())
    result.report(tmp_path / "out")


def test_names_are_kept_apart(files: Path) -> None:
    (files / "other").mkdir()
    (files / "other" / "near.csv").write_bytes((files / "near.csv").read_bytes())
    result = compare(files / "truth.tum", files / "near.csv", files / "other" / "near.csv", files / "truth.tum")
    assert len(set(result.results)) == 3
    assert "other-near" in result.results


Bad = tuple[tuple[Any, ...], dict[str, Any], str]
BAD: dict[str, Bad] = {
    "nothing to compare": (("truth.tum",), {}, "there is nothing to compare"),
    "missing": (("truth.tum", "missing.tum"), {}, r"missing\.tum: there is no such file"),
    "a folder": (("truth.tum", "."), {}, "this is a folder"),
    "no run": ((".", "near.csv"), {}, r"no summary\.json"),
    "alignment": (("truth.tum", "near.csv"), {"align": "best"}, "alignment: 'best'"),
    "up": (("truth.tum", "near.csv"), {"up": (0.0, 0.0, 0.0)}, "up: expected a direction"),
    "delta": (("truth.tum", "near.csv"), {"deltas": ["10"]}, "delta: expected a length above 0 with its unit.*'10'"),
    "zero delta": (("truth.tum", "near.csv"), {"deltas": ["0m"]}, "delta: expected a length above 0.*'0m'"),
    "endless delta": (("truth.tum", "near.csv"), {"deltas": ["1e999m"]}, "delta: expected a length above 0.*'1e999m'"),
    "insisted": (
        ("truth.tum", "near.csv"),
        {"form": "kitti"},
        r"truth\.tum: line 2: expected a KITTI line \(12 numbers\)",
    ),
    "another time": (("truth.tum", "near.csv"), {"offset": 100.0}, r"no pose of .*near\.csv is within 0\.01 s"),
    "landmarks alone": (("truth.tum", "near.csv"), {"landmarks": ["times.txt"]}, "landmarks: .* add --sequence"),
    "held out of nothing": (("truth.tum", "near.csv"), {"held_out": 0.2}, "held-out: .* give it with --sequence"),
    "no name": (("truth.tum", "=near.csv"), {}, "expected FILE or NAME=FILE"),
    "many extrinsics": (("truth.tum", "near.csv"), {"extrinsic": "frames.txt"}, "imu_T_cam in one line of 12 numbers"),
    "first": (
        ("truth.tum", "near.csv"),
        {"align_first": 10_000},
        "the first 10000 pose pairs: expected a number from 1 to",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_fault_is_one_sentence(files: Path, case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given, options, sentence = BAD[case]
    monkeypatch.chdir(files)
    options = {k: Path(v) if k == "extrinsic" else v for k, v in options.items()}
    with refused(sentence):
        compare(*given, **options)


BAD_LANDMARKS = {
    "id;x;y;z\n1;2;3;4": "line 1: expected a header with id,x,y,z, but id, x, y, z is missing",
    "id,x,y\n1,2,3": "line 1: expected a header with id,x,y,z, but z is missing",
    "id,x,y,z\n1,2,3": "line 2: expected 4",
    "id,x,y,z\n1,2,3,4\n2,x,3,4": "line 3: 'x' is not a finite number",
    "id,x,y,z\n1.5,2,3,4": r"line 2: the id 1\.5 is not a whole number",
    "id,x,y,z\n7,2,3,4\n1,2,3,4\n7,0,0,0": "line 4: the landmark 7 stands on line 2 too",
}


@pytest.mark.parametrize("text", BAD_LANDMARKS)
def test_bad_landmarks_are_refused_with_their_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "l.csv").write_text(text)
    with pytest.raises(InputError, match=BAD_LANDMARKS[text]):
        data.formats.read_landmarks(tmp_path / "l.csv")


def test_no_landmark_is_none(tmp_path: Path) -> None:
    (tmp_path / "l.csv").write_text("id,x,y,z,n_used\n")
    assert len(data.formats.read_landmarks(tmp_path / "l.csv")) == 0


def test_landmarks_that_the_sequence_does_not_have(files: Path) -> None:
    data.write_npz(drive(seconds=12.0), files / "drive.npz")
    write_problem(matched(drive(seconds=12.0)), (files / "p").mkdir() or files / "p")  # type: ignore[func-returns-value]
    (files / "l.csv").write_text("id,x,y,z\n99999,0,0,0\n")
    with pytest.raises(InputError, match="near: its landmark 99999 is not one of the sequence's"):
        compare(files / "truth.tum", files / "near.csv", sequence=files / "p", landmarks=[files / "l.csv"])


def test_arguments_are_left_as_they_were(files: Path) -> None:
    t, poses = truth()
    path = Trajectory(t, poses, "mine")
    before = path.world_T_body.tobytes()
    compare(files / "truth.tum", path, align="sim3")
    assert path.world_T_body.tobytes() == before
