"""The laws of rotations and rigid motions, for all angles from nothing to pi."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from fgbaseline.geometry import FloatArray, se3, so3

Vectors = st.SearchStrategy[FloatArray]


def directions() -> Vectors:
    return st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda a: np.linalg.norm(a) > 1e-2)


ANGLES = st.one_of(
    st.floats(0.0, np.pi - 1e-6),
    st.floats(1e-16, 1e-3),
    st.floats(0.9e-4, 1.1e-4),  # where the closed forms take over from the series
    st.floats(1e-9, 1e-6).map(lambda gap: np.pi - gap),
)


@st.composite
def rotation_vectors(draw: Any) -> FloatArray:
    a = draw(directions())
    return draw(ANGLES) * a / np.linalg.norm(a)


@st.composite
def twists(draw: Any) -> FloatArray:
    v = np.array(draw(st.tuples(*[st.floats(-50.0, 50.0)] * 3)))
    return np.concatenate([v, draw(rotation_vectors())])


def close(actual: FloatArray, expected: FloatArray, tolerance: float = 1e-12) -> None:
    """Equal to `tolerance`, relative to the largest entry (at least 1)."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * max(1.0, np.abs(expected).max()))


@given(twists())
@example(np.zeros(6))
@example(np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]))
@example(np.array([1.0, 2.0, 3.0, 1e-4, 0.0, 0.0]))
def test_exp_is_the_matrix_exponential_of_hat(xi: FloatArray) -> None:
    close(se3.exp(xi), expm(se3.hat(xi)))


@given(twists())
@example(np.zeros(6))
@example(np.array([3.0, -1.0, 2.0, 0.0, 0.0, np.pi]))
def test_log_undoes_exp(xi: FloatArray) -> None:
    close(se3.exp(se3.log(se3.exp(xi))), se3.exp(xi))
    # At pi a rotation has two logarithms, and nearby the angle's last digits decide which.
    if np.linalg.norm(xi[3:]) < np.pi - 1e-8:
        close(se3.log(se3.exp(xi)), xi, 1e-11)


@given(rotation_vectors())
def test_a_tiny_twist_is_not_rounded_away(phi: FloatArray) -> None:
    tiny = 1e-9 * phi
    np.testing.assert_allclose(so3.log_so3(so3.exp_so3(tiny)), tiny, rtol=1e-9, atol=1e-30)


@given(twists(), twists())
def test_the_adjoint_carries_a_perturbation_from_right_to_left(motion: FloatArray, xi: FloatArray) -> None:
    T, small = se3.exp(motion), 0.1 * xi
    close(T @ se3.exp(small) @ se3.inverse(T), se3.exp(se3.adjoint(T) @ small), 1e-10)


@given(twists())
def test_the_adjoint_of_exp_is_the_matrix_exponential_of_curly_hat(xi: FloatArray) -> None:
    close(se3.adjoint(se3.exp(xi)), expm(se3.curly_hat(xi)))


@given(twists(), twists())
def test_curly_hat_is_the_commutator_of_hats(a: FloatArray, b: FloatArray) -> None:
    commutator = se3.hat(a) @ se3.hat(b) - se3.hat(b) @ se3.hat(a)
    close(se3.hat(se3.curly_hat(a) @ b), commutator)


@given(directions(), directions())
def test_hat3_is_the_cross_product(a: FloatArray, b: FloatArray) -> None:
    close(so3.hat3(a) @ b, np.cross(a, b))


@given(twists())
def test_the_inverse_of_a_pose_leads_back(xi: FloatArray) -> None:
    T = se3.exp(xi)
    close(T @ se3.inverse(T), np.eye(4))
    close(se3.affine_inverse(T), se3.inverse(T))


def test_the_affine_inverse_is_exact_where_the_rotation_is_none_to_the_last_digit() -> None:
    recorded = se3.exp(np.array([1.5, 0.2, -0.6, 0.3, -0.2, 0.9])).round(4)
    close(recorded @ se3.affine_inverse(recorded), np.eye(4), 1e-15)
    assert np.abs(recorded @ se3.inverse(recorded) - np.eye(4)).max() > 1e-6


