"""The UTIAS `.mat` recordings (Clement et al., CRV 2015): velocities, stereo tracks, calibration and truth in one file.

| variable | shape | is |
|---|---|---|
| `t` | (1, T) | time stamps, s |
| `v_vk_vk_i`, `w_vk_vk_i` | (3, >= T) | velocities of the vehicle (IMU) in its own frame, m/s and rad/s |
| `y_k_j` | (4, T, N) | uL, vL, uR, vR in pixels, -1 where unobserved |
| `C_c_v`, `rho_v_c_v` | (3, 3), (3, 1) | rotation IMU to camera; position of the camera in the IMU frame, m |
| `fu fv cu cv b` | (1, 1) | calibration, pixels and metres |
| `r_i_vk_i`, `theta_vk_i` | (3, >= T) | true position, m, and axis-angle of world_R_imu, rad, in any world |
| `rho_i_pj_i` | (3, N) | surveyed landmarks in that world, m (only dataset3) |

Where velocities and truth go on beyond `t`, the first T of them count.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, StereoCamera, so3

from ..observations import Observations
from ..sequence import Sequence, Truth
from .feature_block import dense_features
from .mat_file import MatFile

VELOCITIES = ("v_vk_vk_i", "w_vk_vk_i")
TRUTH = ("r_i_vk_i", "theta_vk_i")
VARIANCES = ("v_var", "w_var", "y_var")


def read_utias(mat: MatFile, name: str, source: str) -> Sequence:
    """The recording in a UTIAS file, truth included where the file has it. Raises InputError naming the variable."""
    if not mat.keys & {"y_k_j", *VELOCITIES}:
        found = ", ".join(repr(k) for k in sorted(mat.keys)[:16]) or "nothing"
        raise InputError(
            f"this MATLAB file is no UTIAS recording; expected v_vk_vk_i, w_vk_vk_i and y_k_j, found {found}"
        )
    t = mat.array("t")
    if t.ndim != 2 or t.shape[0] != 1:
        raise InputError(f"t: expected shape (1, T), got {t.shape}; save one row of seconds")
    T = t.shape[1]
    if T < 2:
        raise InputError(f"t: a recording needs at least 2 frames, this one has {T}")
    observations, n_landmarks = _observations(mat, T)
    v, w = (_first_columns(mat, key, T) for key in VELOCITIES)
    return Sequence(
        name=name,
        t=t[0].copy(),
        linear_velocity=v,
        angular_velocity=w,
        camera=StereoCamera(*(_scalar(mat, key) for key in ("fu", "fv", "cu", "cv", "b"))),
        imu_T_cam=_extrinsic(mat),
        observations=observations,
        n_landmarks=n_landmarks,
        truth=_truth(mat, T, n_landmarks),
        form="utias",
        source=source,
        remarks=tuple(_remarks(mat, T)),
    )


def _observations(mat: MatFile, T: int) -> tuple[Observations, int]:
    if "y_k_j" not in mat.keys:
        return Observations.none(), 0
    block = mat.array("y_k_j")
    if block.ndim == 2:  # MATLAB drops a last axis of length 1
        block = block[:, :, None]
    if block.ndim != 3 or block.shape[:2] != (4, T):
        raise InputError(f"y_k_j: expected shape (4, {T}, N) for the {T} time stamps, got {block.shape}")
    return dense_features(block, "y_k_j"), block.shape[2]


def _first_columns(mat: MatFile, key: str, T: int) -> FloatArray:
    """(T, 3) of a variable (3, >= T)."""
    array = mat.array(key)
    if array.ndim != 2 or array.shape[0] != 3 or array.shape[1] < T:
        raise InputError(f"{key}: expected 3 rows of at least {T} columns for the {T} time stamps, got {array.shape}")
    return np.ascontiguousarray(array[:, :T].T)


def _extrinsic(mat: MatFile) -> FloatArray:
    imu_T_cam = np.eye(4)
    for key, shape in (("C_c_v", (3, 3)), ("rho_v_c_v", (3, 1))):
        if mat.shape(key) != shape:
            raise InputError(f"{key}: expected shape {shape}, got {mat.shape(key)}")
    imu_T_cam[:3, :3] = mat.array("C_c_v").T
    imu_T_cam[:3, 3] = mat.array("rho_v_c_v")[:, 0]
    return imu_T_cam


def _scalar(mat: MatFile, key: str) -> float:
    value = mat.array(key)
    if value.size != 1 or not np.isfinite(value).all():
        raise InputError(f"{key}: expected one finite number, got {value.tolist() if value.size < 5 else value.shape}")
    return float(value.reshape(-1)[0])


def _truth(mat: MatFile, T: int, n_landmarks: int) -> Truth | None:
    if not mat.keys.issuperset(TRUTH):
        return None
    poses = np.tile(np.eye(4), (T, 1, 1))
    poses[:, :3, 3] = _first_columns(mat, "r_i_vk_i", T)
    poses[:, :3, :3] = so3.exp_so3(_first_columns(mat, "theta_vk_i", T))
    poses[~np.isfinite(poses).all(axis=(1, 2))] = np.nan
    landmarks = None
    if "rho_i_pj_i" in mat.keys:
        landmarks = mat.array("rho_i_pj_i").T
        if landmarks.shape != (n_landmarks, 3):
            raise InputError(f"rho_i_pj_i: expected shape (3, {n_landmarks}), got {landmarks.T.shape}")
    return Truth.from_any_world(poses, landmarks)


def _remarks(mat: MatFile, T: int) -> list[str]:
    remarks = []
    samples = {key: mat.shape(key)[1] for key in (*VELOCITIES, *TRUTH) if key in mat.keys}
    longer = {key: n for key, n in samples.items() if n > T}
    if longer:
        counts = " or ".join(str(n) for n in sorted(set(longer.values())))
        remarks.append(f"{', '.join(longer)}: {counts} samples for {T} time stamps; the first {T} count.")
    if "y_k_j" not in mat.keys:
        remarks.append("The recording has no features, so nothing but dead reckoning can be run on it.")
    if not mat.keys.issuperset(TRUTH):
        remarks.append("The file has no ground truth (r_i_vk_i and theta_vk_i).")
    given = [key for key in VARIANCES if key in mat.keys]
    if given:
        remarks.append(f"The file gives variances ({', '.join(given)}), which are not used.")
    return remarks
