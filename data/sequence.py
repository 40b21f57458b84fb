"""Recording: body velocities or raw inertial samples, tracks, calibration and optional ground truth."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.geometry import Camera, FloatArray, InputError, MonocularCamera, StereoCamera, se3, so3
from fgbaseline.geometry.monocular_camera import require_stereo
from fgbaseline.geometry.path_length import path_length

from .dataframes import axis_columns, plot_over_time, pose_columns, table
from .display import Displayed
from .finding import Finding
from .imu import ImuSamples
from .observations import BoolArray, Observations
from .value_range import LARGEST, measurable
from .wording import plural

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ROTATION_TOLERANCE = 1e-6
"""largest entry of |R^T R - I|, and largest |det R - 1|, of a rotation matrix R"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Truth(Displayed):
    """Ground truth: poses, landmarks and inertial states.

    With body velocities the world is the IMU frame at frame 0. With raw inertial samples the world has the axes of the
    file and its origin at the first known pose, until `diagnosis.calibrated` aligns it with the world of the problem.
    """

    world_T_imu: FloatArray
    """(T, 4, 4); NaN for frames without ground truth"""
    landmarks: FloatArray | None = None
    """(N, 3) m in the world, one row per landmark of the sequence; NaN where it is not known"""
    source: str = "in the recording"
    """where it comes from, for reports"""
    velocity: FloatArray | None = None
    """(T, 3) m/s in world axes, of a recording with raw inertial data; NaN where it is not known"""
    gyroscope_bias: FloatArray | None = None
    """(T, 3) rad/s; NaN where it is not known"""
    accelerometer_bias: FloatArray | None = None
    """(T, 3) m/s^2; NaN where it is not known"""
    up: FloatArray | None = None
    """(3,) unit vector, opposite to gravity in this world; None where the source of the poses does not define it"""

    @property
    def known(self) -> BoolArray:
        """Mask (T,) of the frames with ground truth."""
        return np.asarray(np.isfinite(self.world_T_imu).all(axis=(1, 2)), dtype=np.bool_)

    @staticmethod
    def from_any_world(
        poses: FloatArray, landmarks: FloatArray | None = None, source: str = "in the recording"
    ) -> "Truth":
        """Ground truth in the IMU frame at frame 0, from `poses` (T, 4, 4) and `landmarks` (N, 3), m, in any one world.

        Raises InputError without a pose for frame 0.
        """
        if not np.isfinite(poses[0]).all():
            raise InputError(f"the ground truth ({source}) has no pose for frame 0, which defines the world frame")
        origin = se3.inverse(poses[0])
        moved = None if landmarks is None else se3.transform(origin, landmarks)
        world_T_imu = origin @ poses
        world_T_imu[~np.isfinite(world_T_imu).all(axis=(1, 2))] = np.nan
        return Truth(world_T_imu, moved, source)

    def transformed(self, new_T_old: FloatArray) -> "Truth":
        """Truth in another world; `new_T_old` (4, 4) is the pose of the present world in the new one."""
        R = new_T_old[:3, :3]
        return replace(
            self,
            world_T_imu=new_T_old @ self.world_T_imu,
            landmarks=None if self.landmarks is None else se3.transform(new_T_old, self.landmarks),
            velocity=None if self.velocity is None else self.velocity @ R.T,
            up=None if self.up is None else R @ self.up,
        )

    def of_frames(self, kept: BoolArray) -> "Truth":
        """Truth of the frames where the mask `kept` (T,) is true; landmarks unchanged."""
        state = (self.velocity, self.gyroscope_bias, self.accelerometer_bias)
        velocity, gyroscope_bias, accelerometer_bias = (None if values is None else values[kept] for values in state)
        return replace(
            self,
            world_T_imu=self.world_T_imu[kept],
            velocity=velocity,
            gyroscope_bias=gyroscope_bias,
            accelerometer_bias=accelerometer_bias,
        )


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Sequence(Displayed):
    """Recording of T frames, as read or repaired: stereo tracks with body velocities or raw inertial samples.

    One camera has observations [uL, vL, NaN, NaN] and needs inertial samples, which bring the scale.
    """

    name: str
    t: FloatArray
    """(T,) time stamps, s, strictly increasing"""
    linear_velocity: FloatArray
    """(T, 3) m/s in the IMU's frame; (0, 3) with raw inertial samples"""
    angular_velocity: FloatArray
    """(T, 3) rad/s in the IMU's frame; (0, 3) with raw inertial samples"""
    camera: Camera
    imu_T_cam: FloatArray
    """(4, 4) pose of the left camera in the IMU frame"""
    observations: Observations
    n_landmarks: int
    """number of landmarks N; `observations.landmark` is 0 to N - 1"""
    imu: ImuSamples | None = None
    """raw inertial samples, in place of body velocities"""
    truth: Truth | None = None
    up_imu: FloatArray | None = None
    """(3,) unit vector pointing up, in the IMU frame at frame 0; by default the -y axis of the camera"""
    form: str = "fgbaseline"
    """file format"""
    source: str = ""
    """file name, or description of the simulation"""
    remarks: tuple[str, ...] = ()
    """remarks of the reader, one sentence each"""
    findings: tuple[Finding, ...] = ()
    """faults of the file that the reader repaired"""
    time_unit_given: bool = False
    """True if the user or the image format states the unit of the stamps; the diagnosis then does not test it"""
    left_out: tuple[int, ...] = ()
    """increasing indices of file frames left out because their stamp repeats the previous one"""

    def __post_init__(self) -> None:
        if self.up_imu is None:
            down = self.imu_T_cam[:3, 1]
            object.__setattr__(self, "up_imu", -down / np.linalg.norm(down))
        check_sequence(self)
        for array in (self.t, self.linear_velocity, self.angular_velocity, self.imu_T_cam):
            array.flags.writeable = False

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        # pickle then calls the constructor, which makes the arrays read-only
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.t)

    @property
    def monocular(self) -> bool:
        """Whether the recording has one camera."""
        return isinstance(self.camera, MonocularCamera)

    @property
    def stereo_camera(self) -> StereoCamera:
        """The stereo camera. Raises FgbaselineError if the recording has one camera."""
        return require_stereo(self.camera, "this step")

    @property
    def dt(self) -> FloatArray:
        """Intervals between frames (T-1,), s."""
        return np.diff(self.t)

    @property
    def up(self) -> FloatArray:
        """Unit vector (3,) that points up in the world of a problem: z with raw inertial samples, else `up_imu`.

        The truth as read from a file may be in another world, with its own `Truth.up`.
        """
        if self.imu is not None:
            return np.array([0.0, 0.0, 1.0])
        assert self.up_imu is not None
        return self.up_imu

    def _heading(self) -> str:
        return f"Sequence {self.name} ({self.source or self.form})"

    def _facts(self) -> Mapping[str, str]:
        seen = plural(len(np.unique(self.observations.landmark)), "track")
        facts = {
            "frames": f"{self.n_frames:,} in {self.t[-1] - self.t[0]:.1f} s",
            "observations": f"{len(self.observations):,} of {seen}",
            "motion": "body velocities",
            "truth": "none",
        }
        if self.imu is not None:
            facts["motion"] = f"{plural(len(self.imu), 'inertial sample')} at {1.0 / self.imu.period:.0f} Hz"
        if self.truth is not None:
            length = path_length(self.truth.world_T_imu[:, :3, 3])
            facts["truth"] = f"{self.truth.known.sum():,} frames, path {length:.1f} m ({self.truth.source})"
        camera = self.camera
        base = "one camera" if isinstance(camera, MonocularCamera) else f"baseline {camera.baseline:.3f} m"
        facts["camera"] = f"fu {camera.fu:.1f} px, fv {camera.fv:.1f} px, {base}"
        return facts | {f"remark {i}": text for i, text in enumerate(self.remarks, 1)}

    def to_frame(self) -> "pd.DataFrame":
        """Table with a row for each frame: t (s), velocities, number of observations and, with ground truth, the pose.

        vx, vy, vz (m/s) and wx, wy, wz (rad/s) are body velocities; a recording with raw inertial samples has none.
        The true pose is x, y, z (m), qx, qy, qz, qw of `world_T_imu`.
        """
        columns: dict[str, object] = {"t": self.t}
        if self.imu is None:
            columns |= {**axis_columns("v", self.linear_velocity), **axis_columns("w", self.angular_velocity)}
        columns["observations"] = np.bincount(self.observations.frame, minlength=self.n_frames)
        return table(columns | ({} if self.truth is None else pose_columns(self.truth.world_T_imu)), "frame")

    def plot(self) -> "Figure":
        """Draws speed (or specific force), turn rate and number of observations over time."""
        t, v, w, label = self.t, self.linear_velocity, self.angular_velocity, "speed, m/s"
        if self.imu is not None:
            t, v, w = self.imu.t, self.imu.specific_force, self.imu.angular_velocity
            label = "specific force, m/s^2"
        counts = np.bincount(self.observations.frame, minlength=self.n_frames).astype(np.float64)
        start = self.t[0]
        panels = {
            label: {"": (t - start, np.linalg.norm(v, axis=1))},
            "turn rate, °/s": {"": (t - start, np.rad2deg(np.linalg.norm(w, axis=1)))},
            "observations": {"": (self.t - start, counts)},
        }
        return plot_over_time(panels, self.name)

    def with_truth(self, truth: Truth) -> "Sequence":
        """Copy of the recording with this ground truth."""
        return replace(self, truth=truth)


