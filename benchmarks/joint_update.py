"""A frame of `joint-ekf` beside the dense algebra that no filter of its kind can do without: both take turns.

`python -m benchmarks.joint_update` prints processor seconds as JSON. After each frame, with 3n rows and `size`
components of the state, come one Cholesky of the innovation covariance (3n, 3n), one triangular solve of H P (3n, size)
and one symmetric update of P (size, size), on arrays of these sizes, with the BLAS and the one thread of the filter.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import json
import time

import click
import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf
from threadpoolctl import threadpool_limits

from fgbaseline.data.simulate import Simulation
from fgbaseline.ekf.joint.filter import JointFilter
from fgbaseline.ekf.joint.settings import JointSettings
from fgbaseline.ekf.joint.update import CholeskyFactor, Innovation
from fgbaseline.geometry import FloatArray

from .growth import posed

SKIPPED = 5
"""first frames, until there are as many landmarks as later"""


class SizedFilter(JointFilter):
    """The filter, which remembers the sizes of its last update."""

    sizes: tuple[int, int] | None = None
    """3n and size"""

    def _record_nis(self, k: int, innovation: Innovation, variance: FloatArray) -> CholeskyFactor | None:
        self.sizes = (innovation.HP.shape[0], innovation.HP.shape[1])
        return super()._record_nis(k, innovation, variance)


def algebra(rows: int, size: int, random: np.random.Generator) -> float:
    """Processor seconds of the three products alone."""
    half = random.standard_normal((rows, 8))
    S, HP = np.asfortranarray(half @ half.T + np.eye(rows)), random.standard_normal((rows, size))
    P = np.asfortranarray(np.eye(size))
    start = time.process_time()
    L, _ = dpotrf(S, lower=1, clean=0, overwrite_a=1)
    W = dtrsm(1.0, L, HP.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    dsyrk(-1.0, W, beta=1.0, c=P, lower=1, overwrite_c=1)
    return time.process_time() - start


def measured(features: float, frames: int) -> dict[str, float]:
    """Seconds of all frames and of their algebra, and the mean number of observations of a frame."""
    problem = posed(Simulation(duration=frames / 10.0, features_per_frame=features, seed=1))
    joint, random = SizedFilter(problem, JointSettings()), np.random.default_rng(0)
    taken: list[tuple[float, float]] = []
    observed: list[int] = []
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"):
        for k, seen in enumerate(problem.observations().by_frame(problem.n_frames)):
            joint.sizes = None
            start = time.process_time()
            joint.process_frame(k, seen)
            seconds = time.process_time() - start
            if k >= SKIPPED and joint.sizes is not None:
                taken.append((seconds, algebra(*joint.sizes, random)))
                observed.append(seen.stop - seen.start)
    frame, floor = np.sum(taken, axis=0)
    return {"frames": float(frame), "algebra": float(floor), "observations": float(np.mean(observed))}


@click.command()
@click.option("--features", type=float, default=300.0, show_default=True, help="In a frame.")
@click.option("--frames", type=click.IntRange(min=10), default=60, show_default=True)
def main(features: float, frames: int) -> None:
    """Time the filter and its algebra."""
    click.echo(json.dumps(measured(features, frames)))


if __name__ == "__main__":
    main()
