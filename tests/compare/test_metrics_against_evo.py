"""Every metric that evo has too: on random trajectories and on those the recordings give, to 1e-9."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data
from fgbaseline.compare import PoseRelation, Unit
from fgbaseline.data import Sequence, Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3

from ..builders.evo_metrics import ALIGNMENTS, OF_POSES, evo_aligned, evo_ape, evo_rpe

SEEDS = 34
"""times six alignments: more than 200 random pairs of trajectories"""


def random_pair(seed: int) -> tuple[FloatArray, FloatArray]:
    """Poses of a walk with turns, of any size and any place, and of an estimate that has its own world and scale."""
    random = np.random.default_rng(seed)
    n = int(random.integers(8, 16))
    size, turn = 10.0 ** random.uniform(-2, 3), 10.0 ** random.uniform(-2, 0.3)
    steps = random.normal(size=(n - 1, 6)) * np.repeat([size, turn], 3)
    steps[:, 0] += 2.0 * size
    start = se3.exp(np.concatenate([random.normal(size=3) * 100 * size, random.normal(size=3)]))
    reference = se3.compose(se3.exp(steps), start)
    noise = 10.0 ** random.uniform(-6, -0.5)
    estimate = reference @ se3.exp(noise * random.normal(size=(n, 6)) * np.repeat([size, 1.0], 3))
    estimate[:, :3, 3] *= random.uniform(0.5, 2.0)
    return reference, se3.exp(random.normal(size=6) * np.repeat([size, 1.0], 3)) @ estimate


def matched(reference: FloatArray, estimate: FloatArray) -> compare.MatchedTrajectories:
    t = 0.1 * np.arange(len(reference))
    return compare.associate(Trajectory(t, reference, "reference"), Trajectory(t, estimate, "estimate"))


def assert_same(ours: FloatArray, evos: FloatArray, size: float) -> None:
    """To 1e-9, relative, or absolute near zero: of the size of the paths for what is in meters."""
    assert len(ours) == len(evos)
    np.testing.assert_allclose(ours, evos, rtol=1e-9, atol=1e-9 * max(1.0, size))


def assert_absolute_as_evo(reference: FloatArray, estimate: FloatArray, alignment: str) -> None:
    kind, first = ALIGNMENTS[alignment]
    ours = matched(reference, estimate).aligned(kind, first=first)
    path = evo_aligned(estimate, reference, alignment)
    size = float(np.abs(np.stack([reference, estimate])).max())
    np.testing.assert_allclose(ours.estimate.world_T_body, np.array(path.poses_se3), rtol=1e-9, atol=1e-9 * size)
    table = compare.absolute_errors(ours)
    for what in OF_POSES:
        errors = compare.absolute_pose_error(ours.estimate.world_T_body, ours.reference.world_T_body, what)
        assert_same(errors, evo_ape(reference, path, what), size)
        if what in table:
            np.testing.assert_array_equal(table[what], errors)


def assert_relative_as_evo(
    reference: FloatArray, estimate: FloatArray, alignment: str, delta: float, unit: Unit, all_pairs: bool, mine: bool
) -> int:
    """How many pairs there were; `mine`: they are looked for on the reference."""
    kind, first = ALIGNMENTS[alignment]
    ours = matched(reference, estimate).aligned(kind, first=first)
    path = evo_aligned(estimate, reference, alignment)
    n, size = 0, float(np.abs(ours.estimate.position).max())
    for what, errors in evo_rpe(reference, path, delta, unit, all_pairs, mine):
        pairs = compare.matched_pairs(ours, delta, unit, all_pairs=all_pairs, from_reference=mine)
        own = compare.relative_pose_error(ours.estimate.world_T_body, ours.reference.world_T_body, pairs, what)
        assert_same(own[np.isfinite(own)] if what is PoseRelation.DISTANCE_PERCENT else own, errors, size)
        n = len(pairs)
    if n == 0:
        with pytest.raises(InputError, match="no two of the"):
            compare.matched_pairs(ours, delta, unit, all_pairs=all_pairs, from_reference=mine)
    return n


@pytest.mark.parametrize("alignment", ALIGNMENTS)
def test_absolute_and_relative_errors_of_random_trajectories(alignment: str) -> None:
    pairs = 0
    for k in range(SEEDS):
        seed = 1000 * list(ALIGNMENTS).index(alignment) + k
        reference, estimate = random_pair(seed)
        assert_absolute_as_evo(reference, estimate, alignment)
        random = np.random.default_rng(seed)
        steps = np.linalg.norm(np.diff(reference[:, :3, 3], axis=0), axis=1)
        deltas = {
            Unit.FRAMES: int(random.integers(1, 6)),
            Unit.METERS: float(random.uniform(0.5, 4.0) * np.median(steps)),
            Unit.DEGREES: float(random.uniform(5.0, 120.0)),
        }
        for unit, delta in deltas.items():
            all_pairs, mine = bool((k + list(deltas).index(unit)) % 2), bool(k // 2 % 2)
            pairs += assert_relative_as_evo(reference, estimate, alignment, delta, unit, all_pairs, mine)
    assert pairs > 5 * SEEDS


def dead_reckoned(sequence: Sequence, turned: bool = False) -> FloatArray:
    """Equation 9's mean; `turned`: with the signs of w_y and w_z changed."""
    w = sequence.angular_velocity * ([1.0, -1.0, -1.0] if turned else [1.0, 1.0, 1.0])
    u = np.concatenate([sequence.linear_velocity, w], axis=1)
    return se3.compose(se3.exp(u[:-1] * sequence.dt[:, None]))


