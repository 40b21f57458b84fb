"""Time spent in GTSAM's own calls: its methods are wrapped while one measures, and the packages know nothing of it."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import gtsam

INCREMENTAL = "ISAM2.update and calculateEstimate"
OTHER = "other calls of GTSAM"

CALLS: Mapping[str, Mapping[type, tuple[str, ...]]] = {
    INCREMENTAL: {
        gtsam.ISAM2: (
            "update",
            "calculateEstimate",
            "calculateEstimatePoint3",
            "calculateEstimatePose3",
            "calculateBestEstimate",
        )
    },
    OTHER: {
        gtsam.ISAM2: ("__init__", "marginalCovariance", "getFactorsUnsafe", "getLinearizationPoint", "getDelta"),
        gtsam.NonlinearFactorGraph: ("linearize", "error"),
        gtsam.GaussianFactorGraph: ("optimize", "eliminateSequential", "eliminateMultifrontal", "marginal", "hessian"),
        gtsam.Ordering: ("ColamdNonlinearFactorGraph",),
        gtsam.Values: ("retract", "__init__"),
        gtsam.LevenbergMarquardtOptimizer: ("__init__",),
        gtsam.NonlinearOptimizer: ("optimize",),
        gtsam.Marginals: ("__init__", "marginalCovariance", "jointMarginalCovariance"),
    },
}
"""calls of each category, by class; factors that are built and values that are inserted are ours"""


@dataclass
class Spent:
    """Processor seconds in GTSAM's calls, by category."""

    seconds: dict[str, float]


@contextmanager
def gtsam_timed() -> Iterator[Spent]:
    """Counts the time of GTSAM's calls within the block."""
    spent = Spent(dict.fromkeys(CALLS, 0.0))
    originals = []
    for kind, classes in CALLS.items():
        for owner, names in classes.items():
            for name in names:
                if name not in vars(owner):
                    raise RuntimeError(f"this GTSAM has no {owner.__name__}.{name}: say anew what is to be counted")
                originals.append((owner, name, vars(owner)[name]))
                setattr(owner, name, _timed(getattr(owner, name), vars(owner)[name], kind, spent))
    try:
        yield spent
    finally:
        for owner, name, original in originals:
            setattr(owner, name, original)


def _timed(call: Callable[..., Any], original: object, kind: str, spent: Spent) -> object:
    def timed(*arguments: Any, **named: Any) -> Any:
        start = time.process_time()
        try:
            return call(*arguments, **named)
        finally:
            spent.seconds[kind] += time.process_time() - start

    return staticmethod(timed) if isinstance(original, staticmethod) else timed
