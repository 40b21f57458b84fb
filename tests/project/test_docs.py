"""Every command and snippet that README and docs show is run, on short recordings under the names they have there.

This is the cheap form, with figures drawn; tests/project/test_docs_in_full.py runs all of them as they are printed. A
command that is neither run here nor named below, with the test that runs a cheap form of it, is a failure.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from fgbaseline import data, diagnosis, ekf
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.geometry import se3
from fgbaseline.reports.cli import COMMANDS, group

from ..builders.commands import environment
from ..builders.documents import DOCUMENTS, ROOT, Block, blocks, commands, file_name, inline, name, shown

KITTI = "test_kitti_odometry_has_no_motion"
ELSEWHERE = {
    "make test": "tests/project/test_docs.py::test_targets_of_make_are_there",
    "make run": "tests/project/test_docs.py::test_targets_of_make_are_there",
    "fgbaseline bench mine.toml --scheduler tcp://host:8786": (
        "tests/reports/test_bench_runs.py::test_the_workers_of_a_dask_cluster_give_the_same_tables"
    ),
    "fgbaseline run drive.npz --estimators dead-reckoning,ekf,my-filter,isam2 --out out/drive": (
        "tests/project/test_bring_your_own_filter.py::test_a_registered_filter_has_its_column_beside_ours"
    ),
    "my_filter out/problem mine.tum mine.csv": (
        "tests/project/test_bring_your_own_filter.py::test_a_filter_on_exported_files_alone_comes_back_through_compare"
    ),
    "fgbaseline run drive.npz --rerun drive.rrd": (
        "tests/reports/test_rerun_file.py::test_the_viewer_finds_paths_cameras_landmarks_errors_and_matches"
    ),
    **{
        f"fgbaseline {verb} tracks.npz --imu imu0/data.csv --imu-calibration imu0/sensor.yaml{out}": (
            "tests/diagnosis/test_inertial_problem.py::test_the_commands_take_a_recording_with_samples"
        )
        for verb, out in (("run", " --out out/drive"), ("diagnose", ""), ("export", " --out out/problem"))
    },
    **{
        f"fgbaseline {command}": "tests/data/test_one_camera.py::test_the_commands_simulate_and_solve_it"
        for command in ("simulate one.npz --imu --cameras left --duration 20", "run one.npz --out out/one")
    },
    **{
        f"fgbaseline {command}": f"tests/data/test_image_sources.py::{test}"
        for command, test in (
            ("run dataset-room1_512_16 --out out/room1", "test_tum_vi"),
            ("run 2011_09_26/2011_09_26_drive_0002_sync --out out/drive_0002", "test_kitti_raw"),
            ("track 06 --out 06.npz", "test_kitti_odometry_has_no_motion"),
            ("run 06 --imu imu0.csv --extrinsic imu_T_cam.txt --out out/06", KITTI),
            ("run 06 --velocities velocities.csv --extrinsic imu_T_cam.txt --out out/06_velocities", KITTI),
            (
                "run left --right right --calibration camchain-imucam.yaml --imu imu0.csv --out out/rig",
                "test_two_folders",
            ),
            ("track V1_01_easy --out v1_01.npz", "test_track_writes_a_recording"),
            ("run v1_01.npz --out out/v1_01_tracks", "test_track_writes_a_recording"),
            ("track V1_01_easy --settings tracker.toml --out more.npz", "test_track_writes_a_recording"),
        )
    },
    "fgbaseline track V1_01_easy --cameras left --out v1_01_left.npz": (
        "tests/data/test_one_camera_images.py::test_cam0_alone_and_the_left_camera_of_a_pair_have_the_same_tracks"
    ),
    "fgbaseline run V1_01_easy --cameras left --out out/v1_01_left": (
        "tests/reports/test_run_one_camera.py::test_scale_and_path_are_found"
    ),
    "fgbaseline run V1_01_easy --out out/v1_01": (
        "tests/reports/test_run_images.py::test_a_folder_of_images_becomes_a_run_with_the_truth_in_it"
    ),
    "fgbaseline run run.bag --calibration camchain-imucam.yaml --out out/bag": (
        "tests/data/test_bags.py::test_images_and_samples_of_a_bag"
    ),
    "fgbaseline reproduce 03.npz 10.npz --out out/reproduction": (
        "tests/reports/test_reproduce.py::test_every_figure_is_there_in_three_forms"
    ),
    "fgbaseline reproduce 03.npz 10_imu_only.npz --out out/reproduction": (
        "tests/reports/test_reproduce.py::test_every_figure_is_there_in_three_forms"
    ),
}
"""command -> the test that runs its cheap form"""
IN_FULL = "tests/project/test_docs_in_full.py::test_every_command_and_snippet_runs_as_printed"
"""which runs every command of all these lists as it is printed, in hours"""
HOURS = {
    "make coverage",
    "make mutants",
    "make bench",
    "make bench BENCH_FLAGS=--quick",
    "python -m benchmarks.latency",
    "python benchmarks/accuracy.py --estimators joint-ekf-ungated,joint-ekf",
    "python -m benchmarks.isam2_variants 2011_09_26_drive_0036_sync_KLT.mat",
}
"""commands of which there is no cheap form"""
NEVER_RUN = dict.fromkeys(
    (f"pip install '.[{extras}]'" for extras in ("images", "images,ros", "rerun")),
    "it would install the checkout and fetch the extras from a registry",
)
"""command -> why no test can run it"""
SHORTER = {
    "--duration 10 ": "--duration 3 ",
    "--seeds 50": "--seeds 2 --duration 2 --features 20",
}
"""what is put in the place of what would take minutes"""
WRITING = {"run", "compare", "export", "diagnose", "bench"}
SUITE = """\
name = "mine"
estimators = ["dead-reckoning", "ekf"]
[[sequence]]
name = "town"
simulate = { path = "town", duration = 2, features_per_frame = 15 }
seeds = { count = 2 }
"""


def has_chromium() -> bool:
    """Whether a browser is there that can make a picture of a page."""
    browsers = (os.environ.get("FGBASELINE_CHROMIUM", ""), "chromium", "google-chrome")
    return any(shutil.which(browser) for browser in browsers)


class Place:
    """A folder with short recordings, trajectories and limits under the names that the documents use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.done: set[str] = set()
        self.namespaces: dict[str, dict[str, object]] = {}
        for below in ("accuracy", "suites", "docs/images", "out/simulated"):
            (folder / below).mkdir(parents=True)
        sequence = simulate(Simulation(duration=3.0, features_per_frame=15.0, seed=3, wrong_share=0.0))
        data.write_npz(sequence, folder / "drive.npz")
        assert sequence.truth is not None
        poses, extrinsic = sequence.truth.world_T_imu, sequence.imu_T_cam
        data.write_kitti(folder / "poses.txt", se3.inverse(extrinsic) @ poses @ extrinsic)
        data.write_tum(folder / "truth.tum", sequence.t, poses)
        problem = diagnosis.calibrated(sequence)
        mine = ekf.ekf(problem)
        data.write_tum(folder / "mine.tum", sequence.t, mine.world_T_imu)
        data.write_euroc(folder / "poses.csv", sequence.t, ekf.dead_reckoning(problem).world_T_imu)
        table = np.column_stack([mine.landmarks.index, mine.landmarks.position])
        rows = [f"{int(index)},{x},{y},{z}" for index, x, y, z in table.tolist()]
        (folder / "mine.csv").write_text("\n".join(["id,x,y,z", *rows]) + "\n")
        (folder / "suites" / "quick.toml").write_text(SUITE)
        for limits in ("limits.toml", "accuracy/limits.toml"):
            shutil.copy(ROOT / "docs" / "ci" / "limits.toml", folder / limits)
        self.run("fgbaseline run drive.npz --out out/drive")
        self.run("fgbaseline export drive.npz --out out/problem")
        self.run("fgbaseline check out/drive --limits limits.toml --baseline baseline.json --update-baseline")
        shutil.copytree(folder / "out" / "drive", folder / "out" / "simulated", dirs_exist_ok=True)

    def run(self, command: str) -> None:
        """The command, once; fails where it does not end well."""
        if command in self.done:
            return
        self.done.add(command)
        for long, short in SHORTER.items():
            command = command.replace(long, short)
        program, *arguments = shlex.split(command)
        if program == "fgbaseline":
            self._ours(arguments)
        elif program == "python" and arguments[0].startswith("benchmarks/"):
            self._script(arguments)
        else:
            raise AssertionError(f"neither run nor listed in {Path(__file__).name}: {command}")

    def _ours(self, arguments: list[str]) -> None:
        verb = arguments[0]
        if verb in WRITING:  # where it would refuse to replace what an earlier command left
            default = [f"out/{Path(arguments[1]).stem}"] if verb == "run" else []
            after = arguments[arguments.index("--out") + 1 :] if "--out" in arguments else default
            for place in after[:1]:
                shutil.rmtree(self.folder / place, ignore_errors=True)
        result = group.main(arguments, standalone_mode=False)
        allowed = (None, 0, 1) if verb == "diagnose" else (None, 0)  # 1: it found something
        assert result in allowed, f"exit code {result}"

    def _script(self, arguments: list[str]) -> None:
        if "report_image" in arguments[0] and not has_chromium():
            pytest.skip("there is no Chromium")
        command = [sys.executable, str(ROOT / arguments[0]), *arguments[1:]]
        result = subprocess.run(
            command, cwd=self.folder, env=environment(), capture_output=True, text=True, check=False, timeout=300
        )
        assert result.returncode == 0, result.stderr

    def follow(self, document: Path) -> dict[str, object]:
        """All that a document shows, in its order, once; the names that its snippets have left."""
        if name(document) in self.namespaces:
            return self.namespaces[name(document)]
        namespace: dict[str, object] = {}
        for block in blocks(document.read_text()):
            file = file_name(block)
            if file is not None:
                (self.folder / file).write_text(block.text)
            elif block.language == "python":
                shutil.rmtree(self.folder / "out" / "comparison", ignore_errors=True)  # which several write
                exec(compile(block.text, name(document), "exec"), namespace)
            for command in commands(block):
                if command not in {*ELSEWHERE, *HOURS, *NEVER_RUN}:
                    self.run(command)
        self.namespaces[name(document)] = namespace
        return namespace