REAL = [
    "03.npz",
    "10_imu_only.npz",
    "ece276a_2020/0027.npz",
    *(f"utias/2011_{drive}_sync_KLT.mat" for drive in ("09_26_drive_0001", "09_26_drive_0005", "09_26_drive_0009")),
    *(f"utias/2011_{drive}_sync_KLT.mat" for drive in ("09_26_drive_0036", "09_30_drive_0027")),
    "utias/dataset3.mat",
]


@pytest.fixture(scope="module", params=REAL)
def real_pair(request: pytest.FixtureRequest, recordings: Callable[[str], Path]) -> tuple[FloatArray, FloatArray]:
    """Truth and dead reckoning; dead reckoning in two readings of the axes where there is no truth."""
    name: str = request.param
    sequence = data.read(recordings(name))
    if name.startswith("ece276a"):
        sequence = data.attach_truth(sequence, recordings("ground_truth/kitti_odometry_07.txt"), "camera")
    if sequence.truth is None:
        return dead_reckoned(sequence), dead_reckoned(sequence, turned=True)
    known = sequence.truth.known
    truth = Trajectory(sequence.t[known], sequence.truth.world_T_imu[known])  # an extrinsic is exact to 1e-8 only
    return truth.world_T_body, dead_reckoned(sequence)[known]


@pytest.mark.parametrize("alignment", ALIGNMENTS)
def test_absolute_errors_of_real_trajectories(real_pair: tuple[FloatArray, FloatArray], alignment: str) -> None:
    reference, estimate = (poses[:: -(-len(poses) // 200)] for poses in real_pair)
    if "first" in alignment:  # a few meters of straight road leave evo no rotation; see the test of degenerate paths
        reference, estimate = reference[::-1], estimate[::-1]
    assert_absolute_as_evo(reference, estimate, alignment)


@pytest.mark.parametrize(("delta", "unit"), [(7, Unit.FRAMES), (0.1, Unit.METERS), (3.0, Unit.DEGREES)])
@pytest.mark.parametrize("all_pairs", [False, True], ids=["consecutive", "all pairs"])
def test_relative_errors_of_real_trajectories(
    real_pair: tuple[FloatArray, FloatArray], delta: float, unit: Unit, all_pairs: bool
) -> None:
    stride = -(-len(real_pair[0]) // 100)
    reference, estimate = (poses[::stride] for poses in real_pair)
    if unit is Unit.METERS:  # of a path of 30 m or of several kilometers
        delta *= float(np.linalg.norm(np.diff(reference[:, :3, 3], axis=0), axis=1).sum())
    for alignment in ("SE(3)", "Sim(3)"):
        assert assert_relative_as_evo(reference, estimate, alignment, delta, unit, all_pairs, True) > 0
