"""Filter and smoother share their data: the covariance of their difference is P - P_ref, by dense algebra."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare
from fgbaseline.compare.consistency.reference_nees import difference_covariance
from fgbaseline.data import Estimate
from fgbaseline.ekf import joint_ekf
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.smoother import isam2

from ..builders.synthetic import Scene, plain_problem


class LinearWalk:
    """x_k = x_(k-1) + w_k in six dimensions from x = 0 on, y_k = A_k x_k + v_k: both estimates by dense algebra."""

    T = 12

    def __init__(self, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        n = 6 * self.T
        steps = np.kron(np.eye(self.T), np.diag(np.repeat([1e-6, 1e-8], 3)))
        accumulate = np.kron(np.tril(np.ones((self.T, self.T))), np.eye(6))
        self.prior: FloatArray = accumulate @ steps @ accumulate.T
        A = random.normal(size=(self.T, 2, 6)) * np.repeat([1.0, 10.0], 3)
        self.H: FloatArray = np.zeros((2 * self.T, n))
        for k in range(self.T):
            self.H[2 * k : 2 * k + 2, 6 * k : 6 * k + 6] = A[k]
        self.R: FloatArray = 1e-6 * np.eye(2 * self.T)

    def gain(self, known: int) -> FloatArray:
        """(n, 2 T) the best linear estimate of all states from the first `known` frames' measurements."""
        H = self.H.copy()
        H[2 * known :] = 0.0
        K = self.prior @ H.T @ np.linalg.inv(H @ self.prior @ H.T + self.R)
        K[:, 2 * known :] = 0.0
        return K

    def covariance(self, known: int) -> FloatArray:
        """(n, n) of the error of that estimate."""
        I_KH = np.eye(len(self.prior)) - self.gain(known) @ self.H
        return I_KH @ self.prior @ I_KH.T + self.gain(known) @ self.R @ self.gain(known).T

    def of_difference(self, known: int) -> FloatArray:
        """(n, n) of smoothed minus filtered, from scratch: both are linear in the measurements."""
        D = self.gain(self.T) - self.gain(known)
        return D @ (self.H @ self.prior @ self.H.T + self.R) @ D.T


def block(matrix: FloatArray, k: int) -> FloatArray:
    return matrix[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]


def test_the_covariance_of_the_difference_is_the_difference_of_the_covariances() -> None:
    walk = LinearWalk()
    for k in range(walk.T - 3):
        P, P_ref = block(walk.covariance(k + 1), k), block(walk.covariance(walk.T), k)
        expected = block(walk.of_difference(k + 1), k)
        np.testing.assert_allclose(P - P_ref, expected, rtol=1e-6, atol=1e-9 * np.abs(P).max())
        np.testing.assert_allclose(difference_covariance(P[None], P_ref[None])[0], P - P_ref)


def test_their_nees_is_six_and_adding_the_covariances_would_hide_it() -> None:
    """Drawn from the model: the sum of the two covariances, as for independent errors, gives far less than 6."""
    walk, k = LinearWalk(), 5
    known, L = k + 1, np.linalg.cholesky(walk.prior)
    P, P_ref = block(walk.covariance(known), k), block(walk.covariance(walk.T), k)
    random, n = np.random.default_rng(5), 2000
    x = random.normal(size=(n, len(L))) @ L.T
    y = x @ walk.H.T + 1e-3 * random.normal(size=(n, 2 * walk.T))
    filtered, smoothed = ((y @ walk.gain(m).T)[:, 6 * k : 6 * k + 6] for m in (known, walk.T))

    def estimate(name: str, states: FloatArray, covariance: FloatArray) -> Estimate:
        return Estimate(name, se3.exp(states), np.zeros(0, dtype=np.bool_), covariance=np.tile(covariance, (n, 1, 1)))

    result = compare.reference_nees(estimate("f", filtered, P), estimate("s", smoothed, P_ref))
    assert result.comparable.all()
    assert not result.left_out.any()
    low, high = chi2.ppf([0.001, 0.999], 6 * n) / n
    assert low < result.nees.mean() < high
    independent = np.einsum("ni,ij,nj->n", smoothed - filtered, np.linalg.inv(P + P_ref), smoothed - filtered)
    assert independent.mean() < 3.0


def test_frames_where_the_difference_covariance_is_indefinite_are_counted_and_left_out() -> None:
    walk = LinearWalk()
    P, P_ref = block(walk.covariance(6), 5), block(walk.covariance(walk.T), 5)
    poses = np.tile(np.eye(4), (4, 1, 1))
    mine = Estimate("f", poses, np.zeros(0, dtype=np.bool_), covariance=np.stack([P, 0.5 * P_ref, P_ref, 0 * P]))
    its = replace(mine, covariance=np.tile(P_ref, (4, 1, 1)))
    result = compare.reference_nees(mine, its)
    assert result.comparable.tolist() == [True, True, True, False]
    assert result.left_out.tolist() == [False, True, True, False]
    assert np.isfinite(result.nees).tolist() == [True, False, False, False]
    assert not compare.reference_nees(replace(mine, covariance=None), its).comparable.any()


def test_the_jacobian_is_that_of_the_logarithm() -> None:
    random = np.random.default_rng(3)
    d = random.normal(size=(5, 6)) * np.repeat([3.0, 0.4], 3)
    J, step = se3.inverse_right_jacobian(d), 1e-4
    for i, e in enumerate(step * np.eye(6)):
        numeric = (se3.log(se3.exp(d) @ se3.exp(e)) - se3.log(se3.exp(d) @ se3.exp(-e))) / (2.0 * step)
        np.testing.assert_allclose(J[:, :, i], numeric, rtol=1e-6, atol=1e-6)


def test_a_consistent_filter_is_consistent_with_the_smoother_of_the_same_problem() -> None:
    """Textbook noise, many seeds: the middle of the path, where the filter knows much less than the smoother."""
    values = []
    for seed in range(12):
        problem = plain_problem(Scene(seed=seed, frames=8, n_points=6).sequence())
        result = compare.reference_nees(joint_ekf(problem), isam2(problem))
        values += result.nees[2:5].tolist()
    known = np.asarray(values)[np.isfinite(values)]
    assert len(known) > 12
    assert np.median(known) == pytest.approx(chi2.median(6), rel=0.5)
