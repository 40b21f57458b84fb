"""Joint measurement update of the pose and every active landmark.

H has, for an observation of r rows, the six columns of the pose and the three of its landmark; nothing else is stored.
With S = H P H^T + R = L L^T and W = L^-1 H P the update is

    delta = W^T L^-1 r    and    P <- P - W^T W,

which equals K = P H^T S^-1 and (I - K H) P with every product formed once, and is symmetric to the last bit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf, dpotri

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement_model import mahalanobis_squared

from ..motion_model import POSE

PANEL = 192
"""block size of matrix products, rows or columns: a block stays in the cache"""


@dataclass(frozen=True, eq=False, slots=True)
class StackedJacobian:
    """Measurement Jacobian H (rn, size) of n observations, with nine nonzero columns in each block of r rows."""

    slot: IntArray
    """(n,) slot of the observed landmark"""
    pose_jacobian: FloatArray
    """(n, r, 6) w.r.t. the right perturbation [v, w] of the pose"""
    landmark_jacobian: FloatArray
    """(n, r, 3) w.r.t. the coordinates of the landmark in its chart"""
    n_body: int = POSE
    """offset of the landmarks in the error state; columns between pose and landmarks (velocity, biases) are zero"""

    def multiply(self, matrix: FloatArray) -> FloatArray:
        """Product H A (rn, c) with a matrix A (size, c)."""
        (n, r, _), c = self.pose_jacobian.shape, matrix.shape[1]
        product, landmarks = np.empty((n, r, c)), matrix[self.n_body :].reshape(-1, 3, c)
        for first in range(0, n, PANEL // 3):
            part = slice(first, first + PANEL // 3)
            np.matmul(self.landmark_jacobian[part], landmarks[self.slot[part]], out=product[part])
            product[part] += (self.pose_jacobian[part].reshape(-1, POSE) @ matrix[:POSE]).reshape(-1, r, c)
        return product.reshape(r * n, c)

    def own_blocks(self, HP: FloatArray) -> FloatArray:
        """Blocks (n, r, r) on the diagonal of H P H^T, from H P (rn, size)."""
        rows = HP.reshape(*self.pose_jacobian.shape[:2], -1)
        columns = self.n_body + 3 * self.slot[:, None] + np.arange(3)
        of_landmark = np.take_along_axis(rows, columns[:, None, :], axis=2)
        of_pose = rows[:, :, :POSE] @ np.swapaxes(self.pose_jacobian, 1, 2)
        return np.asarray(of_pose + of_landmark @ np.swapaxes(self.landmark_jacobian, 1, 2))

    def select(self, chosen: BoolArray | IntArray | slice) -> "StackedJacobian":
        """Rows of the chosen observations: a mask (n,), indices or a slice."""
        return StackedJacobian(
            self.slot[chosen], self.pose_jacobian[chosen], self.landmark_jacobian[chosen], self.n_body
        )


class NotPositiveDefiniteError(Exception):
    """H P H^T + R has no Cholesky factor: P is not positive semidefinite."""


class CholeskyFactor(NamedTuple):
    """Cholesky factor of the innovation covariance: S = H P H^T + R = L L^T."""

    L: FloatArray
    """(rn, rn), lower"""
    whitened: FloatArray
    """(rn,) L^-1 nu"""

    @staticmethod
    def of(
        HPHt: FloatArray, residual: FloatArray, variance: FloatArray, *, overwrite: bool = False
    ) -> "CholeskyFactor":
        """Factorize H P H^T (rn, rn) plus R of diagonal (n, r) or (r,), px^2; whiten nu (n, r), px.

        H P H^T is modified only with `overwrite`. Raises NotPositiveDefiniteError.
        """
        S = HPHt if overwrite else HPHt.copy()
        diagonal = S.reshape(-1)[:: len(S) + 1].reshape(residual.shape)
        diagonal += variance
        L, failed = dpotrf(S.T, lower=1, clean=0, overwrite_a=1)
        if failed or not np.isfinite(L[-1, -1]):
            raise NotPositiveDefiniteError
        return CholeskyFactor(L, dtrsv(L, residual.reshape(-1), lower=1))

    def reweighted(self, residual: FloatArray, added: FloatArray) -> "CholeskyFactor":
        """Factor of the first m observations, of nu (m, r), with more noise in the last k of these: R + diag(added).

        `added` is (k, r), px^2. Only the trailing block of these k is factorized again; where m = n, `self.L` is
        reused and overwritten. Raises NotPositiveDefiniteError.
        """
        last = residual.size
        first = last - added.size
        L = self.L if last == len(self.L) else np.asfortranarray(self.L[:last, :last])
        if added.size:
            own = np.tril(L[first:, first:])
            S = own @ own.T
            S.reshape(-1)[:: len(S) + 1] += added.reshape(-1)
            L[first:, first:], failed = dpotrf(S, lower=1, clean=0)
            if failed:
                raise NotPositiveDefiniteError
        return CholeskyFactor(L, dtrsv(L, residual.reshape(-1), lower=1))

    @property
    def nis(self) -> float:
        """Normalized innovation squared nu^T S^-1 nu of all observations at once."""
        return float(self.whitened @ self.whitened)


@dataclass(frozen=True, eq=False)
class Innovation:
    """Innovation of n observations, with H and H P."""

    H: StackedJacobian
    residual: FloatArray
    """(n, r) measured minus predicted, px"""
    HP: FloatArray
    """(rn, size) cross-covariance of the predicted rows and the error of the state"""

    @staticmethod
    def of(H: StackedJacobian, residual: FloatArray, P: FloatArray) -> "Innovation":
        """Innovation of residuals (n, r), px, under the state covariance P (size, size)."""
        return Innovation(H, residual, H.multiply(P))

    def __len__(self) -> int:
        return len(self.residual)

    def nis_per_observation(self, variance: FloatArray) -> FloatArray:
        """NIS (n,) of each observation alone: r^T (H P H^T + R)^-1 r, R = diag(variance), (n, r) or (r,), px^2."""
        return mahalanobis_squared(self.residual, self.own_covariances(variance))

    def own_covariances(self, variance: FloatArray) -> FloatArray:
        """Covariances (n, r, r) of each innovation alone, px^2: H P H^T + R, R = diag(variance), (n, r) or (r,)."""
        own = self.H.own_blocks(self.HP)
        return np.asarray(own + np.eye(own.shape[-1]) * variance[..., None, :])

    def nis_given_others(self, variance: FloatArray) -> FloatArray:
        """NIS (n,) of each observation under its prediction from the state and all other observations.

        With z = S^-1 nu and B_i the i-th block (r, r) on the diagonal of S^-1 it is z_i^T B_i^-1 z_i, because B_i^-1 is
        the covariance of the i-th innovation given the others, and B_i^-1 z_i its deviation from its mean.
        R = diag(variance), (n, r) or (r,). Raises NotPositiveDefiniteError.
        """
        factor = self.factorize(variance)
        inverse, failed = dpotri(factor.L, lower=1)
        if failed:
            raise NotPositiveDefiniteError
        z = dtrsv(factor.L, factor.whitened, lower=1, trans=1).reshape(self.residual.shape)
        n, r = len(self), self.residual.shape[1]
        each = np.arange(n)
        lower = np.tril(inverse.reshape(n, r, n, r)[each, :, each, :])
        return mahalanobis_squared(z, lower + np.swapaxes(np.tril(lower, -1), 1, 2))

    def factorize(self, variance: FloatArray) -> CholeskyFactor:
        """Factor of S for R = diag(variance), (n, r) or (r,), px^2. Raises NotPositiveDefiniteError."""
        HPHt = self.H.multiply(np.ascontiguousarray(self.HP.T))
        return CholeskyFactor.of(HPHt, self.residual, variance, overwrite=True)

    def in_order(self, order: IntArray) -> "Innovation":
        """Innovation of the observations in another order (n,)."""
        if (np.diff(order) > 0).all():
            return self
        HP = self.HP.reshape(len(self), -1)[order].reshape(self.HP.shape)
        return Innovation(self.H.select(order), self.residual[order], HP)

    def first(self, n: int) -> "Innovation":
        """Innovation of the first n observations."""
        return Innovation(self.H.select(slice(n)), self.residual[:n], self.HP[: n * self.residual.shape[1]])


def kalman_update(innovation: Innovation, factor: CholeskyFactor, P: FloatArray) -> FloatArray:
    """Kalman update: returns the correction delta (size,) of the error state; P (size, size) is updated in place.

    `factor` is the factor of S with the weighted R. `innovation.HP` is overwritten, and with it the arrays of which it
    is a view.
    """
    W_transposed = dtrsm(1.0, factor.L, innovation.HP.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    delta: FloatArray = W_transposed @ factor.whitened
    subtract_symmetric(P, lambda rows, columns: W_transposed[rows] @ W_transposed[columns].T)
    return delta


def subtract_symmetric(P: FloatArray, block: Callable[[slice, slice], FloatArray]) -> None:
    """Subtract a symmetric matrix from a symmetric one (n, n), in place; `block` gives its rows and columns.

    The work goes by panels from the diagonal down, mirrored above: each product is formed once and read from the cache.
    """
    for first in range(0, len(P), PANEL):
        own, below = slice(first, first + PANEL), slice(first + PANEL, len(P))
        P[own, own] -= block(own, own)
        P[own, own] = 0.5 * (P[own, own] + P[own, own].T)
        if below.start < below.stop:
            P[below, own] -= block(below, own)
            P[own, below] = P[below, own].T
