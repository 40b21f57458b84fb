"""What the diagnosis must find in the real recordings."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fgbaseline.data import read
from fgbaseline.diagnosis import Diagnosis, diagnose, findings_of

UTIAS = (
    "2011_09_26_drive_0001_sync_KLT",
    "2011_09_26_drive_0005_sync_KLT",
    "2011_09_26_drive_0009_sync_KLT",
    "2011_09_26_drive_0036_sync_KLT",
    "2011_09_30_drive_0027_sync_KLT",
)


@cache
def diagnosed(path: Path) -> Diagnosis:
    return diagnose(read(path))


def test_03_has_reversed_rates_a_bias_and_copied_frames(recordings: Callable[[str], Path]) -> None:
    d = diagnosed(recordings("03.npz"))
    found = {finding.code: finding for finding in findings_of(d)}
    assert {"angular_axes", "gyro_bias", "copied_frames", "disparity_not_positive"} <= set(found)
    assert d.angular.name == "x,-y,-z"
    assert d.linear.name.split(",")[0] == "x"
    assert d.linear.determined == (True, False, False)
    assert np.abs(d.gyro_bias - [-0.009, -0.010, -0.009]).max() < 0.002
    assert found["gyro_bias"].after < found["gyro_bias"].before
    assert int(d.repeated.sum()) == 153
    assert found["disparity_not_positive"].before == 621


@pytest.mark.parametrize("name", UTIAS)
def test_the_utias_drives_have_consistent_axes_and_no_bias(recordings: Callable[[str], Path], name: str) -> None:
    d = diagnosed(recordings(f"utias/{name}.mat"))
    codes = {finding.code for finding in findings_of(d)}
    assert not codes & {"angular_axes", "linear_axes", "gyro_bias", "copied_frames"}


def test_the_noise_that_was_added_to_0027_is_found(recordings: Callable[[str], Path]) -> None:
    d = diagnosed(recordings("ece276a_2020/0027.npz"))
    assert d.sigmas is not None
    assert d.sigmas.linear_velocity == pytest.approx(0.5, rel=0.25)
    assert d.sigmas.angular_velocity == pytest.approx(0.05, rel=0.25)
    assert int(d.repeated.sum()) == 91
    assert not {finding.code for finding in findings_of(d)} & {"angular_axes", "linear_axes"}
    assert d.linear.determined == (True, False, False)