@pytest.fixture(scope="module")
def place(docs_folder: Path) -> Place:
    return Place(docs_folder)


def _ids(documents: list[Path]) -> list[str]:
    return [name(document) for document in documents]


SHOWING = [d for d in DOCUMENTS if any(commands(b) or b.language == "python" for b in blocks(d.read_text()))]


@pytest.mark.slow
@pytest.mark.parametrize("document", SHOWING, ids=_ids(SHOWING))
def test_every_command_and_snippet_runs(document: Path, place: Place) -> None:
    place.follow(document)


def test_comments_after_a_print_are_what_it_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "getting-started.md").read_text()
    printing = [block for block in blocks(text) if block.language == "python" and "print(" in block.text]
    group.main(
        shlex.split(next(c for b in blocks(text) for c in commands(b) if " simulate " in c))[1:], standalone_mode=False
    )
    for block in printing:
        capsys.readouterr()
        exec(compile(block.text, "getting-started", "exec"), {})
        assert capsys.readouterr().out.splitlines() == re.findall(r"^print\(.*\)  # (.+)$", block.text, re.MULTILINE)
    assert printing


@pytest.mark.slow
def test_the_example_compares_a_filter_of_twenty_lines(place: Place) -> None:
    document = ROOT / "docs" / "examples" / "my-filter.md"
    function = document.read_text().partition("def my_filter(")[2].partition("```")[0]
    assert len(function.splitlines()) <= 20
    loop = document.read_text().partition("for k, frame in")[2].partition("    index = ")[0]
    assert len(loop.strip().splitlines()[1:]) == 10
    namespace = place.follow(document)
    error = namespace["table"]["error to truth RMSE, m"]  # type: ignore[index]
    assert error["isam2"] < error["my-filter"] < error["dead-reckoning"]
    assert str(namespace["svg"]).count("my-filter") == 1


