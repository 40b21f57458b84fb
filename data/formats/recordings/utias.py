"""The UTIAS `.mat` recordings (Clement et al., CRV 2015): velocities, stereo tracks, calibration and truth in one file.

| variable | shape | is |
|---|---|---|
| `t` | (1, T) | time stamps, s |
| `v_vk_vk_i`, `w_vk_vk_i` | (3, >= T) | velocities of the vehicle (IMU) in its own frame, m/s and rad/s |
| `y_k_j` | (4, T, N) | uL, vL, uR, vR in pixels, -1 where unobserved |
| `C_c_v`, `rho_v_c_v` | (3, 3), (3, 1) | rotation IMU to camera; position of the camera in the IMU frame, m |
| `fu fv cu cv b` | (1, 1) | calibration, pixels and meters |
| `r_i_vk_i`, `theta_vk_i` | (3, >= T) | true position, m, and axis-angle of world_R_imu, rad, in any world |
| `rho_i_pj_i` | (3, N) | surveyed landmarks in that world, m (only dataset3) |

Where velocities and truth go on beyond `t`, the first T of them count.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, StereoCamera, so3

from ...finding import Finding
from ...observations import Observations
from ...sequence import Sequence, Truth
from ..files.field_checks import extrinsic, positive, vectors
from ..files.mat_file import MatFile
from ..stamps.frame_stamps import read_stamps
from .feature_block import read_features_by_frame

VELOCITIES = ("v_vk_vk_i", "w_vk_vk_i")
TRUTH = ("r_i_vk_i", "theta_vk_i")
POSITIVE = {"fu": "a focal length in pixels", "fv": "a focal length in pixels", "b": "the baseline in meters"}
VARIANCES = ("v_var", "w_var", "y_var")


def read_utias(mat: MatFile, name: str, source: str) -> Sequence:
    """The recording in a UTIAS file, truth included where the file has it. Raises InputError naming the variable."""
    if not mat.keys & {"y_k_j", *VELOCITIES}:
        found = ", ".join(repr(k) for k in sorted(mat.keys)[:16]) or "nothing"
        raise InputError(
            f"this MATLAB file is not a UTIAS recording; expected v_vk_vk_i, w_vk_vk_i and y_k_j, found {found}"
        )
    stamps = read_stamps("t", mat.array("t"))
    T = len(stamps.kept)
    observations, n_landmarks, zeros = _observations(mat, T)
    v, w = (vectors(key, _first_columns(mat, key, T))[stamps.kept] for key in VELOCITIES)
    fu, fv, b = (positive(key, mat.array(key), what) for key, what in POSITIVE.items())
    cu, cv = (_finite(mat, key) for key in ("cu", "cv"))
    return Sequence(
        name=name,
        t=stamps.t,
        linear_velocity=v,
        angular_velocity=w,
        camera=StereoCamera(fu, fv, cu, cv, b),
        imu_T_cam=_extrinsic(mat),
        observations=stamps.observations(observations),
        n_landmarks=n_landmarks,
        truth=stamps.truth(_truth(mat, T, n_landmarks)),
        form="utias",
        source=source,
        remarks=tuple(_remarks(mat, T)),
        findings=(*stamps.findings, *zeros),
        left_out=stamps.left_out,
    )


def _observations(mat: MatFile, T: int) -> tuple[Observations, int, tuple[Finding, ...]]:
    if "y_k_j" not in mat.keys:
        return Observations.none(), 0, ()
    with mat.stream("y_k_j") as stream:
        return read_features_by_frame(stream, T)


def _first_columns(mat: MatFile, key: str, T: int) -> FloatArray:
    """First T columns (3, T) of a variable (3, >= T)."""
    array = mat.array(key)
    if array.ndim != 2 or array.shape[0] != 3 or array.shape[1] < T:
        raise InputError(f"{key}: expected 3 rows of at least {T} columns for the {T} time stamps, got {array.shape}")
    return array[:, :T]


def _extrinsic(mat: MatFile) -> FloatArray:
    for key, shape in (("C_c_v", (3, 3)), ("rho_v_c_v", (3, 1))):
        if mat.shape(key) != shape:
            raise InputError(f"{key}: expected shape {shape}, got {mat.shape(key)}")
    return extrinsic("C_c_v with rho_v_c_v", mat.array("C_c_v").T, mat.array("rho_v_c_v")[:, 0])


def _finite(mat: MatFile, key: str) -> float:
    value = mat.array(key)
    if value.size != 1 or not np.isfinite(value).all():
        raise InputError(f"{key}: expected one finite number, the image center in pixels, got {value.tolist()[:4]}")
    return float(value.reshape(-1)[0])


def _truth(mat: MatFile, T: int, n_landmarks: int) -> Truth | None:
    if not mat.keys.issuperset(TRUTH):
        return None
    poses = np.tile(np.eye(4), (T, 1, 1))
    poses[:, :3, 3] = _first_columns(mat, "r_i_vk_i", T).T
    poses[:, :3, :3] = so3.exp_so3(_first_columns(mat, "theta_vk_i", T).T)
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
