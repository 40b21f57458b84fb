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
    "and position. Within 3 sigma: share of the unaligned errors, by component, below 3 sigma; 99.7 % is expected.",
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
    ATE: "Distance of the positions from ground truth, m. In a run, aligned: after SE(3) alignment, with raw inertial "
    "data after alignment in yaw and position; unaligned: with the same start, as in the charts over time. In a "
    "comparison: distance from the reference after the alignment of --align.",
    SIGMA: "Square root of the trace of an estimator's own position covariance, m, with the start fixed (pose of frame "
    "0; with raw inertial data its position and heading); RMS over the frames. It is the expected 3D RMSE, not the "
    "sigma of one axis. The sentences at the top call an estimator overconfident in two cases. Its median NEES is "
    "above 14.4 (97.5 % quantile of one pose); or its position sigma is below its divergence, and either its median "
    "reference NEES is above 14.4 or, in most frames, P_ref exceeds 1.1 P in some direction.",
    DIVERGENCE: "Distance of the positions from those of the reference, m, without alignment: all have the same start.",
    RPE: "Error of the motion between two poses a delta apart (--delta), m and °.",
    "drift": "Relative error over a tenth of the path length (or duration), per meter (or second).",
    SEGMENTS: "KITTI's relative error over segments of 100 to 800 m, % and °/m; on a short path over shorter segments.",
    REPROJECTION: "Norm of the pixel residual (uL, vL, uR, vR) of an observation, px; its RMS is twice the pixel "
    "sigma. Over all observations of an estimator's landmarks, including those that the mask excludes. Common "
    "observations are those that every estimator with landmark updates used.",
    OBSERVATIONS: "Share of the unmasked observations that an estimator used, %.",
    HELD_OUT: "Reprojection error of tracks that no estimator used, each half predicted from the other along the "
    "trajectory, px. It judges motion over a second or two, not drift. A trajectory is separated from the best where "
    "'above the best by at least' is positive.",
    NEES: "Normalized estimation error squared of a pose, e^T P^-1 e with e = log(T^-1 T_true): 6 is expected of a "
    "consistent estimator, 5.35 in the median. It judges all six components of a pose: a larger value means that the "
    "covariance of at least one is too small.",
    REFERENCE_NEES: "d^T (P − P_ref)^-1 d with the difference d = log(T^-1 T_ref) from the reference, whose data the "
    "estimator shares; P and P_ref are their pose covariances. 5.35 is expected in the median. Frames in which "
    "P − P_ref is not positive definite are left out. If, in most frames, P_ref exceeds 1.1 P in some direction, the "
    "table has 'overconfident' in place of a value.",
    "NIS per degree of freedom": "Squared innovations of a filter over their covariance: 1 is expected, less where the "
    "pixel noise is inflated for time-correlated errors. It judges one step against this noise, so that a filter with "
    "a small NIS can still be overconfident in its poses.",
    "sigma ratio": "Square root of trace P over trace P_ref, of the position or the rotation; median over the frames. "
    "At least 1 is expected of a consistent filter, since the reference uses all data.",
    RESIDUALS: "Chi-square of a track's residuals under the assumed noise, per degree of freedom: 1 is expected, "
    "less where the pixel noise is inflated. A point is dynamic if a constant velocity explains its residuals "
    "significantly better than a fixed position: it moved, or its track drifted.",
    MAP: "Distance of landmarks from the reference's of the same index, m; in the camera frame, by the estimate's own "
    "poses, it is without drift. In sigmas of P − P_ref the expected median is 1.54.",
    **INERTIAL_TERMS,
}
"""term -> definition, in the glossary of every page; docs/glossary.md has the formulas"""


WORDS: Mapping[str, str] = {
    "recovered": "Status of an estimator that finished after it had dropped landmarks or frames, or with an invalid "
    "covariance; the events name what was lost.",
    "trusted": "All criteria of trust hold: on the reference's residuals, on its observations and, if there is a batch "
    "solution, on its agreement with that. It then solves this problem well; it need not be close to the truth.",
    "mask": "Selects the observations that no estimator gets, before any of them runs; the table of excluded "
    "observations has the reasons.",
    "calibrated": "Preset: the recording is diagnosed, repaired and masked. It does not calibrate the cameras.",
    "P, P_ref": "6 x 6 covariance of a pose, by an estimator and by the reference.",
}
"""word of a run's page that is no metric -> definition"""
