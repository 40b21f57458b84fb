"""Every reader of files from outside, each with good files to mutate; shared by quick tests and `make fuzz`."""

import io
import json
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fgbaseline import data, diagnosis
from fgbaseline.data.formats import read_euroc, read_landmarks, read_times, read_trajectory
from fgbaseline.data.formats.trajectories.reader import read_pose_covariances
from fgbaseline.data.problem_export import read_problem, write_problem
from fgbaseline.geometry import InputError
from fgbaseline.reports.accuracy_check.limits import read_limits
from fgbaseline.reports.comparison.reference_run import read_reference_run
from fgbaseline.reports.results.reader import read_folder, read_measured

from .course_file import course_arrays
from .summaries import estimator, summary
from .synthetic import Scene, drive, plain_problem
from .trajectory_writers import VARIANTS, Path3D

PACKED = 128
"""first bytes from here on pack the variable behind them"""
OTHERS = ("TUM, packed", "TUM, UTF-16", "OpenVINS", "VINS-Fusion", "OKVIS2", "rostopic", "bagpy", "positions")
TUM = b"0.0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n"


@dataclass(frozen=True)
class Reader:
    """One reader: what it is fed, and good food."""

    read: Callable[[bytes, Path], object]
    """puts the bytes into the scratch folder and reads them"""
    seeds: Callable[[], list[bytes]]


def _file(name: str, *readers: Callable[[Path], object]) -> Callable[[bytes, Path], object]:
    """Reads the bytes as one file, by every reader in turn; raises InputError where all of them refuse it."""

    def read(content: bytes, scratch: Path) -> None:
        (scratch / name).write_bytes(content)
        refused = []
        for reader in readers:
            try:
                reader(scratch / name)
            except InputError as error:  # the next one is to see it too
                refused.append(error)
        if len(refused) == len(readers):
            raise refused[0]

    return read


def npz(save: Callable[..., None] = np.savez, **arrays: Any) -> bytes:
    """The bytes of an npz."""
    stream = io.BytesIO()
    save(stream, **arrays)
    return stream.getvalue()


def npy(array: Any) -> bytes:
    """The bytes of a single array."""
    stream = io.BytesIO()
    np.save(stream, np.asarray(array))
    return stream.getvalue()


