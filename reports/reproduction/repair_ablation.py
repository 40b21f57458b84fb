"""Repair of a recording one fault at a time, to show the effect of each on the documented filter."""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data import Excluded, Sequence
from fgbaseline.data.axis_conventions import IDENTITY, axes_matrix
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.data.wording import per_cent
from fgbaseline.diagnosis import Diagnosis, repair
from fgbaseline.diagnosis.repairs.significance import significant_bias
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings

from .recordings import StandIn

AS_RECORDED = "as recorded"


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """The recording with all faults up to this stage repaired."""

    name: str
    cause: str
    """the fault that this stage repairs; empty for the recording as recorded"""
    sequence: Sequence


def diagnosed_stages(diagnosis: Diagnosis) -> list[Stage]:
    """Stages of a diagnosed recording: as recorded, then with one more fault repaired: axes, bias, interval, tracks."""
    recorded = diagnosis.sequence
    stages = [Stage(AS_RECORDED, "", recorded)]
    if diagnosis.fit is None:
        return stages
    angular, linear, bias = diagnosis.angular, diagnosis.linear, significant_bias(diagnosis)
    now = recorded
    if angular.changed or linear.changed:
        now = _turned(now, angular.name, linear.name)
        stages.append(Stage("axes agree", _axes(angular.name, linear.name), now))
    if bias.any():
        now = replace(now, angular_velocity=now.angular_velocity - bias @ angular.matrix.T)
        stages.append(Stage("without bias", f"gyroscope bias of {_vector(bias)} rad/s", now))
    if diagnosis.shift != Shift.AFTER:
        now = _restamped(now, diagnosis.shift)
        cause = f"velocities assigned to the wrong interval (by {-diagnosis.shift:g} intervals)"
        stages.append(Stage("right interval", cause, now))
    repaired = repair(diagnosis, MaskSettings())
    good = repaired.excluded == Excluded.NO
    if not good.all():
        tracked = replace(
            now,
            imu_T_cam=repaired.sequence.imu_T_cam,
            observations=repaired.sequence.observations.select(good),
            n_landmarks=repaired.sequence.n_landmarks,
            truth=repaired.sequence.truth,
        )
        copied = ", copied frames" if (repaired.excluded == Excluded.COPIED).any() else ""
        cause = f"wrong matches{copied} and other unusable observations ({per_cent(float(np.mean(~good)))} of all)"
        stages.append(Stage("right matches", cause, tracked))
    return stages


def simulated_stages(simulated: StandIn) -> list[Stage]:
    """The stages of a simulated recording, whose faults are known."""
    recorded, bias, axes = simulated.sequence, simulated.gyro_bias, simulated.angular_axes
    now = _turned(recorded, axes, IDENTITY)
    stages = [Stage(AS_RECORDED, "", recorded), Stage("axes agree", _axes(axes, IDENTITY), now)]
    if bias.any():
        now = replace(now, angular_velocity=now.angular_velocity - bias @ axes_matrix(axes).T)
        stages.append(Stage("without bias", f"gyroscope bias of {_vector(bias)} rad/s", now))
    if simulated.wrong.any():
        cause = f"wrong matches ({per_cent(float(simulated.wrong.mean()))} of the observations)"
        stages.append(
            Stage("right matches", cause, replace(now, observations=now.observations.select(~simulated.wrong)))
        )
    return stages


def _turned(sequence: Sequence, angular: str, linear: str) -> Sequence:
    return replace(
        sequence,
        angular_velocity=sequence.angular_velocity @ axes_matrix(angular).T,
        linear_velocity=sequence.linear_velocity @ axes_matrix(linear).T,
    )


def _restamped(sequence: Sequence, shift: float) -> Sequence:
    """The recording in which velocity k moves frame k to k + 1."""
    twist = zero_order_hold(sequence, shift)
    twist = np.concatenate([twist, twist[-1:]])
    return replace(sequence, linear_velocity=twist[:, :3], angular_velocity=twist[:, 3:])


def _axes(angular: str, linear: str) -> str:
    every = (("angular", angular), ("linear", linear))
    wrong = [f"{what} velocity, {name}" for what, name in every if name != IDENTITY]
    return f"inconsistent axes of the {' and of the '.join(wrong)}"


def _vector(values: np.ndarray) -> str:
    return f"({', '.join(f'{value:.4f}' for value in values)})"
