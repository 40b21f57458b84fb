"""Time units and quaternion orders that a trajectory file does not state, decided by the other files."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import MatchedTrajectories
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import Landmarks, TimeUnit, Trajectory
from fgbaseline.data.formats import Order, ParsedTrajectory
from fgbaseline.data.formats.stamps.common_time_unit import Spans, units_in_common
from fgbaseline.data.formats.trajectories.parsed_trajectory import bends, unit_ambiguity
from fgbaseline.data.formats.trajectories.quaternion_order import fits_clearly_better, in_words
from fgbaseline.geometry import FloatArray, InputError, so3

Source = ParsedTrajectory | Trajectory
Times = Sequence[FloatArray]
"""stamps, s, for files without stamps: a file takes the first array that is as long as its trajectory"""
FEWEST = 10
"""smallest number of pose pairs to decide quaternion orders"""
VARIED, TURNED = np.deg2rad(1.0), np.deg2rad(10.0)
"""rad; smallest angle from the first orientation that shows a rotation, and one that shows a turn of the path"""


@dataclass(frozen=True, eq=False, slots=True)
class Resolved:
    """A trajectory file, or a trajectory in memory, with the conventions decided so far."""

    source: Source
    unit: TimeUnit = TimeUnit.S
    order: Order = "xyzw"
    oriented: bool = True
    order_in_doubt: bool = False
    """whether another order of the quaternions fits as well, and neither header nor option settles it"""
    remarks: tuple[str, ...] = ()
    """findings: each completes a sentence that begins with the trajectory's name"""

    def trajectory(self, times: Times, order: Order | None = None) -> Trajectory:
        """The trajectory, with its quaternions in another order if one is given."""
        if isinstance(self.source, ParsedTrajectory):
            return self.source.trajectory(self.unit, order or self.order, times, oriented=self.oriented)
        return replace(self.source, oriented=self.source.oriented and self.oriented)

    @property
    def covariance(self) -> FloatArray | None:
        """Covariances (n, 6, 6) of the right perturbation of each pose; None if the file has none."""
        return self.source.covariance(self.order) if isinstance(self.source, ParsedTrajectory) else None

    @property
    def up(self) -> FloatArray | None:
        """Unit vector (3,) that points up in the world of the poses; None if neither file nor format defines it."""
        return self.source.up if isinstance(self.source, ParsedTrajectory) else None

    @property
    def up_stated(self) -> bool:
        """Whether the file itself states `up`."""
        return isinstance(self.source, ParsedTrajectory) and self.source.up_stated

    @property
    def landmarks(self) -> Landmarks | None:
        """Landmarks in the world of the poses; None if the source has none."""
        return self.source.landmarks if isinstance(self.source, ParsedTrajectory) else None

    @property
    def orders(self) -> tuple[Order, ...]:
        """Possible orders of the quaternion components, the likeliest first."""
        return self.source.orders if isinstance(self.source, ParsedTrajectory) else ("xyzw",)

    def remarked(self, remark: str) -> "Resolved":
        """The input with one more remark."""
        return replace(self, remarks=(*self.remarks, remark))


def resolve(sources: Sequence[Source], times: Times, settings: Settings) -> list[Resolved]:
    """Sources with their conventions decided; the first is the reference.

    Raises InputError for time units that nothing decides.
    """
    _require_same_frames(sources, times)
    reference, *estimates = _with_units(sources, settings)
    reference, *estimates = _with_orders(reference, estimates, times, settings)
    return _without_constant_orientations([reference, *estimates], times)


def _require_same_frames(sources: Sequence[Source], times: Times) -> None:
    """Raises InputError where files without stamps and numbers of frames differ in length."""
    bare = [s for s in sources if isinstance(s, ParsedTrajectory) and s.stamps is None and s.frame is None]
    for other in () if times else bare[1:]:
        if len(other.position) != len(bare[0].position):
            raise InputError(
                f"{other.source}: it has {len(other.position):,} poses and {bare[0].source} has "
                f"{len(bare[0].position):,}; without stamps pose k is that of frame k in both, so they cannot be "
                "paired: put the number of its frame before each pose (13 columns), or give --times for each file"
            )


