"""The joint filter with other settings than its defaults, under names of their own."""

from dataclasses import replace

from fgbaseline.data.estimate import Estimate, Progress
from fgbaseline.data.problem import Problem

from .gyro_bias import GyroBiasPrior
from .joint import joint_ekf
from .joint_settings import JointSettings, Linearisation

GATE = 0.9999
"""chi-square probability: one good observation in ten thousand is lost"""


def joint_ekf_bias(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter with the gyroscope's bias in its state, `Estimate.gyro_bias`."""
    settings = JointSettings(gyro_bias=GyroBiasPrior())
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-bias")


def joint_ekf_textbook(problem: Problem, progress: Progress | None = None) -> Estimate:
    """EKF-SLAM as textbooks print it: points in the world, Jacobians at the newest estimate."""
    return replace(joint_ekf(problem, progress, JointSettings.textbook()), name="joint-ekf-textbook")


def joint_ekf_first_estimate(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter with first-estimate Jacobians in place of the invariant correction."""
    settings = JointSettings(linearisation=Linearisation.FIRST_ESTIMATE)
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-first-estimate")


def joint_ekf_gated(problem: Problem, progress: Progress | None = None) -> Estimate:
    """The joint filter that leaves out every observation beyond a chi-square gate of 0.9999; each is counted."""
    return replace(joint_ekf(problem, progress, JointSettings(gate=GATE)), name="joint-ekf-gated")
