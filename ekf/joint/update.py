"""The joint update: what a frame's observations say of the pose and every active landmark.

H has, for an observation, the six columns of the pose and the three of its landmark; nothing else is stored. With
S = H P H^T + R = L L^T and W = L^-1 H P the update is

    delta = W^T L^-1 r    and    P <- P - W^T W,

which is K = P H^T S^-1 and (I - K H) P with every product formed once, symmetric to the last bit.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement import squared_norm

from .state import POSE


@dataclass(frozen=True, eq=False, slots=True)
class StackedJacobian:
    """H of n observations: (3n, size), with nine columns that are not zero in each block of three rows."""

    slot: IntArray
    """(n,) of the landmark that each observation sees"""
    pose_jacobian: FloatArray
    """(n, 3, 6)"""
    landmark_jacobian: FloatArray
    """(n, 3, 3)"""
    n_body: int = POSE
    """where the landmarks begin; what is between the pose and them, an observation does not depend on"""

    def multiply(self, matrix: FloatArray) -> FloatArray:
        """H A (3n, c) of a matrix A (size, c)."""
        n, c = len(self.slot), matrix.shape[1]
        product = self.landmark_jacobian @ matrix[self.n_body :].reshape(-1, 3, c)[self.slot]
        product += (self.pose_jacobian.reshape(3 * n, POSE) @ matrix[:POSE]).reshape(n, 3, c)
        return product.reshape(3 * n, c)

    def select(self, chosen: BoolArray) -> "StackedJacobian":
        """Only the chosen observations."""
        return StackedJacobian(
            self.slot[chosen], self.pose_jacobian[chosen], self.landmark_jacobian[chosen], self.n_body
        )


class NotPositiveDefiniteError(Exception):
    """H P H^T + R has no Cholesky factor: P is no covariance any more."""


class CholeskyFactor(NamedTuple):
    """S = H P H^T + R = L L^T."""

    L: FloatArray
    """(3n, 3n), lower"""
    whitened: FloatArray
    """(3n,) L^-1 nu"""

    @staticmethod
    def of(HPHt: FloatArray, residual: FloatArray, variance: FloatArray) -> "CholeskyFactor":
        """Of H P H^T (3n, 3n), left as it is, residuals nu (n, 3) and the diagonal of R (n, 3), or (3,) for each, px^2.

        Raises NotPositiveDefiniteError.
        """
        S = HPHt.copy()
        diagonal = S.reshape(-1)[:: len(S) + 1].reshape(-1, 3)
        diagonal += variance
        L, failed = dpotrf(S.T, lower=1, clean=0, overwrite_a=1)
        if failed or not np.isfinite(L[-1, -1]):
            raise NotPositiveDefiniteError
        return CholeskyFactor(L, dtrsv(L, residual.reshape(-1), lower=1))

    @property
    def nis(self) -> float:
        """nu^T S^-1 nu: the normalized innovation squared of all observations at once."""
        return float(self.whitened @ self.whitened)


@dataclass(frozen=True, eq=False)
class Innovation:
    """What n observations say beyond the prediction, and how sure the prediction was of them."""

    H: StackedJacobian
    residual: FloatArray
    """(n, 3) measured minus predicted, px"""
    HP: FloatArray
    """(3n, size)"""
    HPHt: FloatArray
    """(3n, 3n)"""

    @staticmethod
    def of(H: StackedJacobian, residual: FloatArray, P: FloatArray) -> "Innovation":
        """The innovation of residuals (n, 3) under a covariance (size, size)."""
        HP = H.multiply(P)
        return Innovation(H, residual, HP, H.multiply(np.ascontiguousarray(HP.T)))

    def __len__(self) -> int:
        return len(self.residual)

    def nis_per_observation(self, variance: FloatArray) -> FloatArray:
        """(n,) r^T (H P H^T + R)^-1 r of each observation alone, R = diag(variance (3,))."""
        n = np.arange(len(self))
        own = self.HPHt.reshape(len(self), 3, len(self), 3)[n, :, n]  # the blocks on the diagonal
        return squared_norm(self.residual, own + np.diag(variance))

    def factorize(self, variance: FloatArray) -> CholeskyFactor:
        """S = L L^T with R = diag(variance (n, 3)), or (3,) for each. Raises NotPositiveDefiniteError."""
        return CholeskyFactor.of(self.HPHt, self.residual, variance)

    def select(self, chosen: BoolArray) -> "Innovation":
        """Only the chosen observations."""
        if chosen.all():
            return self
        rows = np.repeat(chosen, 3)
        return Innovation(
            self.H.select(chosen), self.residual[chosen], self.HP[rows], np.ascontiguousarray(self.HPHt[rows][:, rows])
        )


def kalman_update(innovation: Innovation, factor: CholeskyFactor, P: FloatArray) -> FloatArray:
    """The correction delta (size,) of the error state; P (size, size) is updated in place.

    `factor` is the innovation's with the R that it is to be weighted by. Uses the innovation up.
    """
    W_transposed = dtrsm(1.0, factor.L, innovation.HP.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    delta: FloatArray = W_transposed @ factor.whitened
    P -= W_transposed @ W_transposed.T
    return delta