def archive(**members: bytes) -> bytes:
    """The bytes of a zip whose checksums hold, whatever its members are."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        for key, member in members.items():
            file.writestr(f"{key}.npy", member)
    return stream.getvalue()


def _member_read(
    arrays: dict[str, Any], name: str, *readers: Callable[[Path], object]
) -> Callable[[bytes, Path], object]:
    """Reads a good archive one of whose members is the bytes behind the first, which says which."""
    good, keys = {key: npy(array) for key, array in arrays.items()}, list(arrays)
    whole = _file(name, *readers)

    def read(content: bytes, scratch: Path) -> object:
        key = keys[content[0] % len(keys)] if content else keys[0]
        return whole(archive(**(good | {key: content[1:]})), scratch)

    return read


def _member_seeds(arrays: dict[str, Any]) -> list[bytes]:
    return [bytes([i]) + npy(array) for i, array in enumerate(arrays.values())]


def _utias() -> list[tuple[str, np.ndarray]]:
    random = np.random.default_rng(1)
    T, N = 5, 4
    pixel = np.full((4, T, N), -1.0)
    pixel[:, 1:3, :2] = random.uniform(0.0, 600.0, (4, 2, 2))
    return [
        ("t", 0.1 * np.arange(T)[None, :]),
        ("y_k_j", pixel),
        ("v_vk_vk_i", random.normal(size=(3, T))),
        ("w_vk_vk_i", random.normal(size=(3, T))),
        ("C_c_v", np.eye(3)),
        ("rho_v_c_v", np.zeros((3, 1))),
        ("r_i_vk_i", random.normal(size=(3, T))),
        ("theta_vk_i", random.normal(size=(3, T))),
        *(
            (key, np.array([[value]]))
            for key, value in (("cu", 320.0), ("cv", 240.0), ("fu", 500.0), ("fv", 500.0), ("b", 0.3))
        ),
    ]


def _element(kind: int, content: bytes) -> bytes:
    return np.array([kind, len(content)], "<u4").tobytes() + content + bytes(-len(content) % 8)


def _variable(name: str, array: np.ndarray) -> bytes:
    """A MATLAB 5 variable, from its flags on."""
    return (
        _element(6, np.array([6, 0], "<u4").tobytes())
        + _element(5, np.array(array.shape, "<i4").tobytes())
        + _element(1, name.encode())
        + _element(9, np.asarray(array, "<f8").tobytes(order="F"))
    )


def mat(variables: list[bytes], packed: bool) -> bytes:
    """A MATLAB 5 file of variables."""
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    elements = [np.array([14, len(v)], "<u4").tobytes() + v for v in variables]
    if packed:
        squeezed = [zlib.compress(element) for element in elements]
        elements = [np.array([15, len(z)], "<u4").tobytes() + z for z in squeezed]
    return header + b"".join(elements)


def _mat_read(content: bytes, scratch: Path) -> object:
    """A good file one of whose variables is the bytes behind the first, which says which and whether it is packed."""
    variables = [_variable(name, array) for name, array in _utias()]
    if content:
        variables[content[0] % PACKED % len(variables)] = content[1:]
    return _file("a.mat", data.read)(mat(variables, bool(content) and content[0] >= PACKED), scratch)


def _written(write: Callable[[Path], object]) -> bytes:
    """What is written into a file."""
    with TemporaryDirectory() as folder:
        write(Path(folder) / "file")
        return (Path(folder) / "file").read_bytes()


def _poses() -> tuple[np.ndarray, np.ndarray]:
    truth = drive().truth
    assert truth is not None
    return drive().t[:6], truth.world_T_imu[:6]


@contextmanager
def problem_folder() -> Iterator[Path]:
    """An exported problem."""
    with TemporaryDirectory() as folder:
        write_problem(plain_problem(Scene(frames=3, n_points=2).sequence()), Path(folder))
        yield Path(folder)


def problem_words() -> bytes:
    """The words of an exported problem."""
    with problem_folder() as folder:
        return (folder / "problem.json").read_bytes()


def problem_arrays() -> dict[str, np.ndarray]:
    """The numbers of an exported problem."""
    with problem_folder() as folder, np.load(folder / "problem.npz") as arrays:
        return {key: arrays[key] for key in arrays.files}


def _beside(name: str, other: str, content: bytes, read: Callable[[Path], object]) -> Callable[[bytes, Path], object]:
    """Reads the scratch folder with a mutated file and a good one in it."""

    def run(mutated: bytes, scratch: Path) -> object:
        (scratch / name).write_bytes(mutated)
        (scratch / other).write_bytes(content)
        return read(scratch)

    return run


def _run_folder(content: bytes, scratch: Path) -> object:
    (scratch / "summary.json").write_bytes(content)
    (scratch / "trajectories").mkdir(exist_ok=True)
    (scratch / "trajectories" / "isam2.tum").write_bytes(TUM)
    run = read_reference_run(scratch)
    return run.trajectory(run.reference)


def _summaries() -> list[bytes]:
    whole = summary(isam2=estimator(), ekf=estimator(status="failed"))
    whole |= {"settings": {"seed": 0}}
    whole["sequence"] |= {"up": [0.0, 0.0, 1.0]}
    return [json.dumps(whole).encode(), json.dumps(whole, indent=1).encode()]


LIMITS = b"""reference = "none"
[[limit]]
metric = "ate.rmse"
estimators = ["ekf", "isam*"]
at_most = 1.0
[[limit]]
metric = "divergence.rmse"
baseline = { better = "lower", relative = 0.05, absolute = 1e-3 }
"""
REPAIRS = b"""shift_intervals = -0.5
velocity_scale = 1.01
angular_axes = "x,-y,-z"
gyro_bias = [0.01, 0.0, -0.01]
[sigma]
pixel = 0.8
"""


def _problem_npz() -> Reader:
    arrays, words = problem_arrays(), problem_words()
    read = _member_read(arrays, "problem.npz", lambda path: read_problem(path.parent))

    def run(content: bytes, scratch: Path) -> object:
        (scratch / "problem.json").write_bytes(words)
        return read(content, scratch)

    return Reader(run, lambda: _member_seeds(arrays))


def readers() -> dict[str, Reader]:
    """By name."""
    course = course_arrays(truth=True)
    t, poses = _poses()
    trajectory = {"t": t, "world_T_body": poses, "covariance": np.tile(np.eye(6), (len(t), 1, 1))}
    paths = (read_trajectory, read_pose_covariances)
    variables = _utias()
    return {
        "npz": Reader(_file("a.npz", data.read, *paths), lambda: [npz(**course), npz(np.savez_compressed, **course)]),
        "npz member": Reader(_member_read(course, "a.npz", data.read), lambda: _member_seeds(course)),
        "mat": Reader(
            _file("a.mat", data.read),
            lambda: [mat([_variable(n, a) for n, a in variables], packed) for packed in (False, True)],
        ),
        "mat variable": Reader(
            _mat_read, lambda: [bytes([i + PACKED * (i % 2)]) + _variable(*v) for i, v in enumerate(variables)]
        ),
        "TUM": Reader(_file("a.txt", *paths, data.read_tum), lambda: [_written(lambda p: data.write_tum(p, t, poses))]),
        "KITTI": Reader(
            _file("a.txt", *paths, data.read_kitti, read_times),
            lambda: [_written(lambda p: data.write_kitti(p, poses)), b"0.0\n0.1\n"],
        ),
        "EuRoC": Reader(
            _file("a.csv", *paths, read_euroc), lambda: [_written(lambda p: data.write_euroc(p, t, poses))]
        ),
        "other trajectories": Reader(
            _file("a.csv", *paths),
            lambda: [VARIANTS[name].write(Path3D((0, 10**8, 2 * 10**8), poses[:3])) for name in OTHERS],
        ),
        "trajectory npz": Reader(_member_read(trajectory, "a.npz", *paths), lambda: _member_seeds(trajectory)),
        "landmarks": Reader(_file("a.csv", read_landmarks), lambda: [b"id,x,y,z,n_used\n0,1.5,2,3,7\n12,4,5,-6e3,1\n"]),
        "TOML limits": Reader(_file("a.toml", read_limits), lambda: [LIMITS]),
        "TOML repairs": Reader(_file("a.toml", diagnosis.read_repairs), lambda: [REPAIRS]),
        "JSON summary": Reader(_file("summary.json", read_measured, lambda path: read_folder(path.parent)), _summaries),
        "run folder": Reader(_run_folder, _summaries),
        "problem JSON": Reader(
            _beside("problem.json", "problem.npz", npz(**problem_arrays()), read_problem), lambda: [problem_words()]
        ),
        "problem npz": _problem_npz(),
    }
