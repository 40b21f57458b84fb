"""Elimination ordering of an iSAM2 update: constrained COLAMD with groups by the age of the last observation.

Unconstrained COLAMD may cut the chain of poses in the middle. Variables eliminated last stay near the root, where
every update visits them again: after 900 simulated frames, poses 30 s old were there, in cliques of 500 columns.
Groups by age eliminate the oldest first; COLAMD orders within a group. The solution is unchanged.
"""

from collections.abc import Collection, Sequence

from ..graph.keys import AUXILIARY_POSE, state_keys

GROUP_FRAMES, N_GROUPS = 20, 6
"""Frames of a group, and number of groups beside the last one; older variables are in the first group. Longer groups
leave the order to COLAMD, more groups cost a call per key. An update seldom reaches back further than the length of a
track, a few dozen frames."""
MANY_LANDMARKS = 200
"""Landmarks of a frame above which they are eliminated before its pose. Otherwise all that a frame observes is
eliminated last, which makes the next update cheapest as long as there are few dense columns."""


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
        """Elimination group by key, for the update by a frame that observes landmarks (keys), in a tree without poses
        before `first`.

        Keys that are not listed are in group 0, which is eliminated first. If the landmarks are `all_new`, the frame
        before is eliminated last as well: the system may be close to indeterminate, and GTSAM then names a landmark
        instead of a pose.
        """
        seen = self._seen
        for key in landmarks:
            seen.pop(key, None)
            seen[key] = frame
        # COLAMD takes no group above the number of variables: two poses, the auxiliary pose and the landmarks.
        most = len(landmarks) + (frame > 0)
        if len(landmarks) > MANY_LANDMARKS:
            return self._with_states({}, [frame], [1])
        if all_new:
            last, first = min(1, most), max(first, frame - 1)
            frames = range(first, frame + 1)
            return self._with_states(dict.fromkeys(landmarks, last), frames, [last] * len(frames))
        last, age = min(N_GROUPS, most), (frame - 1) // GROUP_FRAMES
        oldest = max(first, GROUP_FRAMES * (age - last + 2))
        of_frame = [last - 1 - age + k // GROUP_FRAMES for k in range(oldest, frame)]
        groups = dict[int, int]()
        for key, last_seen in reversed(seen.items()):
            if last_seen < oldest:
                break
            if last_seen < frame:
                groups[key] = of_frame[last_seen - oldest]
        groups |= dict.fromkeys(landmarks, last)
        return self._with_states(groups, [*range(oldest, frame), frame], [*of_frame, last])

    def _with_states(self, landmarks: dict[int, int], frames: Sequence[int], of_frame: Sequence[int]) -> dict[int, int]:
        """Groups of landmarks and of the states of frames, in temporal order, with the newest state in the last group.

        With raw inertial data the newest state is eliminated after all landmarks. Otherwise they would be in one clique
        with it, and its covariance would be expensive.
        """
        end = of_frame[-1] + 1
        groups = landmarks | {
            key: group for k, group in zip(frames, of_frame, strict=True) for key in state_keys(k, self._inertial)
        }
        if self._inertial:
            groups |= dict.fromkeys(state_keys(frames[-1], True), end)
            end += 1
        groups[AUXILIARY_POSE] = end
        return groups

    def older(self, first: int, frame: int) -> list[int]:
        """Variables of the frames from `first` to before `frame`, and landmarks observed last in these."""
        keys = [key for k in range(first, frame) for key in state_keys(k, self._inertial)]
        for key in reversed(self._seen):
            if self._seen[key] < first:
                break
            if self._seen[key] < frame:
                keys.append(key)
        return keys

    def batch_groups(self, first: int, frame: int) -> dict[int, int]:
        """Elimination group by key, for a tree built at once over the frames `first` to `frame`, the latest frame of
        `groups`.

        Landmarks observed only before `first` are left out.
        """
        last = 1 + (frame - first) // GROUP_FRAMES
        groups = dict[int, int]()
        for key in reversed(self._seen):
            if self._seen[key] < first:
                break
            groups[key] = last if self._seen[key] == frame else (self._seen[key] - first) // GROUP_FRAMES
        of_frame = [(k - first) // GROUP_FRAMES for k in range(first, frame)]
        return self._with_states(groups, range(first, frame + 1), [*of_frame, last])
