"""Files of other kinds in place of a table of numbers, recognized by how they begin."""

import re

from fgbaseline.geometry import InputError

TABLE = "write a line of t x y z qx qy qz qw for each pose"
BAG = "it is a bag or a database, not one trajectory; name a topic of the bag, as in run.bag:/odom"
KINDS = (
    (rb"\x93NUMPY", "it is a NumPy array without names; write an npz with t and world_T_body"),
    (rb"#ROSBAG V|\x89MCAP0|SQLite format 3\0", BAG),
    (rb"\x80[\x02-\x05]", f"it is a pickle, which is not opened, since it can run programs; {TABLE}"),
    (rb"\x89HDF|MATLAB 5\.0", f"it is a MATLAB or HDF5 file; {TABLE}"),
    (rb"\s*(\{|\[\s*[\[{\"])", f"it is JSON; {TABLE}"),
    (rb"(?i)\s*<(!doctype|html|\?xml|kml|gpx|svg)", "it is HTML or XML; check that it is the right file"),
    (rb"version https://git-lfs", "it is a pointer of Git LFS; get the file itself with `git lfs pull`"),
    (rb"(#.*\n)*(VERTEX|EDGE)_?S?E?[23]?\b", f"it is a pose graph (g2o), which has no time stamps; {TABLE}"),
    (
        rb"# (Image|Camera) list with",
        f"it is a COLMAP file of world-to-camera poses without times; {TABLE}",
    ),
    (rb"# ?\.PCD|ply\r?\n", "it is a point cloud; check that it is the right file"),
)
"""first bytes, as a regular expression, and the cause of the refusal"""


def require_table(content: bytes) -> None:
    """Raises InputError for content that begins as a file of another kind."""
    for begins, cause in KINDS:
        if re.match(begins, content[:4096]):
            raise InputError(cause)