def _with_units(sources: Sequence[Source], settings: Settings) -> list[Resolved]:
    spans = [_spans(source, settings.unit) for source in sources]
    first, *others = spans
    shifted = [{u: (a + settings.offset, b + settings.offset) for u, (a, b) in each.items()} for each in others]
    if len(first) > 1:
        found = next((f for each in shifted if each and (f := units_in_common(first, each))), None)
        first = {found[0]: first[found[0]]} if found else first
    chosen = [_only(sources[0], first)]
    for source, each in zip(sources[1:], shifted, strict=True):
        common = units_in_common({chosen[0]: first[chosen[0]]}, each) if first and len(each) > 1 else None
        chosen.append(common[1] if common else _only(source, each))
    return [_with_unit(source, unit) for source, unit in zip(sources, chosen, strict=True)]


def _spans(source: Source, wanted: TimeUnit | None) -> Spans:
    """First and last stamp, s, for each unit that the stamps may have; empty without stamps."""
    if isinstance(source, Trajectory):
        return {TimeUnit.S: (float(source.t[0]), float(source.t[-1]))} if source.stamped else {}
    if source.stamps is None:
        return {}
    units = (wanted,) if wanted is not None and not source.unit_known else source.units
    return {u: (float(t[0]), float(t[-1])) for u in units for t in (source.stamps.seconds(u),)}


def _only(source: Source, spans: Spans) -> TimeUnit:
    """The only possible unit. Raises InputError where there are several, or none although there are stamps."""
    if isinstance(source, Trajectory) or source.stamps is None or len(spans) == 1:
        return next(iter(spans), TimeUnit.S)
    raise InputError(unit_ambiguity(source, list(spans)))


def _with_unit(source: Source, unit: TimeUnit) -> Resolved:
    remarks = source.remarks if isinstance(source, ParsedTrajectory) else ()
    found = Resolved(source, unit, remarks=remarks)
    if unit is TimeUnit.S or isinstance(source, Trajectory) or source.stamps is None or source.stamps.unit is not None:
        return found
    return found.remarked(f"its time stamps are in {unit.noun} and are divided by {unit.per_second:,}")


def _with_orders(
    reference: Resolved, estimates: Sequence[Resolved], times: Times, settings: Settings
) -> list[Resolved]:
    """Inputs with quaternion orders: stated by header or user, else what fits clearly better, else the usual."""
    reference, *estimates = [_asked_for(each, settings.quaternion) for each in (reference, *estimates)]
    if settings.quaternion is not None:
        return [reference, *estimates]
    matrices = [_misfits(reference, each, times, settings) for each in estimates]
    known = [matrix for matrix in matrices if matrix is not None]
    if known and known[0].shape[0] > 1:
        assumed, other = np.median([matrix.min(axis=1) for matrix in known], axis=0)
        reference, row = _decided(reference, assumed, other)
    else:
        row = 0
        reference, _ = _decided(reference, *_travel_misfits(reference, times))
    decided_estimates = []
    for each, matrix in zip(estimates, matrices, strict=True):
        misfits = _travel_misfits(each, times) if matrix is None else matrix[row]
        chosen, other = _decided(each, *misfits)
        matched = paired(reference.trajectory(times), each.trajectory(times), settings)
        if len(misfits) > 1 and not other and matched is not None and len(matched) >= FEWEST:
            inverse = _of_inverse_poses(reference, chosen, times, settings)
            chosen = _with_doubt(chosen, *misfits) if inverse is None else inverse
        decided_estimates.append(chosen)
    return [reference, *decided_estimates]


def _asked_for(each: Resolved, order: Order | None) -> Resolved:
    """The input with the user's order, where the file names none."""
    if order is None or len(each.orders) == 1:
        return replace(each, order=each.orders[0])
    return replace(each, order=order)


def _misfits(reference: Resolved, estimate: Resolved, times: Times, settings: Settings) -> FloatArray | None:
    """Misfits of the rotations, deg: a row for each order of the reference, a column for each of the estimate.

    A misfit is the `least_rotation_misfit`. None without orientations, and with too few pairs.
    """
    if len(reference.orders) == len(estimate.orders) == 1:
        return None
    rows = []
    for row in reference.orders:
        cells = []
        for column in estimate.orders:
            matched = paired(reference.trajectory(times, row), estimate.trajectory(times, column), settings)
            if matched is None or len(matched) < FEWEST or not (_vary(matched.reference) and _vary(matched.estimate)):
                return None
            cells.append(compare.least_rotation_misfit(matched))
        rows.append(cells)
    return np.array(rows)


