"""The course files and our own npz: written recordings are read back, and the form is detected from the keys."""

import contextlib
import io
import os
import tracemalloc
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline.data import Observations, Sequence, Truth
from fgbaseline.data.formats import read, write_npz
from fgbaseline.geometry import InputError, StereoCamera, se3

from ..builders.refusals import refused


def assert_same(expected: Sequence, actual: Sequence) -> None:
    """Every array is the same bit by bit (signs of zeros and NaN included)."""

    def bits(array):
        return None if array is None else (array.shape, np.ascontiguousarray(array).tobytes())

    for name in ("t", "linear_velocity", "angular_velocity", "imu_T_cam", "up_imu"):
        assert bits(getattr(expected, name)) == bits(getattr(actual, name)), name
    for name in ("frame", "landmark", "pixel"):
        assert bits(getattr(expected.observations, name)) == bits(getattr(actual.observations, name)), name
    assert (expected.camera, expected.n_landmarks) == (actual.camera, actual.n_landmarks)
    assert (expected.truth is None) == (actual.truth is None)
    if expected.truth is not None and actual.truth is not None:
        assert bits(expected.truth.world_T_imu) == bits(actual.truth.world_T_imu)
        assert bits(expected.truth.landmarks) == bits(actual.truth.landmarks)


def random_sequence(seed: int, n_frames: int, n_landmarks: int, truth: str) -> Sequence:
    random = np.random.default_rng(seed)
    seen = random.random((n_frames, n_landmarks)) < 0.4
    frame, landmark = np.nonzero(seen)
    poses = None
    if truth != "none":
        poses = se3.compose(se3.exp(random.normal(size=(n_frames - 1, 6))))
        poses[1::3] = np.nan
    landmarks = random.normal(size=(n_landmarks, 3)) if truth == "landmarks" else None
    if landmarks is not None:
        landmarks[::2] = np.nan
    up = random.normal(size=3)
    return Sequence(
        name="random",
        t=1e9 + np.cumsum(random.uniform(0.01, 1.0, n_frames)),
        linear_velocity=random.normal(size=(n_frames, 3)),
        angular_velocity=random.normal(size=(n_frames, 3)) * -0.0,
        camera=StereoCamera(*random.uniform(0.1, 900.0, 5)),
        imu_T_cam=se3.exp(random.normal(size=6)),
        observations=Observations.sort(frame, landmark, random.normal(0.0, 300.0, (len(frame), 4))),
        n_landmarks=n_landmarks,
        truth=None if poses is None else Truth(poses, landmarks),
        up_imu=up / np.linalg.norm(up),
    )


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.integers(2, 9), st.integers(0, 7), st.sampled_from(["none", "poses", "landmarks"]))
def test_written_files_are_read_back_bit_by_bit(tmp_path_factory, seed, n_frames, n_landmarks, truth):
    sequence = random_sequence(seed, n_frames, n_landmarks, truth)
    path = tmp_path_factory.mktemp("npz") / "random.npz"
    write_npz(sequence, path)
    back = read(path)
    assert_same(sequence, back)
    assert (back.form, back.name, back.source) == ("fgbaseline", "random", str(path))
    assert sorted(p.name for p in path.parent.iterdir()) == ["random.npz"]