@pytest.mark.slow
def test_the_example_on_raw_inertial_data_beats_dead_reckoning_and_shows_its_overconfidence(place: Place) -> None:
    table = place.follow(ROOT / "docs" / "examples" / "my-inertial-filter.md")["table"]
    mine, reckoned, joint = (table.loc[name] for name in ("my-inertial-filter", "dead-reckoning", "joint-ekf"))  # type: ignore[attr-defined]
    for quantity in ("error to truth RMSE, m", "velocity RMSE, m/s"):
        assert joint[quantity] < mine[quantity] < 0.5 * reckoned[quantity]
    assert mine["NEES of the state, median"] > 10.0 * joint["NEES of the state, median"]


def test_a_command_that_does_not_run_is_noticed(place: Place) -> None:
    (unknown,) = commands(Block("", "fgbaseline run drive.npz --no-such-option\n"))
    with pytest.raises(click.UsageError):
        place.run(unknown)
    (missing,) = commands(Block("sh", ".venv/bin/fgbaseline diagnose no-such.npz   # comment\n"))
    with pytest.raises(Exception, match=r"no-such\.npz"):
        place.run(missing)
    (other,) = commands(Block("", "rm -r out\n"))
    with pytest.raises(AssertionError, match="neither run nor listed"):
        place.run(other)


