"""UTIAS `.mat` files, written here by scipy (or by hand where it cannot), read by our own reader."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from fgbaseline.data.formats import read
from fgbaseline.geometry import InputError, se3, so3

from ..builders.refusals import refused


@pytest.fixture
def variables() -> dict[str, Any]:
    """A UTIAS recording of 6 frames and 3 landmarks whose velocities and truth are longer than `t`."""
    random = np.random.default_rng(4)
    features = np.full((4, 6, 3), -1.0)
    for landmark, frame in ((0, 0), (0, 1), (0, 4), (2, 5)):
        features[:, frame, landmark] = random.uniform(0.0, 600.0, 4)
    theta = random.normal(size=(3, 8)) * 0.3
    return {
        "t": 0.1 * np.arange(6.0)[None, :],
        "v_vk_vk_i": random.normal(size=(3, 8)),
        "w_vk_vk_i": random.normal(size=(3, 8)),
        "y_k_j": features,
        "C_c_v": so3.exp_so3([0.1, -0.7, 0.4]),
        "rho_v_c_v": np.array([[1.0], [2.0], [3.0]]),
        "fu": 700.0,
        "fv": 710.0,
        "cu": 300.0,
        "cv": 200.0,
        "b": 0.54,
        "r_i_vk_i": random.normal(size=(3, 8)),
        "theta_vk_i": theta,
        "rho_i_pj_i": random.normal(size=(3, 3)),
    }


def save(path: Path, variables: dict[str, Any], compressed: bool = True) -> Path:
    savemat(path, variables, do_compression=compressed)
    return path


@pytest.mark.parametrize("compressed", [True, False])
def test_a_recording_with_truth_and_landmarks(tmp_path, variables, compressed):
    sequence = read(save(tmp_path / "a.npz", variables, compressed))
    assert (sequence.form, sequence.n_frames, sequence.n_landmarks) == ("utias", 6, 3)
    np.testing.assert_array_equal(sequence.linear_velocity, variables["v_vk_vk_i"][:, :6].T)
    np.testing.assert_array_equal(sequence.angular_velocity, variables["w_vk_vk_i"][:, :6].T)
    np.testing.assert_array_equal(sequence.imu_T_cam[:3, :3], variables["C_c_v"].T)
    assert sequence.imu_T_cam[:3, 3].tolist() == [1.0, 2.0, 3.0]
    camera = sequence.camera
    assert (camera.fu, camera.fv, camera.cu, camera.cv, camera.baseline) == (700.0, 710.0, 300.0, 200.0, 0.54)
    observations = sequence.observations
    assert observations.frame.tolist() == [0, 1, 4, 5]
    assert observations.landmark.tolist() == [0, 0, 0, 2]
    np.testing.assert_array_equal(
        observations.pixel, variables["y_k_j"][:, observations.frame, observations.landmark].T
    )
    assert sequence.truth is not None
    assert sequence.truth.known.all()
    world_T_first = np.eye(4)
    world_T_first[:3, :3] = so3.exp_so3(variables["theta_vk_i"][:, 0])
    world_T_first[:3, 3] = variables["r_i_vk_i"][:, 0]
    recorded = se3.transform(world_T_first, sequence.truth.world_T_imu[:, :3, 3])
    np.testing.assert_allclose(recorded, variables["r_i_vk_i"][:, :6].T, atol=1e-12)
    assert sequence.truth.landmarks is not None
    moved = se3.transform(world_T_first, sequence.truth.landmarks)
    np.testing.assert_allclose(moved, variables["rho_i_pj_i"].T, atol=1e-12)
    assert "8 samples for 6 time stamps; the first 6 count" in sequence.remarks[0]


def test_without_truth_and_with_a_single_landmark_in_single_precision(tmp_path, variables):
    for key in ("r_i_vk_i", "theta_vk_i", "rho_i_pj_i"):
        del variables[key]
    variables["y_k_j"] = variables["y_k_j"][:, :, 0].astype(np.float32)  # MATLAB drops the last axis
    sequence = read(save(tmp_path / "a.mat", variables))
    assert sequence.truth is None
    assert sequence.n_landmarks == 1
    assert sequence.observations.frame.tolist() == [0, 1, 4]
    assert any("no ground truth" in remark for remark in sequence.remarks)


def test_without_features(tmp_path, variables):
    del variables["y_k_j"], variables["rho_i_pj_i"]
    sequence = read(save(tmp_path / "a.mat", variables))
    assert (len(sequence.observations), sequence.n_landmarks) == (0, 0)


def big_endian_variable(name: str, array: np.ndarray) -> bytes:
    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)

    parts = element(6, struct.pack(">II", 6, 0)) + element(5, struct.pack(f">{array.ndim}i", *array.shape))
    return element(14, parts + element(1, name.encode()) + element(9, array.astype(">f8").tobytes(order="F")))


def test_big_endian_files(tmp_path, variables):
    content = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    content += b"".join(big_endian_variable(key, np.atleast_2d(value)) for key, value in variables.items())
    (tmp_path / "big.mat").write_bytes(content)
    big, little = read(tmp_path / "big.mat"), read(save(tmp_path / "little.mat", variables))
    np.testing.assert_array_equal(big.observations.pixel, little.observations.pixel)
    np.testing.assert_array_equal(big.linear_velocity, little.linear_velocity)
    assert big.camera == little.camera


def changed(array, index, value):
    result = np.array(array, dtype=np.float64)
    result[index] = value
    return result


BAD = {
    "velocity missing": (lambda v: v.pop("w_vk_vk_i"), "w_vk_vk_i is missing; the file has 'C_c_v'"),
    "no recording": (lambda v: (v.clear(), v.update(x=1.0)), "this MATLAB file is not a UTIAS recording; .* found 'x'"),
    "velocity too short": (
        lambda v: v.update(v_vk_vk_i=v["v_vk_vk_i"][:, :5]),
        r"v_vk_vk_i: expected 3 rows of at least 6 columns for the 6 time stamps, got \(3, 5\)",
    ),
    "truth too short": (lambda v: v.update(r_i_vk_i=np.ones((3, 2))), "r_i_vk_i: expected 3 rows of at least 6"),
    "NaN velocity": (
        lambda v: v.update(w_vk_vk_i=changed(v["w_vk_vk_i"], (2, 5), np.nan)),
        "w_vk_vk_i: frame 5 has",
    ),
    "falling stamps": (lambda v: v.update(t=-v["t"]), "t: stamps must rise, but frame 1"),
    "one frame": (lambda v: v.update(t=1.0), "t: a recording needs at least 2 frames, this one has 1"),
    "features of other length": (
        lambda v: v.update(y_k_j=v["y_k_j"][:, :4]),
        r"y_k_j: expected shape \(4, 6, N\) .* got \(4, 4, 3\)",
    ),
    "NaN feature": (
        lambda v: v.update(y_k_j=changed(v["y_k_j"], (1, 4, 0), np.nan)),
        "y_k_j: vL of landmark 0 in frame 4 is nan",
    ),
    "half observed": (
        lambda v: v.update(y_k_j=changed(v["y_k_j"], (1, 5, 2), -1.0)),
        "y_k_j: landmark 2 in frame 5 is .* -1 in some rows only",
    ),
    "no rotation": (lambda v: v.update(C_c_v=np.ones((3, 3))), "C_c_v .* not a rotation"),
    "position of other shape": (lambda v: v.update(rho_v_c_v=np.ones((1, 3))), r"rho_v_c_v: expected shape \(3, 1\)"),
    "no baseline": (lambda v: v.update(b=0.0), "b: expected a positive number, the baseline in meters, got 0.0"),
    "NaN center": (lambda v: v.update(cu=np.nan), "cu: expected one finite number"),
    "text": (lambda v: v.update(fu="700"), "fu: it is not a dense array of real numbers"),
    "complex": (lambda v: v.update(fv=1j), "fv: it is not a dense array of real numbers"),
    "cells": (lambda v: v.update(t=np.array([1, "a"], dtype=object)), "t: it is not a dense array of real numbers"),
    "landmarks of other count": (
        lambda v: v.update(rho_i_pj_i=np.ones((3, 4))),
        r"rho_i_pj_i: expected shape \(3, 3\)",
    ),
    "no truth at frame 0": (
        lambda v: v.update(r_i_vk_i=changed(v["r_i_vk_i"], (0, 0), np.nan)),
        "no pose for frame 0",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_content_is_one_sentence_with_file_field_and_value(tmp_path, variables, case):
    spoil, sentence = BAD[case]
    spoil(variables)
    path = save(tmp_path / "a.mat", variables)
    with refused(sentence, path):
        read(path)


@pytest.mark.parametrize("compressed", [True, False])
def test_every_truncation_and_every_kind_of_damage_is_an_input_error(tmp_path, variables, compressed):
    whole = save(tmp_path / "a.mat", variables, compressed).read_bytes()
    path = tmp_path / "b.mat"
    for length in range(0, len(whole), 41):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"b\.mat: "):
            read(path)
    random = np.random.default_rng(0)
    outcomes = set()
    for _ in range(400):
        damaged = bytearray(whole)
        for place in random.integers(0, len(whole), 2):
            damaged[place] = random.integers(256)
        path.write_bytes(damaged)
        try:
            read(path)
        except InputError:
            outcomes.add("refused")
    assert outcomes == {"refused"}
