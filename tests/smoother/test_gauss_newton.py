"""What the increments led to is the whole graph's minimum already, nearly; the final relinearisation takes the rest."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline import compare, smoother
from fgbaseline.compare.residuals.cost import cost
from fgbaseline.data import HuberKernel
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.smoother import ISAM2Settings
from fgbaseline.smoother.incremental import IncrementalSmoother
from fgbaseline.smoother.keys import TAIL
from fgbaseline.smoother.relinearised import compact

from ..builders.synthetic import drive, matched


@pytest.mark.parametrize(("kernel", "tolerance"), [(None, 1e-4), (HuberKernel(), 5e-3)])
@pytest.mark.parametrize("path", ["town", "handheld"])
def test_isam2_is_at_the_minimum_of_batch_before_and_after(
    path: PathName, kernel: HuberKernel | None, tolerance: float
) -> None:
    problem = replace(matched(drive(path, seconds=8.0, features_per_frame=20.0, wrong=0.05)), kernel=kernel)
    before = smoother.isam2(problem, settings=ISAM2Settings(relinearise_at_end=False))
    after = smoother.isam2(problem)
    batch = smoother.batch(problem, given={"isam2": after})
    np.testing.assert_array_equal(before.used, after.used)
    lowest = cost(problem, batch, batch.used)
    excess = [cost(problem, estimate, batch.used) / lowest - 1.0 for estimate in (before, after)]
    assert excess[0] < tolerance
    assert abs(excess[1]) < 0.1 * tolerance
    for estimate in (before, after):
        assert compare.divergence_summary(compare.divergence(estimate, batch))["rmse"] < 0.05


def test_without_it_the_answer_is_another_and_what_was_known_online_the_same() -> None:
    problem = matched(drive(seconds=5.0, features_per_frame=15.0))
    before = smoother.isam2(problem, settings=ISAM2Settings(relinearise_at_end=False))
    after = smoother.isam2(problem)
    assert np.abs(before.world_T_imu - after.world_T_imu).max() > 1e-9
    online = [estimate.by_products["isam2-online"].world_T_imu for estimate in (before, after)]
    np.testing.assert_array_equal(*online)


def test_settling_ends_where_every_variable_is_within_its_threshold() -> None:
    problem = replace(matched(drive(seconds=6.0, features_per_frame=15.0)), kernel=None)
    increments = IncrementalSmoother(problem, ISAM2Settings())
    increments.run(np.zeros(problem.n_frames), None)
    costs = [error(increments)]
    increments.settle()
    costs.append(error(increments))
    assert costs[1] < costs[0]
    assert increments.solver.relinearised() == 0
    batch = smoother.batch(problem)
    assert costs[1] < (1.0 + 5e-5) * cost(problem, batch, batch.used)


def error(increments: IncrementalSmoother) -> float:
    tree = increments.solver.tree
    graph = compact(tree.getFactorsUnsafe())
    for i in range(graph.size()):
        if TAIL in list(graph.at(i).keys()):  # linearised far off, and no part of the problem
            graph.remove(i)
    return float(compact(graph).error(tree.calculateEstimate()))
