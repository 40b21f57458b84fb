"""Second-order terms of one camera's observations are those of the prediction's curvature."""

import numpy as np
import pytest

from fgbaseline.ekf.joint.landmark_representation import LandmarkRepresentation, chart, homogeneous
from fgbaseline.ekf.joint.monocular.second_order import second_order
from fgbaseline.geometry import FloatArray, MonocularCamera, se3
from fgbaseline.geometry.linearization import predict

CAMERA = MonocularCamera(450.0, 460.0, 320.0, 240.0)
STEP = 1e-4


@pytest.mark.parametrize("seed", range(5))
def test_moments_are_those_of_the_curvature_by_finite_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    cam_T_imu, pose = se3.exp(0.3 * random.normal(size=(2, 6)))
    anchor = pose @ se3.inverse(cam_T_imu) @ se3.exp(0.1 * random.normal(size=6))
    charts = chart(LandmarkRepresentation.INVERSE_DEPTH, anchor)[None]
    xi = np.append(random.uniform(-0.3, 0.3, 2), 0.3)[None]
    half = random.normal(size=(9, 9)) * np.repeat([0.02, 0.01, 0.05], 3)[:, None]
    covariance = half @ half.T

    def pixel(error: FloatArray) -> FloatArray:
        points = homogeneous(charts, xi + error[6:])
        return predict(CAMERA, cam_T_imu, pose @ se3.exp(error[:6]), points).pixel[0]

    curvature = np.zeros((2, 9, 9))
    for i, a in enumerate(STEP * np.eye(9)):
        for j, b in enumerate(STEP * np.eye(9)):
            ends = pixel(a + b) - pixel(a - b) - pixel(b - a) + pixel(-a - b)
            curvature[:, i, j] = ends / (4.0 * STEP**2)
    found = second_order(CAMERA, cam_T_imu, pose, charts, xi, covariance[None])
    product = curvature @ covariance
    np.testing.assert_allclose(found.mean[0], 0.5 * np.trace(product, axis1=1, axis2=2), rtol=1e-4, atol=1e-5)
    expected = 0.5 * np.einsum("rij,rji->r", product, product)
    np.testing.assert_allclose(found.variance[0], expected, rtol=1e-4, atol=1e-5)
