"""Joint measurement update of the pose and every active landmark.

H has, for an observation, the six columns of the pose and the three of its landmark; nothing else is stored. With
S = H P H^T + R = L L^T and W = L^-1 H P the update is

    delta = W^T L^-1 r    and    P <- P - W^T W,

which equals K = P H^T S^-1 and (I - K H) P with every product formed once, and is symmetric to the last bit.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement import squared_norm

from ..motion_model import POSE


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
        product = self.landmark_jacobian @ matrix[self.n_body :].reshape(-1, 3, c)[self.slot]
        product += (self.pose_jacobian.reshape(3 * n, POSE) @ matrix[:POSE]).reshape(n, 3, c)
        return product.reshape(3 * n, c)

    def select(self, chosen: BoolArray) -> "StackedJacobian":
        """Rows of the chosen observations (n,)."""
        return StackedJacobian(
            self.slot[chosen], self.pose_jacobian[chosen], self.landmark_jacobian[chosen], self.n_body
        )


class NotPositiveDefiniteError(Exception):
    """H P H^T + R has no Cholesky factor: P is not positive semidefinite."""


class CholeskyFactor(NamedTuple):
    """Cholesky factor of the innovation covariance, S = H P H^T + R = L L^T."""

    L: FloatArray
    """(3n, 3n), lower"""
    whitened: FloatArray
    """(3n,) L^-1 nu"""

    @staticmethod
    def of(HPHt: FloatArray, residual: FloatArray, variance: FloatArray) -> "CholeskyFactor":
        """Factorize H P H^T (3n, 3n), not modified, plus R of diagonal (n, 3) or (3,), px^2; whiten nu (n, 3), px.

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
    HPHt: FloatArray
    """(3n, 3n)"""

    @staticmethod
    def of(H: StackedJacobian, residual: FloatArray, P: FloatArray) -> "Innovation":
        """Innovation of residuals (n, 3), px, under the state covariance P (size, size)."""
        HP = H.multiply(P)
        return Innovation(H, residual, HP, H.multiply(np.ascontiguousarray(HP.T)))

    def __len__(self) -> int:
        return len(self.residual)

    def nis_per_observation(self, variance: FloatArray) -> FloatArray:
        """NIS (n,) of each observation alone: r^T (H P H^T + R)^-1 r, R = diag(variance (3,))."""
        n = np.arange(len(self))
        own = self.HPHt.reshape(len(self), 3, len(self), 3)[n, :, n]  # the blocks on the diagonal
        return squared_norm(self.residual, own + np.diag(variance))

    def factorize(self, variance: FloatArray) -> CholeskyFactor:
        """Factor of S for R = diag(variance), (n, 3) or (3,), px^2. Raises NotPositiveDefiniteError."""
        return CholeskyFactor.of(self.HPHt, self.residual, variance)

    def select(self, chosen: BoolArray) -> "Innovation":
        """Innovation of the chosen observations (n,)."""
        if chosen.all():
            return self
        rows = np.repeat(chosen, 3)
        return Innovation(
            self.H.select(chosen), self.residual[chosen], self.HP[rows], np.ascontiguousarray(self.HPHt[rows][:, rows])
        )


def kalman_update(innovation: Innovation, factor: CholeskyFactor, P: FloatArray) -> FloatArray:
    """Kalman update: returns the correction delta (size,) of the error state; P (size, size) is updated in place.

    `factor` is that of S with the weighted R. The arrays of `innovation` are overwritten.
    """
    W_transposed = dtrsm(1.0, factor.L, innovation.HP.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    delta: FloatArray = W_transposed @ factor.whitened
    P -= W_transposed @ W_transposed.T
    return delta