def _travel_misfits(each: Resolved, times: Times) -> tuple[float, ...]:
    """Change of the direction of travel in the body frame along a path, deg, by quaternion order."""
    if len(each.orders) == 1:
        return ()
    paths = [each.trajectory(times, order) for order in each.orders]
    return tuple(compare.travel_direction_misfit(path.position, path.rotation) for path in paths)


def _decided(each: Resolved, assumed: float = 0.0, other: float = 0.0) -> tuple[Resolved, int]:
    """The input with the order that fits clearly better, and 1 where that is not the usual one."""
    if len(each.orders) == 1 or not fits_clearly_better(other, assumed):
        return each, 0
    order = each.orders[1]
    remark = (
        f"its quaternions are read as {in_words(order)}: the median misfit of its rotations is {other:.3g}°, and "
        f"{assumed:.3g}° as {in_words(each.orders[0])}"
    )
    return replace(each, order=order).remarked(remark), 1


def _of_inverse_poses(reference: Resolved, each: Resolved, times: Times, settings: Settings) -> Resolved | None:
    """Input in the only quaternion order with which its inverse poses fit the reference; None unless there is one."""
    fitting = []
    for order in each.orders:
        matched = paired(reference.trajectory(times), each.trajectory(times, order), settings)
        if matched is None:
            continue
        rmse, inverted = compare.rmse_of_inverse_poses(matched)
        if fits_clearly_better(inverted, rmse, least=0.0):
            fitting.append(order)
    if len(fitting) != 1:
        return None
    found = replace(each, order=fitting[0])
    return found if fitting[0] == each.orders[0] else found.remarked(f"its quaternions are {in_words(fitting[0])}")


def _with_doubt(each: Resolved, assumed: float, other: float) -> Resolved:
    """Input, with a remark if the usual order does not fit clearly better than the other, as along straight paths."""
    if fits_clearly_better(assumed, other):
        return each
    orders = [in_words(order) for order in each.orders]
    fits = f"its rotations fit to {assumed:.3g}° in the median as {orders[0]}, to {other:.3g}° as {orders[1]}"
    if np.isnan(assumed):
        fits = "its body hardly moves"
    unnamed = "no header names the order of its quaternions"
    return replace(
        each.remarked(f"{unnamed}, and {fits}: {orders[0]} is assumed; --quaternion settles it"), order_in_doubt=True
    )


def paired(
    reference: Trajectory, estimate: Trajectory, settings: Settings, *, oriented: bool = True
) -> MatchedTrajectories | None:
    """Pairs of poses, not aligned; None without any (reported later), and without orientations if `oriented`."""
    if reference.stamped != estimate.stamped or (oriented and not (reference.oriented and estimate.oriented)):
        return None
    try:
        return compare.associate(
            reference, estimate, how=settings.association, tolerance=settings.tolerance, offset=settings.offset
        )
    except InputError:
        return None


def _without_constant_orientations(every: list[Resolved], times: Times) -> list[Resolved]:
    """Inputs without the orientations of files that have a single one while their path bends or another file turns."""
    paths = [each.trajectory(times) for each in every]
    turning = [path.oriented and _vary(path, TURNED) for path in paths]
    result = []
    for each, path, turns in zip(every, paths, turning, strict=True):
        constant = path.oriented and len(path) > 1 and bool(np.abs(path.rotation - path.rotation[0]).max() < 1e-12)
        if constant and not turns and (any(turning) or bends(path.position)):
            each = replace(each, oriented=False).remarked(
                "all its orientations are the same: it has positions and no orientations"
            )
        result.append(each)
    return result


def _vary(path: Trajectory, by: float = VARIED) -> bool:
    """Whether orientations differ from the first by more than an angle, rad."""
    return bool(so3.rotation_angle(path.rotation[0].T @ path.rotation).max() > by)
