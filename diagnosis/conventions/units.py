"""Units of stamps, velocities and baseline, from the motion of the odometry, which has none.

Odometry measures rotations absolutely and translations in baselines. Over an interval dt of the file, with velocities
v, w and a baseline b of the file, it measures

    rotation / (w dt)    = time * angular
    translation / (v dt) = time * linear / baseline

where each factor converts a unit of the file to SI. The hypothesis with the fewest wrong units, and with plausible
intervals and baselines, is chosen; where it does not lead, nothing is changed.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from math import log10

import numpy as np

from fgbaseline.data.finding import AS_GIVEN, Finding
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.time_unit import TimeUnit, rescaled_time, usual
from fgbaseline.data.velocity_increments import zero_order_hold
from fgbaseline.geometry import FloatArray

from ..odometry.stereo_odometry import Odometry
from .extrinsics_check import BASELINES, camera_distance, usual_rig
from .neighbor_deviation import FAR_BLIND, among_neighbors
from .rate_units import CALIBRATED, DEGREE, doubt_of_rate_unit, measured, of_no_unit
from .scale_ratio import ScaleRatio, scale_ratio

THOUSANDS = (1.0, 1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9)
ANGULAR = (1.0, DEGREE, *THOUSANDS[1:])
CENTI, KMH, FEET = 1e-2, 1.0 / 3.6, 0.3048
"""factors of cm or cm/s, km/h and ft/s"""
TOLERANCE = 0.45
"""tolerance of log10 of a ratio for factors of 1000 and degrees; other units must fit within the noise"""
UNUSUAL = 1.5
"""number of wrong units equivalent to an implausible interval or baseline"""
LEAD = 1.0
"""number of wrong units by which a hypothesis must lead"""
MIN_KNOWN = 20
"""intervals whose motion the cameras show"""
OVERSHOOT, LARGE_RATE = 20.0, 0.3
"""factor on the rates from the cameras, and rad/s: rates beyond both are no noise of a gyroscope"""
NAMES = ("time", "angular", "linear", "baseline")
LABELS = {
    "time": "stamps",
    "angular": "angular velocities",
    "linear": "linear velocities",
    "baseline": "the baseline",
    "extrinsic": "the translation of imu_T_cam",
}
SI = {"time": "s", "angular": "rad/s", "linear": "m/s", "baseline": "m", "extrinsic": "m"}
LENGTHS = {1e-3: "mm", CENTI: "cm", 1e3: "km"}
NOUNS = {
    "time": {unit.seconds: unit.noun for unit in TimeUnit},
    "angular": {DEGREE: "°/s", 1e-3: "mrad/s"},
    "linear": {1e-3: "mm/s", CENTI: "cm/s", KMH: "km/h", 1e3: "km/s"},
    "baseline": LENGTHS,
    "extrinsic": LENGTHS,
}
TURNS = "the camera's velocity in turns"
SAME_RATIO = 0.05
"""relative difference of both scale ratios, beyond their noise, up to which the stamps' unit explains both"""
SETTLE_RATES = "write rad/s, or the factor as angular_velocity in a table [units] in --repairs"
SETTLE_DISTANCES = "write m/s and m, or the factors as linear_velocity and baseline in a table [units] in --repairs"


@dataclass(frozen=True, slots=True)
class Units:
    """Factors that convert recorded quantities to SI."""

    time: float = 1.0
    """s"""
    angular: float = 1.0
    """rad/s"""
    linear: float = 1.0
    """m/s"""
    baseline: float = 1.0
    """m"""
    extrinsic: float = 1.0
    """m, of the translation of imu_T_cam"""
    doubt: str = ""
    """sentence on an ambiguity that remains; empty without one"""
    scale_ratios: tuple[ScaleRatio, ScaleRatio] | None = None
    """odometry over recorded angular velocity, and over recorded linear velocity"""
    given: frozenset[str] = frozenset()
    """names of the factors that the user specified"""

    @property
    def wrong(self) -> int:
        """The number of factors other than 1."""
        return sum(getattr(self, name) != 1.0 for name in LABELS)


