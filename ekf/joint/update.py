"""Joint measurement update of the pose and every active landmark.

H has, for an observation, the six columns of the pose and the three of its landmark; nothing else is stored. With
S = H P H^T + R = L L^T and W = L^-1 H P the update is

    delta = W^T L^-1 r    and    P <- P - W^T W,

which equals K = P H^T S^-1 and (I - K H) P with every product formed once, and is symmetric to the last bit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement import squared_norm

from ..motion_model import POSE

PANEL = 192
"""rows or columns that are worked on at a time"""


@dataclass(frozen=True, eq=False, slots=True)
class StackedJacobian:
    """Measurement Jacobian H (3n, size) of n observations, with nine nonzero columns in each block of three rows."""

    slot: IntArray
    """(n,) slot of the observed landmark"""
    pose_jacobian: FloatArray
    """(n, 3, 6)"""
    landmark_jacobian: FloatArray
    """(n, 3, 3)"""
    n_body: int = POSE
    """offset of the landmarks; columns between pose and landmarks (the bias) are zero"""

    def multiply(self, matrix: FloatArray) -> FloatArray:
        """Product H A (3n, c) with a matrix A (size, c)."""
        n, c = len(self.slot), matrix.shape[1]
        product, landmarks = np.empty((n, 3, c)), matrix[self.n_body :].reshape(-1, 3, c)
        for first in range(0, n, PANEL // 3):
            part = slice(first, first + PANEL // 3)
            np.matmul(self.landmark_jacobian[part], landmarks[self.slot[part]], out=product[part])
            product[part] += (self.pose_jacobian[part].reshape(-1, POSE) @ matrix[:POSE]).reshape(-1, 3, c)
        return product.reshape(3 * n, c)

    def own_blocks(self, HP: FloatArray) -> FloatArray:
        """Blocks (n, 3, 3) on the diagonal of H P H^T, from H P (3n, size)."""
        rows = HP.reshape(len(self.slot), 3, -1)
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
    """(3n, 3n), lower"""
    whitened: FloatArray
    """(3n,) L^-1 nu"""

    @staticmethod
    def of(
        HPHt: FloatArray, residual: FloatArray, variance: FloatArray, *, overwrite: bool = False
    ) -> "CholeskyFactor":
        """Factorize H P H^T (3n, 3n) plus R of diagonal (n, 3) or (3,), px^2; whiten nu (n, 3), px.

        H P H^T is modified only with `overwrite`. Raises NotPositiveDefiniteError.
        """
        S = HPHt if overwrite else HPHt.copy()
        diagonal = S.reshape(-1)[:: len(S) + 1].reshape(-1, 3)
        diagonal += variance
        L, failed = dpotrf(S.T, lower=1, clean=0, overwrite_a=1)
        if failed or not np.isfinite(L[-1, -1]):
            raise NotPositiveDefiniteError
        return CholeskyFactor(L, dtrsv(L, residual.reshape(-1), lower=1))

    def reweighted(self, residual: FloatArray, added: FloatArray) -> "CholeskyFactor":
        """Factor of the first m observations, of nu (m, 3), with more noise in the last k of these: R + diag(added).

        `added` is (k, 3), px^2. The other columns of L are those of the factor without it, which is overwritten. Raises
        NotPositiveDefiniteError.
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
    """Innovation of n observations with the covariance of its prediction."""

    H: StackedJacobian
    residual: FloatArray
    """(n, 3) measured minus predicted, px"""
    HP: FloatArray
    """(3n, size)"""

    @staticmethod
    def of(H: StackedJacobian, residual: FloatArray, P: FloatArray) -> "Innovation":
        """Innovation of residuals (n, 3), px, under the state covariance P (size, size)."""
        return Innovation(H, residual, H.multiply(P))

    def __len__(self) -> int:
        return len(self.residual)

    def nis_per_observation(self, variance: FloatArray) -> FloatArray:
        """NIS (n,) of each observation alone: r^T (H P H^T + R)^-1 r, R = diag(variance (3,))."""
        return squared_norm(self.residual, self.H.own_blocks(self.HP) + np.diag(variance))

    def factorize(self, variance: FloatArray) -> CholeskyFactor:
        """Factor of S for R = diag(variance), (n, 3) or (3,), px^2. Raises NotPositiveDefiniteError."""
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
        return Innovation(self.H.select(slice(n)), self.residual[:n], self.HP[: 3 * n])


def kalman_update(innovation: Innovation, factor: CholeskyFactor, P: FloatArray) -> FloatArray:
    """Kalman update: returns the correction delta (size,) of the error state; P (size, size) is updated in place.

    `factor` is that of S with the weighted R. The arrays of `innovation` are overwritten.
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
