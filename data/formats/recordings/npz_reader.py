"""The course files (UCSD ECE276A) and our own npz, which is the later course form with truth added.

| key | shape | form |
|---|---|---|
| `time_stamps` | (1, T) or (T,) s | all |
| `linear_velocity` | (3, T) m/s | all, unless there are raw inertial samples |
| `angular_velocity` | (3, T) rad/s | later, own, unless there are raw inertial samples |
| `rotational_velocity` | (3, T) rad/s | 2020 |
| `features` | (4, N, T) px, -1 unobserved; may be absent, or a list (`observation_list`) | all |
| `K`, `b` | (3, 3) px, scalar m; `b` may be absent with observations of one camera (`monocular_observations`) | all |
| `imu_T_cam` | (4, 4) | later, own |
| `cam_T_imu` | (4, 4): rotation IMU to camera, translation the camera's position in the IMU frame | 2020 |
| `ground_truth` | (T, 4, 4) world_T_imu, a frame all NaN where unknown; may be absent | own |
| `landmarks` | (3, N) m in the world, NaN where unknown; may be absent | own |
| `up_imu` | (3,) unit vector, up in the IMU's frame at frame 0; may be absent | own |

`imu_arrays` lists the keys of raw inertial samples, which may stand in place of the velocities.
"""

import numpy as np

from fgbaseline.geometry import Camera, FloatArray, InputError, MonocularCamera, StereoCamera

from ...observations import BoolArray, Observations
from ...sequence import Sequence, Truth
from ..files.field_checks import extrinsic, positive, vectors
from ..files.npz_archive import NpzArchive
from ..inertial.imu_arrays import FORCE, RATE, STAMPS, read_imu_arrays, read_state_truth
from ..inertial.imu_attachment import attach_imu
from ..stamps.frame_stamps import read_stamps
from .feature_block import read_features
from .monocular_observations import IGNORED_BASELINE, is_of_one_camera
from .observation_list import FRAME, read_observation_list

OWN_KEYS = frozenset({"ground_truth", "landmarks", "up_imu", STAMPS, FRAME})
VELOCITY_KEYS = frozenset({"linear_velocity", "angular_velocity", "rotational_velocity"})
EXACT = 1e-9
"""largest deviation of entries that have to be 0 or 1"""
WORLD_TOLERANCE = 1e-6
"""largest deviation from the identity of a true pose of frame 0 that counts as the origin of the world"""

_ODD_EXTRINSIC = (
    "cam_T_imu is read as the 2020 course wrote it: its rotation takes IMU to camera, its translation is the "
    "camera's position in the IMU frame."
)
NO_VELOCITIES = "The recording has no velocities: the motion is from another file."
_NO_FEATURES = "The recording has no features, so nothing but dead reckoning can be run on it."


def read_course(
    archive: NpzArchive, name: str, source: str, given: FloatArray | None = None, *, moves: bool = False
) -> Sequence:
    """The recording in an open npz of either course form or of our own. Raises InputError naming the key.

    `given` (4, 4) stands in for `imu_T_cam`. `moves` is whether the motion is from another file: then the velocities
    may be absent, and are zero.
    """
    form = course_form(archive.keys)
    inertial = STAMPS in archive.keys
    if not inertial and archive.keys & {RATE, FORCE}:
        raise InputError(
            f"{STAMPS} is missing, the time stamps of {' and '.join(sorted(archive.keys & {RATE, FORCE}))}"
        )
    stamps = read_stamps("time_stamps", archive.array("time_stamps"))
    T = len(stamps.kept)
    rate = "rotational_velocity" if form == "course-2020" else "angular_velocity"
    observations, n_landmarks = Observations.none(), 0
    remarks, findings = [], stamps.findings
    if FRAME in archive.keys:
        observations, n_landmarks = read_observation_list(archive, T)
    elif "features" in archive.keys:
        with archive.stream("features") as stream:
            observations, n_landmarks, zeros = read_features(stream, T)
        findings += zeros
    else:
        remarks.append(_NO_FEATURES)
    one_camera = is_of_one_camera(observations)
    if one_camera and "b" in archive.keys:
        remarks.append(IGNORED_BASELINE)
    if form == "course-2020":
        remarks.append(_ODD_EXTRINSIC)
    truth, moved = _truth(archive, T, n_landmarks, inertial=inertial)
    if moved:
        remarks.append(moved)
    velocity, turned = np.zeros((T, 3)), np.zeros((T, 3))
    if FRAME in archive.keys and not (inertial or moves or archive.keys & VELOCITY_KEYS):
        raise InputError("it has tracks and no motion; add --imu CSV or --velocities CSV")
    if archive.keys & VELOCITY_KEYS or not (inertial or moves):
        velocity = vectors("linear_velocity", _shaped(archive, "linear_velocity", (3, T)))
        turned = vectors(rate, _shaped(archive, rate, (3, T)))
    elif moves:
        remarks.append(NO_VELOCITIES)
    sequence = Sequence(
        name=name,
        t=stamps.t,
        linear_velocity=velocity[stamps.kept],
        angular_velocity=turned[stamps.kept],
        camera=_camera(archive, one_camera=one_camera),
        imu_T_cam=_extrinsic(archive, form) if given is None else given,
        observations=stamps.observations(observations),
        n_landmarks=n_landmarks,
        truth=stamps.truth(truth),
        up_imu=_up(archive),
        form=form,
        source=source,
        remarks=tuple(remarks),
        findings=findings,
        left_out=stamps.left_out,
    )
    if not inertial:
        return sequence
    return attach_imu(sequence, read_imu_arrays(archive), source, velocities=bool(archive.keys & VELOCITY_KEYS))