def units_of(sequence: Sequence, seen_by_cameras: Odometry | None, given: Mapping[str, float] | None = None) -> Units:
    """The units of a recording, those that are `given` (by the names of `Units`) as they are.

    `seen_by_cameras` is the odometry of `usual_rig(sequence)`, or None where nothing is seen.
    """
    given = ({"time": 1.0} if sequence.time_unit_given else {}) | dict(given or {})
    scale_ratios = _gains(sequence, seen_by_cameras)
    interval, b = float(np.median(sequence.dt)), sequence.stereo_camera.baseline
    ratios = _known(scale_ratios[0]), _known(scale_ratios[1])
    if not given and any(ratio is not None for ratio in ratios) and _fits(Units(), ratios):
        return Units(scale_ratios=scale_ratios, doubt=_unfollowed(sequence, Units(), scale_ratios[0], given))

    def unlikely(units: Units) -> float:
        changed = units.linear != 1.0 or units.baseline != 1.0 or not scale_ratios[1].known
        rig = changed and "baseline" not in given and not BASELINES[0] <= b * units.baseline <= BASELINES[1]
        clock = "time" not in given and not usual(interval * units.time)
        wrong = [name for name in NAMES if name not in given and getattr(units, name) != 1.0]
        return len(wrong) + UNUSUAL * (rig + clock)

    fitting = sorted(((unlikely(u), i, u) for i, u in enumerate(_hypotheses(given)) if _fits(u, ratios)))
    if not fitting:
        return replace(next(_hypotheses(given)), doubt=_of_no_unit(scale_ratios, given), scale_ratios=scale_ratios)
    least, _, best = fitting[0]
    others = [u for cost, _, u in fitting[1:] if cost < least + LEAD]
    doubt = (
        _doubt(sequence, scale_ratios, [best, *others])
        if others
        else _unfollowed(sequence, best, scale_ratios[0], given) or _near_a_unit(best, scale_ratios, given)
    )
    return replace(next(_hypotheses(given)) if doubt else best, doubt=doubt, scale_ratios=scale_ratios)


def _unfollowed(sequence: Sequence, units: Units, seen: ScaleRatio, given: Mapping[str, float]) -> str:
    """Doubt about rates that are far larger than those seen and no noise of a gyroscope."""
    rate = _without_jumps(sequence.angular_velocity) * units.angular
    scatter = float(np.sqrt(np.mean((rate - np.median(rate, axis=0)) ** 2)))
    excess = units.time * units.angular / seen.ratio if seen.ratio > 0.0 else 0.0
    if seen.known or "angular" in given or scatter < LARGE_RATE or excess < OVERSHOOT:
        return ""
    return (
        f"the recorded angular velocities scatter by {scatter:.2g} rad/s, {excess:.3g} times more than the cameras "
        "see, and do not follow it: they are in another unit (57.3 times for °/s) or not of this recording; settle "
        "it with angular_velocity in a table [units] in --repairs"
    )


def _near_a_unit(units: Units, scale_ratios: tuple[ScaleRatio, ScaleRatio], given: Mapping[str, float]) -> str:
    """Doubt about units whose factors are near the measured ones, and differ from them by more than the noise."""
    angular, linear = scale_ratios
    if "angular" not in given:
        doubt = doubt_of_rate_unit(angular, units.angular, _named("angular", units.angular), units.time)
        if doubt:
            return f"{doubt}; {SETTLE_RATES}"
    if {units.linear, units.baseline} & {CENTI, KMH} and not {"linear", "baseline"} & set(given):
        factor = units.time * units.linear / units.baseline
        if not linear.admits(factor, CALIBRATED):
            return f"{of_no_unit('distances', linear)}; {SETTLE_DISTANCES}"
        if units.linear == KMH and linear.admits(factor * FEET / KMH, CALIBRATED):
            return f"{measured('distances', linear)}: velocities may be in km/h or ft/s; {SETTLE_DISTANCES}"
    return ""


def _of_no_unit(scale_ratios: tuple[ScaleRatio, ScaleRatio], given: Mapping[str, float]) -> str:
    """Doubt about ratios that no units explain, unless the user states the unit."""
    angular, linear = scale_ratios
    if angular.known and linear.known and "time" not in given and angular.admits(linear.ratio, SAME_RATIO):
        return (
            f"the recorded turns and distances are both {1.0 / linear.ratio:.4g} times those that the cameras see, as "
            f"with stamps in a unit of {linear.ratio:.4g} s; write seconds, or the factor as time in a table [units] "
            "in --repairs"
        )
    turns = (time * rate for time in THOUSANDS for rate in ANGULAR)
    if angular.known and "angular" not in given and not any(_is_near(angular.ratio, factor) for factor in turns):
        return f"{doubt_of_rate_unit(angular, np.nan, '')}; {SETTLE_RATES}"
    if linear.known and not {"linear", "baseline"} & set(given):
        return f"{of_no_unit('distances', linear)}; {SETTLE_DISTANCES}"
    return ""


def _gains(sequence: Sequence, seen_by_cameras: Odometry | None) -> tuple[ScaleRatio, ScaleRatio]:
    unknown = ScaleRatio(np.nan, known=False)
    if seen_by_cameras is None or seen_by_cameras.known.sum() < MIN_KNOWN:
        return unknown, unknown
    seen, recorded = seen_by_cameras.twist(sequence.dt), _without_jumps(zero_order_hold(sequence))
    scale = sequence.stereo_camera.baseline / usual_rig(sequence).stereo_camera.baseline
    angular = scale_ratio(seen[:, 3:], recorded[:, 3:], seen_by_cameras.known, centered=True)
    linear = scale_ratio(seen[:, :3], recorded[:, :3], seen_by_cameras.known, centered=False)
    return angular, linear._replace(ratio=linear.ratio * scale)