def require_scale(sequence: Sequence) -> None:
    """Raises InputError for one camera without raw inertial samples, as nothing else determines the scale."""
    if sequence.monocular and sequence.imu is None:
        raise InputError(
            "features: with one camera (uR and vR are NaN) only raw inertial samples determine the scale of the "
            "trajectory; add --imu CSV, or the keys imu_time_stamps, imu_angular_velocity and imu_linear_acceleration"
        )


def check_sequence(s: Sequence) -> None:
    """Raises InputError, with field and value, for a sequence that cannot be estimated."""
    T = s.n_frames
    if T < 2:
        raise InputError(f"time_stamps: a sequence needs at least 2 frames, this one has {T}")
    for name, array in (("linear_velocity", s.linear_velocity), ("angular_velocity", s.angular_velocity)):
        if s.imu is not None and len(array):
            raise InputError(f"{name}: a recording has body velocities or raw inertial samples, not both")
        if array.shape != (0 if s.imu is not None else T, 3):
            raise InputError(f"{name}: expected 3 values for each of the {T} time stamps, got shape {array.shape}")
        _require_finite(name, array)
    _require_finite("time_stamps", s.t[:, None])
    step = np.diff(s.t)
    if not np.all(step > 0):
        k = int(np.argmin(step > 0))
        raise InputError(
            f"time_stamps: stamps must rise, but frame {k + 1} ({float(s.t[k + 1])!r} s) is not after "
            f"frame {k} ({float(s.t[k])!r} s)"
        )
    if s.imu_T_cam.shape != (4, 4) or not measurable(s.imu_T_cam).all():
        raise InputError(f"imu_T_cam: expected shape (4, 4) with finite numbers, got {s.imu_T_cam.tolist()}")
    defect = float(so3.orthogonality_error(s.imu_T_cam[:3, :3]))
    if not defect <= ROTATION_TOLERANCE:
        raise InputError(
            f"imu_T_cam: its upper left 3x3 is not a rotation (off by {defect:.3g}, allowed {ROTATION_TOLERANCE:g}); "
            "write the extrinsic as a rigid motion"
        )
    if not np.array_equal(s.imu_T_cam[3], [0.0, 0.0, 0.0, 1.0]):
        raise InputError(f"imu_T_cam: its last row is {s.imu_T_cam[3].tolist()}, expected [0, 0, 0, 1]")
    camera = s.camera
    for name, value in (("K[0, 0]", camera.fu), ("K[1, 1]", camera.fv), ("b", camera.unit_length)):
        if not 0 < value <= LARGEST:
            raise InputError(f"{name}: expected a number above 0 and at most {LARGEST:g}, got {float(value)!r}")
    _require_finite("features", s.observations.pixel[:, :2] if s.monocular else s.observations.pixel)
    if s.monocular and not np.isnan(s.observations.pixel[:, 2:]).all():
        row = int(np.argmin(np.isnan(s.observations.pixel[:, 2:]).all(axis=1)))
        raise InputError(
            f"features: uR and vR must be NaN for one camera, but row {row} is {s.observations.pixel[row].tolist()}"
        )
    o = s.observations
    unknown = np.flatnonzero((o.frame < 0) | (o.frame >= T) | (o.landmark >= s.n_landmarks))
    if len(unknown):
        i = int(unknown[0])
        raise InputError(
            f"features: observation {i} is of landmark {o.landmark[i]} in frame {o.frame[i]}, but the sequence has "
            f"{s.n_landmarks} landmarks and {T} frames"
        )
    if s.truth is not None and s.truth.world_T_imu.shape != (T, 4, 4):
        raise InputError(f"ground_truth: expected poses of shape ({T}, 4, 4), got {s.truth.world_T_imu.shape}")
    if s.truth is not None:
        _check_truth(s.truth, T, s.n_landmarks)


