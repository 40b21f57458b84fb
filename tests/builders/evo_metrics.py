"""evo's trajectory metrics, called as its documentation does, under this project's names."""

import contextlib
import io
import warnings
from collections.abc import Iterator

import numpy as np
from evo.core.filters import FilterException
from evo.core.metrics import APE, RPE, PoseRelation
from evo.core.metrics import Unit as EvoUnit
from evo.core.trajectory import PosePath3D, PoseTrajectory3D

from fgbaseline.compare import Align, Unit
from fgbaseline.compare import PoseRelation as Relation
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray

OF_POSES = {
    Relation.TRANSLATION: PoseRelation.translation_part,
    Relation.ROTATION: PoseRelation.rotation_angle_rad,
    Relation.ROTATION_DEG: PoseRelation.rotation_angle_deg,
    Relation.ROTATION_CHORD: PoseRelation.rotation_part,
    Relation.POSE: PoseRelation.full_transformation,
}
OF_MOTIONS = OF_POSES | {
    Relation.DISTANCE: PoseRelation.point_distance,
    Relation.DISTANCE_PERCENT: PoseRelation.point_distance_error_ratio,
}
UNITS = {Unit.FRAMES: EvoUnit.frames, Unit.METERS: EvoUnit.meters, Unit.DEGREES: EvoUnit.degrees}
ALIGNMENTS: dict[str, tuple[Align, int | None]] = {
    "none": (Align.NONE, None),
    "first pose": (Align.FIRST_POSE, None),
    "SE(3)": (Align.SE3, None),
    "SE(3), first 5": (Align.SE3, 5),
    "Sim(3)": (Align.SIM3, None),
    "Sim(3), first 5": (Align.SIM3, 5),
}


def evo_path(path: Trajectory) -> PoseTrajectory3D:
    return PoseTrajectory3D(poses_se3=list(path.world_T_body.copy()), timestamps=path.t, name=path.name)


def evo_aligned(estimate: FloatArray, reference: FloatArray, alignment: str) -> PosePath3D:
    kind, first = ALIGNMENTS[alignment]
    path, goal = (PosePath3D(poses_se3=list(poses.copy())) for poses in (estimate, reference))
    if kind is Align.FIRST_POSE:
        path.align_origin(goal)
    elif kind is not Align.NONE:
        path.align(goal, correct_scale=kind is Align.SIM3, n=first or -1)
    return path


def evo_ape(reference: FloatArray, path: PosePath3D, what: Relation) -> FloatArray:
    metric = APE(OF_POSES[what])
    metric.process_data((PosePath3D(poses_se3=list(reference)), path))
    return np.asarray(metric.error)


def evo_rpe(
    reference: FloatArray, path: PosePath3D, delta: float, unit: Unit, all_pairs: bool, from_reference: bool
) -> Iterator[tuple[Relation, FloatArray]]:
    """Each relation's errors; nothing where evo finds no pair. Percentages without those of standing references."""
    goal = PosePath3D(poses_se3=list(reference))
    for what, relation in OF_MOTIONS.items():
        metric = RPE(relation, delta, UNITS[unit], all_pairs=all_pairs, pairs_from_reference=from_reference)
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                metric.process_data((goal, path))
            except FilterException:
                return
        yield what, np.asarray(metric.error)
