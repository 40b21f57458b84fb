"""The joint filter with other settings than its defaults, under names of their own."""

from dataclasses import replace

from fgbaseline.data.estimate import Estimate, Progress
from fgbaseline.data.problem import Problem

from .gyro_bias import GyroBiasPrior
from .joint import joint_ekf
from .joint_settings import JointSettings, Linearisation


def joint_ekf_bias(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter with the gyroscope's bias in its state, `Estimate.gyro_bias`."""
    settings = JointSettings(gyro_bias=GyroBiasPrior())
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-bias")


def joint_ekf_textbook(problem: Problem, progress: Progress | None = None) -> Estimate:
    """EKF-SLAM as textbooks print it: points in the world, Jacobians at the newest estimate, no gate."""
    return replace(joint_ekf(problem, progress, JointSettings.textbook()), name="joint-ekf-textbook")


def joint_ekf_first_estimate(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter with first-estimate Jacobians in place of the invariant correction."""
    settings = JointSettings(linearisation=Linearisation.FIRST_ESTIMATE)
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-first-estimate")


def joint_ekf_ungated(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter without a gate: a wrong observation counts with the weight that the kernel leaves it."""
    return replace(joint_ekf(problem, progress, JointSettings(gate=None)), name="joint-ekf-ungated")
