"""Glossary of the pages: names of the measured quantities, and definitions of them and of words beside them."""

from collections.abc import Mapping

ATE, DIVERGENCE, RPE, DELTA = "ATE", "divergence", "relative error (RPE)", "DELTA"
REPROJECTION, HELD_OUT, MAP, SEGMENTS = "reprojection error", "held-out error", "map difference", "segment error"
NEES, REFERENCE_NEES, RESIDUALS, RUNTIME = "NEES", "reference NEES", "track chi-square", "runtime"
OBSERVATIONS = "observations"
SIGMA, CONSISTENCY = "position sigma (3D)", "consistency"
VELOCITY, GYROSCOPE_BIAS, ACCELEROMETER_BIAS = "velocity", "gyroscope bias", "accelerometer bias"
STATE_NEES = "NEES of the state"
SCALE_ERROR = "scale error"
INERTIAL_TERMS: Mapping[str, str] = {
    VELOCITY: "Norm of the error of the velocity to ground truth, m/s, in world axes. Aligned: after alignment in yaw "
    "and position. Within 3 sigma: share of the components that are, unaligned; 99.7 % is expected.",
    GYROSCOPE_BIAS: "Norm of the error of the gyroscope's bias to ground truth, rad/s, in the axes of the IMU.",
    ACCELEROMETER_BIAS: "Norm of the error of the accelerometer's bias to ground truth, m/s^2, in the axes of the IMU.",
    SCALE_ERROR: "1 / s - 1 with the scale s of the Sim(3) alignment to ground truth, %, of a run with one camera.",
    STATE_NEES: "NEES of the 15 degrees of freedom of translation, rotation, velocity, gyroscope bias and "
    "accelerometer bias, unaligned: 15 is expected, 14.34 in the median. Of each block alone 3 is expected, 2.37 in "
    "the median.",
}
"""terms of runs on raw inertial data, which the pages of other runs do not have"""
TERMS: Mapping[str, str] = {
    "coverage": "Share of the recording's time (in a comparison: of the reference's) in which an estimator has poses.",
    ATE: "Distance of the positions from ground truth, m. Aligned: after SE(3) alignment, with raw inertial data after "
    "alignment in yaw and position. Unaligned: both start at one pose, as in the charts over time. In a comparison: "
    "from the reference, after the alignment that was asked for.",
    SIGMA: "Square root of the trace of an estimator's own position covariance, m, under the problem's noise model, "
    "with the first pose fixed, unaligned; RMS over the frames. It is the 3D RMS, not the sigma of one axis: the RMSE "
    "of a consistent estimator is as large. An estimator is called overconfident where this is below its RMSE, and "
    "either its median NEES is above 14.4 (97.5 % quantile of one pose) or P is smaller than P_ref in a direction, by "
    "10 % of P, in most frames.",
    DIVERGENCE: "Distance of the positions from those of the reference, m, without alignment: all start at one pose.",
    RPE: "Error of the motion between two poses a delta apart, m and °.",
    "drift": "Relative error per meter (or second) over a tenth of the path.",
    SEGMENTS: "KITTI's relative error over segments of 100 to 800 m, % and °/m; over shorter segments on a short path.",
    REPROJECTION: "Norm of the pixel residual (uL, vL, uR, vR) of an observation, px; its RMS is twice the pixel "
    "sigma. Over all observations of an estimator's landmarks, also those that the mask excludes. Common observations "
    "are those that every estimator with landmark updates used.",
    OBSERVATIONS: "Used: share of the observations that the mask leaves.",
    HELD_OUT: "Reprojection error of tracks that no estimator used, each half predicted from the other along the "
    "trajectory, px. It judges motion over a second or two, not drift. A trajectory is separated from the best where "
    "'above the best by at least' is positive.",
    NEES: "Normalized estimation error squared of a pose, e^T P^-1 e with e = log(T^-1 T_true): 6 is expected of a "
    "consistent estimator, 5.35 in the median. A larger value means that it is overconfident.",
    REFERENCE_NEES: "Squared difference from the reference over P − P_ref, as both share their data (P: covariance of "
    "the pose by the estimator; P_ref: by the reference): 5.35 is expected "
    "in the median. Frames where P − P_ref is not positive definite are left out. An estimator is overconfident where "
    "its P is smaller than P_ref in a direction, by 10 % of P, in most frames.",
    "NIS per degree of freedom": "Squared innovations of a filter over their covariance: 1 is expected, less where the "
    "pixel noise is inflated for time-correlated errors. It judges one step against this noise, so that a filter with "
    "a small NIS can still be overconfident in its poses.",
    "sigma ratio": "Root of trace P over root of trace P_ref, median over the frames: at least 1 is expected of a "
    "consistent filter, since the reference uses all data.",
    RESIDUALS: "Chi-square of a track's residuals under the assumed noise, per degree of freedom: 1 is expected, "
    "less where the pixel noise is inflated. A "
    "point is dynamic where a constant velocity explains its residuals: it moved, or its track drifted.",
    MAP: "Distance of landmarks from the reference's of the same index, m; in camera coordinates of each estimate's "
    "own pose it is without drift. In the median 1.54 sigmas of P − P_ref "
    "are expected.",
    **INERTIAL_TERMS,
}
"""term -> definition, in the glossary of every page; docs/glossary.md has the formulas"""


WORDS: Mapping[str, str] = {
    "recovered": "Status of an estimator that finished after it had dropped landmarks or frames, or with an invalid "
    "covariance; the events name what was lost.",
    "trusted": "The reference's own residuals and observations support it: it solves this problem well. It is not "
    "thereby more accurate than its position sigma.",
    "mask": "The observations that no estimator gets, decided before any of them runs; What was left out has the "
    "reasons.",
    "calibrated": "Preset of a recording that is diagnosed, repaired and masked; cameras are not calibrated.",
    "P, P_ref": "6 x 6 covariance of a pose, by an estimator and by the reference.",
}
"""word of a run's page that is no metric -> definition"""