def test_the_same_recording_gives_the_same_bytes(tmp_path):
    sequence = random_sequence(1, 8, 6, "landmarks")
    for name in "ab":
        write_npz(sequence, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_numpy_reads_our_files(tmp_path):
    sequence = random_sequence(3, 5, 4, "landmarks")
    write_npz(sequence, tmp_path / "own.npz")
    with np.load(tmp_path / "own.npz") as arrays:
        o = sequence.observations
        np.testing.assert_array_equal(arrays["features"][:, o.landmark, o.frame], o.pixel.T)
        assert np.count_nonzero((arrays["features"] != -1).all(axis=0)) == len(o)
        assert {key: arrays[key].shape for key in arrays.files} == {
            "time_stamps": (1, 5),
            "linear_velocity": (3, 5),
            "angular_velocity": (3, 5),
            "K": (3, 3),
            "b": (),
            "imu_T_cam": (4, 4),
            "up_imu": (3,),
            "features": (4, 4, 5),
            "ground_truth": (5, 4, 4),
            "landmarks": (3, 4),
        }


def test_a_failed_write_leaves_everything_as_it_was(tmp_path):
    sequence = random_sequence(3, 5, 4, "none")
    path = tmp_path / "own.npz"
    path.write_text("before")
    pixel = sequence.observations.pixel.copy()
    pixel[0, 2] = -1.0
    broken = replace(sequence, observations=replace(sequence.observations, pixel=pixel))
    with pytest.raises(InputError, match="features: a pixel coordinate is exactly -1"):
        write_npz(broken, path)
    with pytest.raises(InputError, match="cannot be written"):
        write_npz(sequence, tmp_path / "nowhere" / "own.npz")
    with pytest.raises(InputError, match="cannot be written"):
        write_npz(sequence, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["own.npz"]
    assert path.read_text() == "before"


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4", "<i2", ">i8"])
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_features_in_every_layout(tmp_path, course_arrays, order, dtype, save):
    features = np.round(course_arrays["features"]).astype(dtype)
    save(tmp_path / "a.npz", **course_arrays | {"features": np.asarray(features, order=order)})
    sequence = read(tmp_path / "a.npz")
    assert (sequence.n_frames, sequence.n_landmarks, sequence.form) == (6, 5, "course")
    observations = sequence.observations
    assert observations.frame.tolist() == [0, 1, 1, 3, 3, 4, 5]
    assert observations.landmark.tolist() == [0, 0, 1, 2, 4, 4, 4]
    expected = features[:, observations.landmark, observations.frame].T
    np.testing.assert_array_equal(observations.pixel, expected.astype(np.float64))
    assert observations.pixel.dtype == np.dtype("=f8")


@pytest.mark.parametrize("order", ["C", "F"])
def test_the_dense_block_is_never_held(tmp_path, course_arrays, order):
    T, N = 1000, 2000
    course_arrays["time_stamps"] = np.arange(T)[None, :] * 0.1
    course_arrays["linear_velocity"] = course_arrays["angular_velocity"] = np.zeros((3, T))
    features = np.full((4, N, T), -1.0, order=order)
    features[:, ::7, ::50] = np.array([9.0, 5.0, 4.0, 5.0])[:, None, None]
    np.savez_compressed(tmp_path / "big.npz", **course_arrays | {"features": features})
    size = features.nbytes
    del features
    tracemalloc.start()
    sequence = read(tmp_path / "big.npz")
    write_npz(sequence, tmp_path / "again.npz")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(sequence.observations) == 286 * 20
    assert peak < 40e6 < size
    assert_same(sequence, read(tmp_path / "again.npz"))


def test_the_2020_form_has_an_odd_extrinsic(tmp_path, course_arrays):
    later = read(save(tmp_path / "later.npz", course_arrays))
    imu_T_cam = course_arrays.pop("imu_T_cam")
    odd = imu_T_cam.copy()
    odd[:3, :3] = imu_T_cam[:3, :3].T
    course_arrays["rotational_velocity"] = course_arrays.pop("angular_velocity")
    older = read(save(tmp_path / "older.npz", course_arrays | {"cam_T_imu": odd}))
    assert_same(later, older)
    assert older.form == "course-2020"
    assert any("cam_T_imu" in remark for remark in older.remarks)


def test_a_recording_without_features(tmp_path, course_arrays):
    del course_arrays["features"]
    sequence = read(save(tmp_path / "imu.npz", course_arrays))
    assert (len(sequence.observations), sequence.n_landmarks) == (0, 0)
    assert any("no features" in remark for remark in sequence.remarks)
    empty = read(save(tmp_path / "none.npz", course_arrays | {"features": np.empty((4, 0, 6))}))
    assert (len(empty.observations), empty.n_landmarks) == (0, 0)


@pytest.mark.parametrize("form", ["(T,)", "(1, T)"])
def test_stamps_may_be_a_row_or_a_vector_and_the_baseline_a_1x1_array(tmp_path, course_arrays, form):
    if form == "(T,)":
        course_arrays["time_stamps"] = course_arrays["time_stamps"][0]
        course_arrays["b"] = np.array([[0.5]])
    sequence = read(save(tmp_path / "a.npz", course_arrays))
    assert sequence.t.shape == (6,)
    assert sequence.camera.baseline == 0.5


def test_truth_of_another_world_is_moved_to_the_first_imu(tmp_path, course_arrays):
    random = np.random.default_rng(0)
    poses = se3.compose(se3.exp(random.normal(size=(5, 6))))
    points = random.normal(size=(5, 3))
    elsewhere = se3.exp([4.0, 5, 6, 0.1, 0.2, 0.3])
    arrays = course_arrays | {"ground_truth": elsewhere @ poses, "landmarks": se3.transform(elsewhere, points).T}
    sequence = read(save(tmp_path / "a.npz", arrays))
    assert sequence.truth is not None
    np.testing.assert_allclose(sequence.truth.world_T_imu, poses, atol=1e-12)
    np.testing.assert_allclose(sequence.truth.landmarks, points, atol=1e-12)
    assert any("re-expressed" in remark for remark in sequence.remarks)


def save(path: Path, arrays: dict) -> Path:
    np.savez_compressed(path, **arrays)
    return path


def changed(array, index, value):
    result = np.array(array, dtype=np.float64)
    result[index] = value
    return result


BAD = {
    "velocity missing": (lambda a: a.pop("linear_velocity"), r"linear_velocity is missing; the file has 'K'"),
    "calibration missing": (lambda a: a.pop("K"), "K is missing"),
    "stamps missing": (lambda a: a.pop("time_stamps"), "time_stamps is missing"),
    "extrinsic missing": (lambda a: a.pop("imu_T_cam"), "imu_T_cam is missing"),
    "both forms": (lambda a: a.update(cam_T_imu=np.eye(4)), "both in the file"),
    "velocity transposed": (
        lambda a: a.update(linear_velocity=a["linear_velocity"].T),
        r"linear_velocity: expected shape \(3, 6\), got \(6, 3\)",
    ),
    "features too short": (
        lambda a: a.update(features=a["features"][:, :, :5]),
        r"features: expected shape \(4, N, 6\) .* got \(4, 5, 5\)",
    ),
    "features flat": (lambda a: a.update(features=np.zeros(3)), r"features: expected shape .* got \(3,\)"),
    "NaN velocity": (
        lambda a: a.update(angular_velocity=changed(a["angular_velocity"], (1, 4), np.nan)),
        r"angular_velocity: frame 4 has \[.*nan",
    ),
    "infinite stamp": (
        lambda a: a.update(time_stamps=changed(a["time_stamps"], (0, 2), np.inf)),
        "time_stamps: the stamp of frame 2 is inf",
    ),
    "falling stamp": (
        lambda a: a.update(time_stamps=changed(a["time_stamps"], (0, 3), a["time_stamps"][0, 1])),
        r"time_stamps: stamps must rise, but frame 3 \(1300000000.1 s\) is not after frame 2",
    ),
    "column of stamps": (
        lambda a: a.update(time_stamps=a["time_stamps"].T),
        r"time_stamps: expected shape \(1, T\), got \(6, 1\)",
    ),
    "one frame": (
        lambda a: a.update(time_stamps=np.zeros((1, 1))),
        "time_stamps: a recording needs at least 2 frames, this one has 1",
    ),
    "no frame": (
        lambda a: a.update(time_stamps=np.zeros((1, 0))),
        "time_stamps: a recording needs at least 2 frames, this one has 0",
    ),
    "extrinsic no rotation": (
        lambda a: a.update(imu_T_cam=changed(a["imu_T_cam"], (0, 2), 1.00001)),
        r"imu_T_cam: its 3x3 block .* is not a rotation \(off by 2e-05, allowed 1e-06\)",
    ),
    "extrinsic mirrored": (
        lambda a: a.update(imu_T_cam=changed(a["imu_T_cam"], (0, 2), -1.0)),
        "imu_T_cam: .* is not a rotation",
    ),
    "extrinsic last row": (lambda a: a.update(imu_T_cam=np.ones((4, 4))), "imu_T_cam: its last row"),
    "extrinsic NaN": (
        lambda a: a.update(imu_T_cam=changed(a["imu_T_cam"], (0, 3), np.nan)),
        "imu_T_cam: .*not finite",
    ),
    "K with skew": (lambda a: a.update(K=changed(a["K"], (0, 1), 2.0)), r"K: skew .* K\[0, 1\] is 2.0"),
    "K last row": (lambda a: a.update(K=changed(a["K"], (2, 2), 2.0)), r"K: its last row is \[0.0, 0.0, 2.0\]"),
    "K not finite": (lambda a: a.update(K=changed(a["K"], (0, 2), np.nan)), "K: .*not finite"),
    "K of 3x4": (lambda a: a.update(K=np.ones((3, 4))), r"K: expected shape \(3, 3\), got \(3, 4\)"),
    "negative focal length": (lambda a: a.update(K=changed(a["K"], (1, 1), -3.0)), r"K\[1, 1\]: expected a positive"),
    "two baselines": (lambda a: a.update(b=np.ones(2)), r"b: expected one number, the baseline in meters, got shape"),
    "no baseline": (lambda a: a.update(b=np.array(0.0)), r"b: expected a positive number, .* got 0.0"),
    "NaN feature": (
        lambda a: a.update(features=changed(a["features"], (2, 4, 3), np.nan)),
        "features: uR of landmark 4 in frame 3 is nan",
    ),
    "entry all NaN": (
        lambda a: a.update(features=changed(a["features"], (slice(None), 1, 2), np.nan)),
        "features: uL of landmark 1 in frame 2 is nan",
    ),
    "infinite feature": (
        lambda a: a.update(features=np.asfortranarray(changed(a["features"], (3, 0, 0), -np.inf))),
        "features: vR of landmark 0 in frame 0 is -inf",
    ),
    "half observed": (
        lambda a: a.update(features=changed(a["features"], (slice(2, 4), 4, 3), -1.0)),
        r"features: landmark 4 in frame 3 is \[.*, -1.0, -1.0\], -1 in some rows only \(1 such",
    ),
    "half unobserved": (
        lambda a: a.update(features=np.asfortranarray(changed(a["features"], (0, 3, 3), 7.0))),
        r"features: landmark 3 in frame 3 is \[7.0, -1.0, -1.0, -1.0\], -1 in some rows only",
    ),
    "pickled": (lambda a: a.update(b=np.array([{}], dtype=object)), "b: it is a pickled array, which is never opened"),
    "text": (lambda a: a.update(K=np.array("K")), "K: it holds <U1 where real numbers are expected"),
    "complex": (lambda a: a.update(K=np.ones((3, 3), complex)), "K: it holds complex128"),
    "no recording": (lambda a: (a.clear(), a.update(x=np.ones(3))), "this archive is not a recording; .* found 'x'"),
    "truth of other length": (
        lambda a: a.update(ground_truth=np.tile(np.eye(4), (5, 1, 1))),
        r"ground_truth: expected shape \(6, 4, 4\)",
    ),
    "truth no rotation": (
        lambda a: a.update(ground_truth=changed(np.tile(np.eye(4), (6, 1, 1)), (3, 0, 1), 0.1)),
        "ground_truth: the pose of frame 3 is not a rigid motion",
    ),
    "truth half NaN": (
        lambda a: a.update(ground_truth=changed(np.tile(np.eye(4), (6, 1, 1)), (2, 0, 3), np.nan)),
        "ground_truth: the pose of frame 2 is not a rigid motion",
    ),
    "landmarks without poses": (lambda a: a.update(landmarks=np.ones((3, 5))), "landmarks: they need ground_truth"),
    "landmarks of other count": (
        lambda a: a.update(landmarks=np.ones((3, 4)), ground_truth=np.tile(np.eye(4), (6, 1, 1))),
        r"landmarks: expected shape \(3, 5\), got \(3, 4\)",
    ),
    "up no unit vector": (lambda a: a.update(up_imu=np.ones(3)), "up_imu: expected a unit vector"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_content_is_one_sentence_with_file_field_and_value(tmp_path, course_arrays, case):
    spoil, sentence = BAD[case]
    spoil(course_arrays)
    path = save(tmp_path / "dé mo.npz", course_arrays)
    with refused(sentence, path):
        read(path)


def npy_bytes(shape: str, data: bytes, descr: str = "'<f8'") -> bytes:
    """An .npy member that claims whatever one likes."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data


LIES = {
    "larger than the data": (npy_bytes("(4, 5000, 6)", bytes(800)), "features: its header promises shape"),
    "smaller than the data": (npy_bytes("(4, 1, 6)", bytes(800)), "features: its header promises shape"),
    "negative": (npy_bytes("(4, -5, 6)", bytes(8)), "features: its header claims the negative shape"),
    "beyond all memory": (npy_bytes("(4, 10**9, 6)".replace("10**9", "9" * 30), b""), "features: its header promises"),
    "no header": (b"\x93NUMPY\x01\x00\xff\xff{", "features: the file is damaged"),
    "nonsense": (b"nothing of the kind", "features: the file is damaged"),
    "nothing": (b"", "features: the file is damaged"),
    "a header that is code": (npy_bytes("__import__('os')", b""), "features: the file is damaged"),
    "records": (npy_bytes("(1,)", bytes(16), "[('a', '<f8'), ('b', '<f8')]"), "features: it holds"),
    "unknown version": (b"\x93NUMPY\x09\x00" + bytes(60), "features: the file is damaged"),
}


@pytest.mark.parametrize("case", LIES)
def test_lying_headers(tmp_path, course_arrays, case):
    member, sentence = LIES[case]
    del course_arrays["features"]
    path = save(tmp_path / "a.npz", course_arrays)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("features.npy", member)
    with pytest.raises(InputError, match=sentence):
        read(path)


def test_a_block_larger_than_the_machine_is_refused_with_its_size_before_it_is_read(tmp_path, course_arrays):
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    N = memory // (4 * 6 * 8) + 1
    header = npy_bytes(f"(4, {N}, 6)", b"")
    del course_arrays["features"]
    path = save(tmp_path / "a.npz", course_arrays)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("features.npy", header + bytes(800))
        # The directory is made to agree with the header: only the size itself can give it away.
        archive.getinfo("features.npy").file_size = len(header) + 4 * N * 6 * 8
        archive._didModify = True  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=rf"features: .*{4 * N * 6 * 8 / 1e9:,.1f} GB"):
        read(path)


@pytest.mark.parametrize("name", ["../K2.npy", "/etc/passwd", "a/../../b.npy", "..\\x", "C:\\x.npy"])
def test_members_that_lead_outside(tmp_path, course_arrays, name):
    path = save(tmp_path / "a.npz", course_arrays)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, b"")
    with pytest.raises(InputError, match="leads outside the archive"):
        read(path)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_member_that_is_there_twice(tmp_path, course_arrays):
    path = save(tmp_path / "a.npz", course_arrays)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("K.npy", b"")
    with pytest.raises(InputError, match="'K' is in the archive twice"):
        read(path)


def test_every_truncation_and_every_kind_of_damage_is_an_input_error(tmp_path, course_arrays):
    whole = save(tmp_path / "a.npz", course_arrays).read_bytes()
    random = np.random.default_rng(0)
    path = tmp_path / "b.npz"
    for length in range(0, len(whole), 41):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"b\.npz: "):
            read(path)
    for _ in range(300):
        damaged = bytearray(whole)
        for place in random.integers(0, len(whole), 3):
            damaged[place] = random.integers(256)
        path.write_bytes(damaged)
        with contextlib.suppress(InputError):
            read(path)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compression_is_read_or_refused_where_it_is_damaged(tmp_path, course_arrays, method):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for key, array in course_arrays.items():
            member = io.BytesIO()
            np.save(member, array)
            archive.writestr(f"{key}.npy", member.getvalue())
    path = tmp_path / "a.npz"
    path.write_bytes(buffer.getvalue())
    assert len(read(path).observations) == 7
    damaged = bytearray(buffer.getvalue())
    damaged[90:140] = bytes(50)
    path.write_bytes(damaged)
    with pytest.raises(InputError):
        read(path)