def course_form(keys: frozenset[str]) -> str:
    """`course-2020`, `course` or `fgbaseline`, by the keys. Raises InputError where they belong to none or to two."""
    older = keys & {"rotational_velocity", "cam_T_imu"}
    later = keys & {"angular_velocity", "imu_T_cam"}
    if older and later:
        raise InputError(
            f"{', '.join(sorted(older))} (2020 form) and {', '.join(sorted(later))} (later form) are both in the file; "
            "keep angular_velocity with imu_T_cam, or rotational_velocity with cam_T_imu"
        )
    if older:
        return "course-2020"
    if later or "time_stamps" in keys:
        return "fgbaseline" if keys & OWN_KEYS else "course"
    found = ", ".join(repr(k) for k in sorted(keys)[:12]) or "nothing"
    raise InputError(
        "this archive is not a recording; expected time_stamps, linear_velocity, angular_velocity, K, b and imu_T_cam, "
        f"but found {found}"
    )


def _shaped(archive: NpzArchive, key: str, shape: tuple[int, ...]) -> FloatArray:
    array = archive.array(key)
    if array.shape != shape:
        raise InputError(f"{key}: expected shape {shape}, got {array.shape}; check how the file was written")
    return array


def _camera(archive: NpzArchive, *, one_camera: bool) -> Camera:
    K = _shaped(archive, "K", (3, 3))
    if not np.isfinite(K).all():
        raise InputError(f"K: it has entries that are not finite: {K.tolist()}; write the calibration in pixels")
    if abs(K[0, 1]) > EXACT or abs(K[1, 0]) > EXACT:
        raise InputError(f"K: skew is not supported, but K[0, 1] is {K[0, 1]} and K[1, 0] is {K[1, 0]}; rectify first")
    if np.abs(K[2] - [0.0, 0.0, 1.0]).max() > EXACT:
        raise InputError(f"K: its last row is {K[2].tolist()}, expected [0, 0, 1]; write the calibration in pixels")
    fu, fv = (positive(f"K[{i}, {i}]", K[i, i], "a focal length in pixels") for i in (0, 1))
    if one_camera:
        return MonocularCamera(fu, fv, float(K[0, 2]), float(K[1, 2]))
    b = positive("b", archive.array("b"), "the baseline in meters")
    return StereoCamera(fu, fv, float(K[0, 2]), float(K[1, 2]), b)


def _extrinsic(archive: NpzArchive, form: str) -> FloatArray:
    key = "cam_T_imu" if form == "course-2020" else "imu_T_cam"
    if key not in archive.keys and FRAME in archive.keys:
        raise InputError("the pose of its left camera on the IMU is not known; add --extrinsic FILE")
    matrix = _shaped(archive, key, (4, 4))
    if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        raise InputError(f"{key}: its last row is {matrix[3].tolist()}, expected [0, 0, 0, 1]")
    rotation = matrix[:3, :3].T if form == "course-2020" else matrix[:3, :3]
    return extrinsic(key, rotation, matrix[:3, 3])


def _up(archive: NpzArchive) -> FloatArray | None:
    if "up_imu" not in archive.keys:
        return None
    up = _shaped(archive, "up_imu", (3,))
    if not abs(float(np.linalg.norm(up)) - 1.0) <= 1e-6:
        raise InputError(f"up_imu: expected a unit vector, got {up.tolist()}; divide it by its length")
    return up


def _truth(archive: NpzArchive, T: int, n_landmarks: int, *, inertial: bool) -> tuple[Truth | None, str]:
    """The truth in the file, if any, and a remark where it had to be moved to the world of frame 0's IMU."""
    if "ground_truth" not in archive.keys:
        if "landmarks" in archive.keys:
            raise InputError(
                "landmarks: they need ground_truth beside them, which says in which world they are; add it"
            )
        return None, ""
    poses = _shaped(archive, "ground_truth", (T, 4, 4))
    entries = poses.reshape(T, 16)
    known: BoolArray = np.asarray(np.isfinite(entries).all(axis=1))
    rigid = known & (entries[:, 12:] == [0.0, 0.0, 0.0, 1.0]).all(axis=1)
    broken = ~rigid & ~np.isnan(entries).all(axis=1)
    if broken.any():
        k = int(np.argmax(broken))
        raise InputError(
            f"ground_truth: the pose of frame {k} is not a rigid motion: {poses[k].tolist()}; "
            "write a pose, or NaN in all of its entries where it is not known"
        )
    landmarks = None
    if "landmarks" in archive.keys:
        landmarks = np.ascontiguousarray(_shaped(archive, "landmarks", (3, n_landmarks)).T)
    if inertial:
        return read_state_truth(archive, Truth(poses, landmarks, up=np.array([0.0, 0.0, 1.0]))), ""
    if not known[0] or np.abs(poses[0] - np.eye(4)).max() <= WORLD_TOLERANCE:
        return Truth(poses, landmarks), ""
    moved = "ground_truth does not begin at the identity: it is re-expressed from the IMU at frame 0."
    return Truth.from_any_world(poses, landmarks), moved
