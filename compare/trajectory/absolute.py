"""How far each pose is from where it should be."""

import pandas as pd

from .association import Matched
from .ate_rpe import Difference, absolute_difference

OF_POSES = (Difference.TRANSLATION, Difference.ROTATION_DEG, Difference.ROTATION_CHORD, Difference.POSE)


def absolute_errors(matched: Matched) -> pd.DataFrame:
    """One row per pair of poses, with its time `t` (s, of the reference) and what `Difference` defines:

    `translation` (m; its RMSE is the ATE of Sturm et al., 2012), `rotation_deg`, `rotation_chord` and `pose`. In the
    reference's world, after whatever alignment `matched.caption` names.
    """
    estimate, reference = matched.estimate.world_T_body, matched.reference.world_T_body
    columns = {what.value: absolute_difference(estimate, reference, what) for what in OF_POSES}
    return pd.DataFrame({"t": matched.reference.t, **columns}).rename_axis("pose_index")