def test_lists_hold_nothing_that_is_not_shown() -> None:
    there = {command for _, command in shown()}
    assert set(ELSEWHERE) <= there
    assert there >= HOURS
    assert set(NEVER_RUN) <= there
    for part in SHORTER:
        assert any(part in command for command in there), part


def test_tests_that_run_a_command_elsewhere_are_there() -> None:
    for test in (*ELSEWHERE.values(), IN_FULL):
        file, _, function = test.partition("::")
        assert f"\ndef {function}(" in (ROOT / file).read_text(), test


def test_no_command_hides_in_a_block_of_another_language() -> None:
    for document in DOCUMENTS:
        for block in blocks(document.read_text()):
            if re.search(r"^\W*(run: )?(\.venv/bin/)?fgbaseline [a-z]", block.text, re.MULTILINE) and not commands(
                block
            ):
                # the workflows: tests/project/test_ci_examples.py runs them, and holds the page to the files
                assert (name(document), block.language) == ("docs/ci.md", "yaml")


@pytest.mark.parametrize("document", DOCUMENTS, ids=_ids(DOCUMENTS))
def test_commands_in_the_text_have_the_options_they_name(document: Path) -> None:
    for program, *words in inline(document.read_text()):
        options = [word.partition("=")[0] for word in words if re.match(r"--[a-z]", word)]
        if program == "fgbaseline":
            assert words[0] in COMMANDS, words
            command = group.get_command(click.Context(group), words[0])
            assert command is not None
            known = {option for parameter in command.params for option in parameter.opts} | {"--help"}
            assert set(options) <= known, words
        elif program == "python" and words[0].startswith("benchmarks/"):
            source = (ROOT / words[0]).read_text()
            assert all(f'"{option}"' in source for option in options), words
        elif program == "python" and words[0] == "-m":
            source = (ROOT / (words[1].replace(".", "/") + ".py")).read_text()
            assert all(f'"{option}"' in source for option in options), words


def test_targets_of_make_are_there() -> None:
    makefile = (ROOT / "Makefile").read_text()
    named = [words for document in DOCUMENTS for words in inline(document.read_text())]
    named += [shlex.split(command) for _, command in shown()]
    for target in (words[1] for words in named if words[0] == "make"):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    assert "$(BIN)/fgbaseline run --out $(OUT) --force" in makefile  # tests/reports/test_run_command.py runs that
    assert "$(BIN)/pytest" in makefile


def test_every_image_has_the_command_that_makes_it_beside_it() -> None:
    made = {command.split()[-1] for _, command in shown() if "docs/images/" in command}
    made |= set(re.findall(r"docs/images/\S+", (ROOT / "Makefile").read_text()))
    images = {name(path) for path in (ROOT / "docs" / "images").iterdir()}
    assert images == {image for image in made if image in images}
    for document in DOCUMENTS:
        text = document.read_text()
        for image in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
            path = name((document.parent / image).resolve())
            assert path in images
            assert path in text or document.name == "README.md"
