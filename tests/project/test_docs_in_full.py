"""Every command and snippet of README and docs as it is printed, to its end, figures drawn: `make test-all`.

The names that documents use are real recordings where these are at hand (`FGBASELINE_RECORDINGS`), else simulated ones
of a minute. Targets of make that write into the project run in a copy of it.
"""

import os
import shlex
import shutil
import socket
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data, diagnosis, ekf
from fgbaseline.data.formats import attach_truth
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.tracking.rectification import CameraModel
from fgbaseline.data.tracking.sources import open_recording
from fgbaseline.geometry import FloatArray, se3

from ..builders.commands import COMMAND, environment
from ..builders.documents import DOCUMENTS, ROOT, blocks, commands, file_name, name
from ..conftest import RECORDINGS
from .test_bring_your_own_filter import ENTRY_POINTS, METADATA, PLUGIN, STANDALONE
from .test_docs import NEVER_RUN, SHOWING, WRITING, has_chromium

pytestmark = pytest.mark.full
REAL = {
    "drive.npz": "ece276a_2020/0027.npz",
    "poses.txt": "ground_truth/kitti_odometry_07.txt",
    "03.npz": "03.npz",
    "10.npz": "10_imu_only.npz",
    "10_imu_only.npz": "10_imu_only.npz",
    "2011_09_26_drive_0036_sync_KLT.mat": "utias/2011_09_26_drive_0036_sync_KLT.mat",
    "utias": "utias",
    "V1_01_easy": "euroc/V1_01_standing",
    "2011_09_26": "kitti_images/raw_2011_09_26_drive_0002/2011_09_26",
    "06": "kitti_images/odometry_06_first51",
    "imu0.csv": "imu/odometry_06_first51_imu0.csv",
    "ece276a_2020": "ece276a_2020",
    "ground_truth": "ground_truth",
}
"""name in the documents -> the recording that stands for it"""
ABSENT = ("dataset-room1_512_16", "tracks.npz")
"""recordings in the documents for which none stands"""
FORMS_OF_06 = ("left", "right", "camchain-imucam.yaml", "run.bag", "velocities.csv")
"""forms that the images of folder 06 are given, or its motion"""
EXTRINSIC = "utias/2011_09_30_drive_0027_sync_KLT.mat"
"""recording whose extrinsic the drive of folder 06 has"""
HOST = "tcp://host:8786"
"""the machine of a Dask scheduler, in whose place this one stands"""
ALLOWED = {"diagnose": (0, 1), "check": (0, 1)}
"""exit codes other than 0 alone: it found something; the limits of the example are violated on that recording"""
STANDING = "fgbaseline run V1_01_easy --cameras left --out out/v1_01_left"
"""command that may end with 1: what stands for V1_01_easy is at rest, where one camera determines no landmark"""


