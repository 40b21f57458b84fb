"""Elimination ordering of an iSAM2 update: constrained COLAMD with groups by the age of the last observation.

Unconstrained COLAMD may cut the chain of poses in the middle. Variables eliminated last stay near the root, where
every update visits them again: after 900 simulated frames, poses 30 s old were there, in cliques of 500 columns.
Groups by age eliminate the oldest first; COLAMD orders within a group. The solution is unchanged.
"""

from collections.abc import Collection

from ..graph.keys import AUXILIARY_POSE, frame_of, landmark_of, pose_key, state_keys

GROUP_FRAMES, N_GROUPS = 20, 6
"""of a group, and how many there are beside the last one; what is older is in the first of them.

Longer groups leave the choice to COLAMD, more of them cost a call for each key. What an update touches seldom reaches
back further than the life of a track, which is a few dozen frames.
"""
MANY_LANDMARKS = 200
"""landmarks of a frame, above which they are eliminated before its pose. As a rule all that a frame sees is kept for
the end, which costs the next frame least, as long as so many dense columns do not cost more themselves"""


class EliminationOrdering:
    """Last observation of each landmark, and the elimination groups that follow from it."""

    def __init__(self, inertial: bool = False) -> None:
        """With raw inertial data (`inertial`) velocity and biases of a frame are in the group of its pose."""
        self._inertial = inertial
        self._seen: dict[int, int] = {}
        """key of a landmark -> frame that saw it last; those seen last are at the end"""

    def remove(self, landmarks: Collection[int]) -> None:
        """Remove landmarks (keys): GTSAM accepts no group of an unknown variable."""
        for key in landmarks:
            self._seen.pop(key, None)

    def groups(
        self, frame: int, landmarks: Collection[int], *, first: int = 0, all_new: bool = False
    ) -> dict[int, int]:
        """Key -> group of elimination, for the update that brings a frame and sees some landmarks (keys), in a tree
        that has no pose before `first`.

        Every key that is not among them is in group 0, which comes first. Where all landmarks are `fresh`, the frame
        before is kept for the end as well: they may leave the system close to indeterminate, and GTSAM then names a
        landmark where it would name a pose.
        """
        seen = self._seen
        for key in landmarks:
            seen.pop(key, None)
            seen[key] = frame
        # COLAMD takes no group beyond the number of variables: the pose, its tail, the one before and what is seen.
        most = len(landmarks) + (frame > 0)
        if len(landmarks) > MANY_LANDMARKS:
            return self._with_states({pose_key(frame): 1, AUXILIARY_POSE: 2}, frame)
        if all_new:
            last, first = min(1, most), max(first, frame - 1)
            together = dict.fromkeys([*map(pose_key, range(first, frame + 1)), *landmarks], last)
            return self._with_states(together | {AUXILIARY_POSE: last + 1}, frame)
        last = min(N_GROUPS, most)
        groups = dict.fromkeys([pose_key(frame), *landmarks], last) | {AUXILIARY_POSE: last + 1}
        oldest = max(first, frame - GROUP_FRAMES * (last - 1))
        of_frame = [last - 1 - (frame - 1 - k) // GROUP_FRAMES for k in range(oldest, frame)]
        groups |= {pose_key(k): group for k, group in enumerate(of_frame, oldest)}
        for key in reversed(seen):
            if seen[key] < oldest:
                break
            if seen[key] < frame:
                groups[key] = of_frame[seen[key] - oldest]
        return self._with_states(groups, frame)

    def _with_states(self, groups: dict[int, int], newest: int) -> dict[int, int]:
        """Groups with those of velocities and biases.

        The newest state comes after all landmarks: else they were one clique with it, and its covariance far away.
        """
        if not self._inertial:
            return groups
        newest_pose, end = pose_key(newest), groups[AUXILIARY_POSE]
        states = {
            key: end if pose == newest_pose else group
            for pose, group in groups.items()
            if landmark_of(pose) is None and pose != AUXILIARY_POSE
            for key in state_keys(frame_of(pose), True)
        }
        return groups | states | {AUXILIARY_POSE: end + 1}

    def batch_groups(self, first: int, frame: int) -> dict[int, int]:
        """Key -> group of elimination, for a tree that is built at once over the frames `first` to `frame`, the last
        one that `groups` has heard of; without the landmarks that were seen before only."""
        last = 1 + (frame - first) // GROUP_FRAMES
        groups = {pose_key(k): (k - first) // GROUP_FRAMES for k in range(first, frame)} | {pose_key(frame): last}
        for key in reversed(self._seen):
            if self._seen[key] < first:
                break
            groups[key] = last if self._seen[key] == frame else (self._seen[key] - first) // GROUP_FRAMES
        return self._with_states(groups | {AUXILIARY_POSE: last + 1}, frame)
