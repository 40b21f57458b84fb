"""Kinds of events are one enum: what one room writes and another one reads cannot drift apart."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data
from fgbaseline.data import Estimate, Event, EventKind, Landmarks

from ..builders.synthetic import Scene, plain_problem

ROOT = Path(__file__).parents[2]
ROOMS = ("data", "ekf", "smoother", "compare", "reports", "benchmarks")
TEXTS = {str(kind) for kind in EventKind}


def sources() -> Iterator[tuple[str, ast.AST]]:
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                yield f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}", node


def test_the_text_of_a_kind_stands_in_the_enum_alone() -> None:
    places = [where for where, node in sources() if isinstance(node, ast.Constant) and node.value in TEXTS]
    assert {where.partition(":")[0] for where in places} == {"data/estimators/estimate.py"}
    assert len(places) == len(TEXTS)


def test_every_event_of_the_package_has_a_kind_of_the_enum() -> None:
    made = [
        (where, node)
        for where, node in sources()
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Event"
    ]
    assert len(made) > 10
    for where, node in made:
        assert not isinstance(node.args[1], ast.Constant | ast.JoinedStr), where


def with_events(*kinds: str) -> tuple[data.Problem, Estimate]:
    problem = plain_problem(Scene(frames=20).sequence())
    truth = problem.sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    return problem, Estimate(
        name="mine",
        world_T_imu=truth.world_T_imu,
        used=np.ones(len(problem.excluded), dtype=np.bool_),
        landmarks=Landmarks(problem.features, truth.landmarks),
        events=tuple(Event(k, kind, "") for k, kind in enumerate(kinds)),
    )


@pytest.mark.parametrize("kind", ["heading reset", "ONE_START", "zero-velocity update"])
def test_an_event_kind_of_a_user_estimator_does_not_affect_the_trust(kind: str) -> None:
    problem, silent = with_events()
    _, estimate = with_events(*([kind] * 20))
    assert compare.trust(problem, estimate) == compare.trust(problem, silent)


def test_the_text_of_a_kind_is_the_kind() -> None:
    kind = EventKind.FRAME_WITHOUT_OBSERVATIONS
    problem, estimate = with_events(*([kind] * 20))
    _, by_text = with_events(*([str(kind)] * 20))
    assert compare.trust(problem, estimate) == compare.trust(problem, by_text)
    assert any("of the frames were dropped" in reason for reason in compare.trust(problem, estimate).reasons)