class FullPlace:
    """A folder with what the documents name, and their commands run there as a user runs them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.done: set[str] = set()
        for below in ("accuracy", "docs/images", "out/simulated", "bin", "site/theirs", "site/theirs-1.0.dist-info"):
            (folder / below).mkdir(parents=True)
        shutil.copytree(ROOT / "suites", folder / "suites")
        for limits in ("limits.toml", "accuracy/limits.toml"):
            shutil.copy(ROOT / "docs" / "ci" / "limits.toml", folder / limits)
        for block in blocks((ROOT / "docs" / "bench.md").read_text()):
            if block.text.startswith('name = "mine"\n'):
                (folder / "mine.toml").write_text(block.text)
        self._recordings()
        self._their_filter()
        self.run("fgbaseline run drive.npz --truth poses.txt --truth-frame camera --out out/drive")
        self.run("fgbaseline export drive.npz --out out/problem")
        update = "--update-baseline --accept-worse"
        self.run(f"fgbaseline check out/drive --limits limits.toml --baseline baseline.json {update}")
        shutil.copytree(folder / "out" / "drive", folder / "out" / "simulated", dirs_exist_ok=True)

    def _recordings(self) -> None:
        for known, real in REAL.items():
            if (RECORDINGS / real).exists():
                (self.folder / known).symlink_to((RECORDINGS / real).resolve())
        if (RECORDINGS / EXTRINSIC).exists():
            imu_T_cam = data.read(RECORDINGS / EXTRINSIC).imu_T_cam
            (self.folder / "imu_T_cam.txt").write_text(" ".join(map(repr, imu_T_cam[:3].ravel().tolist())))
            if all((self.folder / known).exists() for known in ("06", "imu0.csv")) and find_spec("cv2") is not None:
                self._forms_of_06(imu_T_cam)
        if not (self.folder / "drive.npz").exists() or not (self.folder / "poses.txt").exists():
            sequence = simulate(Simulation(seed=3))
            assert sequence.truth is not None
            data.write_npz(sequence, self.folder / "drive.npz")
            camera = se3.inverse(sequence.imu_T_cam) @ sequence.truth.world_T_imu @ sequence.imu_T_cam
            data.write_kitti(self.folder / "poses.txt", camera)
        sequence = data.read(self.folder / "drive.npz")
        problem = diagnosis.calibrated(sequence)
        mine = ekf.ekf(problem)
        truth = attach_truth(sequence, self.folder / "poses.txt", "camera").truth
        assert truth is not None
        data.write_tum(self.folder / "truth.tum", sequence.t[truth.known], truth.world_T_imu[truth.known])
        data.write_tum(self.folder / "mine.tum", sequence.t, mine.world_T_imu)
        data.write_euroc(self.folder / "poses.csv", sequence.t, ekf.dead_reckoning(problem).world_T_imu)
        table = np.column_stack([mine.landmarks.index, mine.landmarks.position])
        rows = [f"{int(index)},{x},{y},{z}" for index, x, y, z in table.tolist()]
        (self.folder / "mine.csv").write_text("\n".join(["id,x,y,z", *rows]) + "\n")

    def _forms_of_06(self, imu_T_cam: FloatArray) -> None:
        """Folder 06 as two folders with Kalibr's camera chain, and as a bag; and its motion as velocities."""
        recording = open_recording(self.folder / "06")
        right = recording.right
        assert right is not None
        (self.folder / "camchain-imucam.yaml").write_text(camchain(recording.left, right, imu_T_cam))
        stamps = [round(t * 1e9) for t in recording.t.tolist()]
        for i, side in enumerate(("left", "right")):
            (self.folder / side).mkdir()
            for stamp, file in zip(stamps, sorted((self.folder / "06" / f"image_{i}").iterdir()), strict=True):
                (self.folder / side / f"{stamp:019d}.png").symlink_to(file.resolve())
        camera = np.tile(np.eye(4), (len(stamps), 1, 1))
        camera[:, :3] = np.loadtxt(next((self.folder / "06").glob("poses*.txt"))).reshape(-1, 3, 4)
        twist = se3.log(se3.relative(camera @ se3.inverse(imu_T_cam))) / np.diff(recording.t)[:, None]
        rows = np.column_stack([recording.t, np.vstack([twist, twist[-1:]])])
        np.savetxt(self.folder / "velocities.csv", rows, delimiter=",")
        if find_spec("rosbags") is not None:
            from ..data.test_bags import BagWriter

            bag = BagWriter("ros1", self.folder)
            samples = np.loadtxt(self.folder / "imu0.csv", delimiter=",")
            begin = 10**18
            with bag.writer:
                for stamp, *row in samples.tolist():
                    bag.imu("/imu0", begin + int(stamp), row)
                for stamp, pair in zip(stamps, recording.pairs(), strict=True):
                    for side, image in zip(("left", "right"), pair[:2], strict=True):
                        bag.image(f"/cam/{side}/image_raw", begin + stamp, image)

    def _their_filter(self) -> None:
        """`my-filter`, registered in a package, and `my_filter`, a program without a line of ours."""
        site = self.folder / "site"
        (site / "theirs" / "__init__.py").touch()
        (site / "theirs" / "plugin.py").write_text(PLUGIN.replace("their-filter", "my-filter"))
        (site / "theirs-1.0.dist-info" / "METADATA").write_text(METADATA)
        registered = ENTRY_POINTS.replace("their-filter", "my-filter").partition("broken-filter")[0]
        (site / "theirs-1.0.dist-info" / "entry_points.txt").write_text(registered)
        program = self.folder / "bin" / "my_filter"
        program.write_text(f"#!{sys.executable} -I\n{STANDALONE}")
        program.chmod(0o755)

    def run(self, command: str) -> None:
        """The command, once, as a process of its own; fails where it does not end well."""
        if command in self.done:
            return
        self.done.add(command)
        program, *arguments = shlex.split(command)
        if program == "make":
            self._make(arguments)
            return
        if "report_image" in command and not has_chromium():
            return  # said by tests/project/test_docs.py
        needed = [*arguments, "utias"] if "mine.toml" in arguments else arguments
        if missing := [form for form in FORMS_OF_06 if form in arguments and not (self.folder / form).exists()]:
            pytest.skip(f"{', '.join(missing)}: made of {REAL['06']}, {REAL['imu0.csv']} and {EXTRINSIC}")
        if missing := set(ABSENT) & set(arguments):
            pytest.skip(f"no recording stands for {', '.join(sorted(missing))}")
        for known in set(REAL) & {part.partition("/")[0] for part in needed}:
            if not (self.folder / known).exists():
                pytest.skip(f"{REAL[known]} is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
        if "--rerun" in arguments and not has_rerun():
            pytest.skip("rerun-sdk is not installed (the extra fgbaseline[rerun])")
        place, allowed = self.folder, (0,)
        if program == "fgbaseline":
            allowed = (0, 1) if command == STANDING else ALLOWED.get(arguments[0], (0,))
            self._cleared(arguments)
            command_line: list[str | Path] = [COMMAND, *arguments]
        elif program == "python":
            script = [str(ROOT / part) if part.startswith("benchmarks/") else part for part in arguments]
            command_line = [sys.executable, *script]
        else:
            command_line = [self.folder / "bin" / program, *arguments]
        path = f"{self.folder / 'site'}{os.pathsep}{ROOT}" if program == "python" else str(self.folder / "site")
        with scheduler() if HOST in arguments else none() as address:
            line = [str(part).replace(HOST, address or HOST) for part in command_line]
            result = _ended(line, place, PYTHONPATH=path)
        assert result.returncode in allowed, f"{command}: {result.returncode}\n{result.stderr[-2000:]}"

    def _cleared(self, arguments: list[str]) -> None:
        """Takes away what an earlier command left where this one writes, as it would refuse to replace it."""
        if arguments[0] in (*WRITING, "reproduce", "figures"):
            default = [f"out/{Path(arguments[1]).stem}"] if arguments[0] == "run" else []
            after = arguments[arguments.index("--out") + 1 :] if "--out" in arguments else default
            for below in after[:1]:
                shutil.rmtree(self.folder / below, ignore_errors=True)

    def _make(self, arguments: list[str]) -> None:
        if arguments == ["test"]:
            assert "test-all: test\n" in (ROOT / "Makefile").read_text()
            return
        copy = self.folder / "project"
        if not copy.exists():
            left_out = shutil.ignore_patterns(".venv", ".git", "out", "build", "__pycache__", ".*_cache", ".hypothesis")
            shutil.copytree(ROOT, copy, ignore=left_out)
            (copy / ".venv").symlink_to(ROOT / ".venv")
        result = _ended(["make", *arguments], copy, FGBASELINE_RECORDINGS=str(RECORDINGS.resolve()))
        assert result.returncode == 0, result.stderr[-2000:]


def camchain(left: CameraModel, right: CameraModel, imu_T_cam: FloatArray) -> str:
    """Kalibr's camera chain of a rectified pair; `imu_T_cam` (4, 4) of the left camera."""
    rows = []
    for camera, model, key, motion in (
        ("cam0", left, "T_cam_imu", se3.inverse(imu_T_cam)),
        ("cam1", right, "T_cn_cnm1", se3.inverse(right.imu_T_cam) @ left.imu_T_cam),
    ):
        rows += [f"{camera}:", f"  {key}: {motion.tolist()}", "  camera_model: pinhole", "  distortion_model: radtan"]
        rows += [f"  intrinsics: {list(model.intrinsics)}", "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]"]
        rows += [f"  resolution: {list(model.size)}"]
    return "\n".join([*rows, ""])


def _ended(command: list[str], cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    kept = {key: value for key, value in environment(**env).items() if key not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    return subprocess.run(
        command, cwd=cwd, env=kept, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )


def has_rerun() -> bool:
    """Whether the extra `rerun` is installed."""
    return find_spec("rerun") is not None


@contextmanager
def none() -> Iterator[None]:
    """No scheduler."""
    yield None


@contextmanager
def scheduler() -> Iterator[str]:
    """The address of a Dask cluster on this machine."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what Dask has to say of itself
        distributed = pytest.importorskip("distributed")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        cluster = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, scheduler_port=port
        )
        try:
            yield str(cluster.scheduler_address)
        finally:
            cluster.close()


@pytest.fixture(scope="module")
def place(docs_folder: Path) -> FullPlace:
    return FullPlace(docs_folder)


STEPS = [
    pytest.param(document, number, id=f"{name(document)}-{number}-{(commands(block) or ['python'])[0][:60]}")
    for document in SHOWING
    for number, block in enumerate(blocks(document.read_text()))
    if block.language == "python" or commands(block)
]
"""the blocks of each document that do something, in its order"""


@pytest.fixture(scope="module")
def names() -> dict[Path, dict[str, object]]:
    """What the snippets of each document have defined so far."""
    return {document: {} for document in DOCUMENTS}


@pytest.mark.parametrize(("document", "number"), STEPS)
def test_every_command_and_snippet_runs_as_printed(
    document: Path, number: int, place: FullPlace, names: dict[Path, dict[str, object]]
) -> None:
    every = blocks(document.read_text())
    for block in every[:number]:
        if (file := file_name(block)) is not None:
            (place.folder / file).write_text(block.text)
    block = every[number]
    if block.language == "python":
        shutil.rmtree(place.folder / "out" / "comparison", ignore_errors=True)  # which several write
        exec(compile(block.text, name(document), "exec"), names[document])
    for command in commands(block):
        if command not in NEVER_RUN:
            place.run(command)
