import importlib

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.diagnosis import calibrated, diagnose


@pytest.mark.parametrize("error", [np.linalg.LinAlgError("Singular matrix"), ValueError("only finite values")])
def test_a_failed_diagnosis_is_reported_and_the_recording_is_used_as_recorded(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    module = importlib.import_module("fgbaseline.diagnosis.body_velocity.pipeline")

    def breaks(_: data.Sequence) -> None:
        raise error

    monkeypatch.setattr(module, "odometry", breaks)
    sequence = simulate(Simulation(duration=5.0))
    diagnosis = diagnose(sequence)
    assert str(error) in diagnosis.failure_reason
    problem = calibrated(sequence)
    assert not problem.diagnosed
    assert problem.remarks[0] == f"not diagnosed: {diagnosis.failure_reason}"
    assert len(problem.observations()) > 0