def _without_jumps(recorded: FloatArray) -> FloatArray:
    """Velocities (n, c), those of single samples far from all around them replaced: a few would hide the unit."""
    parts = []
    for part in np.split(recorded, recorded.shape[1] // 3, axis=1):
        usual, far = among_neighbors(part)
        parts.append(np.where((far > FAR_BLIND)[:, None], usual, part))
    return np.hstack(parts)


def _hypotheses(given: Mapping[str, float]) -> Iterator[Units]:
    """All, the usual units first."""
    choices: dict[str, tuple[float, ...]] = {
        "time": THOUSANDS,
        "angular": ANGULAR,
        "linear": (*THOUSANDS, CENTI, KMH),
        "baseline": (*THOUSANDS, CENTI),
    }
    choices |= {name: (factor,) for name, factor in given.items()}
    for time, angular, linear, baseline in product(*(choices[name] for name in NAMES)):
        yield Units(time, angular, linear, baseline)


def _fits(units: Units, ratios: tuple[float | None, float | None]) -> bool:
    """Whether these units explain the known scale ratios of turns and distances."""
    expected = (units.time * units.angular, units.time * units.linear / units.baseline)
    return all(ratio is None or _is_near(ratio, value) for ratio, value in zip(ratios, expected, strict=True))


def _is_near(ratio: float, factor: float) -> bool:
    return abs(log10(ratio / factor)) < TOLERANCE


def _known(seen: ScaleRatio) -> float | None:
    return seen.ratio if seen.known else None


def rescaled(sequence: Sequence, units: Units) -> Sequence:
    """The recording in SI units."""
    if units.wrong == 0:
        return sequence
    imu_T_cam = sequence.imu_T_cam.copy()
    imu_T_cam[:3, 3] *= units.extrinsic
    return replace(
        rescaled_time(sequence, units.time),
        linear_velocity=sequence.linear_velocity * units.linear,
        angular_velocity=sequence.angular_velocity * units.angular,
        camera=replace(sequence.stereo_camera, baseline=sequence.stereo_camera.baseline * units.baseline),
        imu_T_cam=imu_T_cam,
    )


def unit_findings(units: Units, sequence: Sequence, seen: str = "") -> tuple[Finding, ...]:
    """A finding for each wrong unit of `sequence`, as recorded; `seen` is evidence other than the scale ratios."""
    interval, b = float(np.median(sequence.dt)), sequence.stereo_camera.baseline
    texts = {
        "time": f"The time stamps are in {_named('time', units.time)}: their median interval of {interval:.6g} is "
        f"{interval * units.time:.3g} s",
        "angular": f"The angular velocity is in {_named('angular', units.angular)} and not in rad/s",
        "linear": f"The linear velocity is in {_named('linear', units.linear)} and not in m/s",
        "baseline": f"The stereo baseline, {b:.6g}, is in {_named('baseline', units.baseline)} and not in m",
        "extrinsic": f"The translation of imu_T_cam, {camera_distance(sequence):.6g} long, is in "
        f"{_named('extrinsic', units.extrinsic)} and not in m",
    }
    codes = {"time": "time_unit", "angular": "angular_velocity_unit", "linear": "linear_velocity_unit"}
    found = []
    for name in LABELS:
        factor = getattr(units, name)
        if factor != 1.0:
            text = f"{texts[name]}: {1.0 / factor:.6g} times too large; multiplied by {factor:.6g}."
            if factor > 1.0:
                text = f"{texts[name]}: {factor:.6g} times too small; multiplied by {factor:.6g}."
            code = codes.get(name, f"{name}_unit")
            motion = seen or (TURNS if name == "extrinsic" else evidence(units))
            certainty = AS_GIVEN if name in units.given else motion
            found.append(Finding(code, text, 1.0 / factor, 1.0, "recorded over true", certainty))
    return tuple(found)


def evidence(units: Units) -> str:
    """The evidence of the odometry for the units, in words."""
    assert units.scale_ratios is not None
    words = [
        f"{what} {g.ratio:.3g} times as large as recorded"
        for what, g in zip(("turns", "distances"), units.scale_ratios, strict=True)
        if g.known
    ]
    return f"the cameras see {' and '.join(words)}" if words else "the cameras show no motion to compare with"


def _doubt(sequence: Sequence, scale_ratios: tuple[ScaleRatio, ScaleRatio], candidates: list[Units]) -> str:
    fits = []
    for units in candidates[:3]:
        wrong = [f"{LABELS[name]} in {_named(name, f)}" for name in NAMES if (f := getattr(units, name)) != 1.0]
        fits.append(" with ".join(wrong) or "all units as they should be")
    return (
        f"the units are in doubt: {evidence(Units(scale_ratios=scale_ratios))}, the median interval between frames is "
        f"{float(np.median(sequence.dt)):.6g} and the baseline {sequence.stereo_camera.baseline:.6g}, which fits "
        f"{' as well as '.join(fits)}; settle it with --time-unit s, ms, us or ns, or with a table [units] in --repairs"
    )


def _named(name: str, factor: float) -> str:
    return NOUNS[name].get(factor, f"units of {factor:g} {SI[name]}")