@given(rotation_vectors())
@example(np.array([np.pi, 0.0, 0.0]))
@example(np.array([0.0, np.pi, 0.0]))
@example(np.array([0.0, 0.0, np.pi]))
@example(np.zeros(3))
def test_quaternions_are_those_of_scipy_and_lead_back(phi: FloatArray) -> None:
    R = so3.exp_so3(phi)
    q = so3.quaternion_xyzw(R)
    assert q[3] >= 0.0
    assert abs(np.linalg.norm(q) - 1.0) < 1e-15
    close(so3.rotation_from_quaternion(q), R, 1e-14)
    theirs = Rotation.from_matrix(R).as_quat()
    close(q, theirs if theirs @ q > 0 else -theirs, 1e-14)


@given(rotation_vectors(), st.floats(0.1, 10.0))
def test_a_quaternion_may_have_any_length_and_sign(phi: FloatArray, scale: float) -> None:
    q = so3.quaternion_xyzw(so3.exp_so3(phi))
    close(so3.rotation_from_quaternion(-scale * q), so3.exp_so3(phi), 1e-14)


@given(rotation_vectors())
def test_the_rotation_angle_is_the_length_of_the_rotation_vector(phi: FloatArray) -> None:
    close(so3.rotation_angle(so3.exp_so3(phi)), np.linalg.norm(phi), 1e-14)


@given(rotation_vectors(), st.floats(1e-6, 1.0))
def test_the_defect_of_a_rotation_is_zero_and_of_anything_else_is_not(phi: FloatArray, scale: float) -> None:
    R = so3.exp_so3(phi)
    assert so3.orthogonality_error(R) < 1e-14
    assert so3.orthogonality_error((1.0 + scale) * R) > scale
    assert so3.orthogonality_error(R @ np.diag([1.0, 1.0, -1.0])) == pytest.approx(2.0)


@given(st.lists(twists(), min_size=1, max_size=5))
def test_composed_increments_are_the_relative_motions(increments: list[FloatArray]) -> None:
    steps = se3.exp(np.array(increments))
    start = se3.exp(np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]))
    poses = se3.compose(steps, start)
    np.testing.assert_array_equal(poses[0], start)
    close(se3.relative(poses), steps, 1e-10)
    last = start
    for step in steps:
        last = last @ step
    close(poses[-1], last)


@given(twists(), directions())
def test_transforming_a_point_is_multiplying_its_homogeneous_coordinates(xi: FloatArray, point: FloatArray) -> None:
    T = se3.exp(xi)
    close(se3.transform(T, point), (T @ np.append(point, 1.0))[:3])


@given(st.lists(twists(), min_size=2, max_size=4))
def test_a_batch_is_its_members(batch: list[FloatArray]) -> None:
    stacked = np.array(batch)
    assume(len(stacked) > 1)
    for function in (
        se3.exp,
        se3.hat,
        se3.curly_hat,
        lambda xi: se3.log(se3.exp(xi)),
        lambda xi: se3.adjoint(se3.exp(xi)),
    ):
        one_by_one = np.array([function(xi) for xi in stacked])
        np.testing.assert_allclose(function(stacked), one_by_one, rtol=1e-13, atol=1e-13)


@given(st.integers(0, 2**20))
def test_no_rotation_is_nearer_to_a_matrix_than_the_nearest_one(seed: int) -> None:
    """For matrices of positive and of negative determinant, against rotations around it and anywhere."""
    random = np.random.default_rng(seed)
    matrices = random.normal(size=(2, 3, 3))
    nearest = so3.nearest_rotations(matrices)
    assert so3.orthogonality_error(nearest).max() < 1e-12
    for matrix, R in zip(matrices, nearest, strict=True):
        turns = np.concatenate([1e-3 * random.normal(size=(50, 3)), 3.0 * random.normal(size=(50, 3))])
        others = R @ so3.exp_so3(turns)
        assert np.linalg.norm(others - matrix, axis=(1, 2)).min() >= np.linalg.norm(R - matrix) - 1e-12
        np.testing.assert_allclose(so3.nearest_rotations(matrix), R)