def _check_truth(truth: Truth, T: int, n_landmarks: int) -> None:
    defect = so3.orthogonality_error(truth.world_T_imu[truth.known][:, :3, :3])
    if defect.size and defect.max() > ROTATION_TOLERANCE:
        k = int(np.flatnonzero(truth.known)[defect.argmax()])
        raise InputError(
            f"ground_truth: the pose of frame {k} is not a rigid motion (rotation off by {defect.max():.3g}, allowed "
            f"{ROTATION_TOLERANCE:g})"
        )
    for name in ("velocity", "gyroscope_bias", "accelerometer_bias"):
        values = getattr(truth, name)
        if values is not None and values.shape != (T, 3):
            raise InputError(f"ground_truth: expected a {name} of shape ({T}, 3), got {values.shape}")
    if truth.landmarks is not None and truth.landmarks.shape != (n_landmarks, 3):
        raise InputError(f"landmarks: expected shape ({n_landmarks}, 3), got {truth.landmarks.shape}")


def _require_finite(name: str, array: FloatArray) -> None:
    finite = measurable(array).all(axis=1)
    if not finite.all():
        k = int(np.argmin(finite))
        raise InputError(f"{name}: row {k} has a number that is not finite or exceeds {LARGEST:g}: {array[k].tolist()}")
