"""The same trajectory as other programs write it: every format and variant that `compare` is to recognize."""

import gzip
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fgbaseline.geometry import FloatArray, so3

PER_SECOND = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}
EUROC = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
STATES = ",".join(f"{name}_{axis}" for name in ("v_RS_R", "b_w_RS_S", "b_a_RS_S") for axis in "xyz")
OKVIS = "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x, v_WS_W_y, v_WS_W_z"
ROSTOPIC = (
    "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
    + ",".join(f"field.pose.pose.position.{axis}" for axis in "xyz")
    + ","
    + ",".join(f"field.pose.pose.orientation.{axis}" for axis in "xyzw")
    + ","
    + ",".join(f"field.pose.covariance{k}" for k in range(36))
)
OPENVINS = "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33"

OPENVINS_STATE = "# timestamp(s) q p v bg ba cam_imu_dt num_cam cam0_k cam0_d cam0_rot cam0_trans ... etc"


@dataclass(frozen=True)
class Path3D:
    """Stamps in whole nanoseconds and poses."""

    ns: tuple[int, ...]
    poses: FloatArray

    @property
    def t(self) -> FloatArray:
        """Seconds."""
        return np.array([stamp / 10**9 for stamp in self.ns])

    def stamps(self, unit: str) -> list[str]:
        """Whole numbers, of seconds with nine decimals."""
        if unit == "s":
            return [f"{stamp // 10**9}.{stamp % 10**9:09d}" for stamp in self.ns]
        return [str(stamp * PER_SECOND[unit] // 10**9) for stamp in self.ns]

    def numbers(self, order: str = "xyzw") -> list[list[str]]:
        """Position and quaternion of each pose."""
        xyzw = so3.quaternion_xyzw(self.poses[:, :3, :3])
        q = xyzw if order == "xyzw" else np.roll(xyzw, 1, axis=1)
        return [[repr(x) for x in row] for row in np.concatenate([self.poses[:, :3, 3], q], axis=1).tolist()]


def rows(stamps: Sequence[str], numbers: Sequence[Sequence[str]], separator: str = " ", end: str = "") -> str:
    """Lines of stamps and numbers."""
    lines = [separator.join([stamp, *row]) + end for stamp, row in zip(stamps, numbers, strict=True)]
    return "\n".join([*lines, ""])


def with_more(numbers: Sequence[Sequence[str]], more: Sequence[str]) -> list[list[str]]:
    """Each row with the same words behind."""
    return [[*row, *more] for row in numbers]


@dataclass(frozen=True)
class Variant:
    """How a file is written, and what has to be asked of `compare` to read it."""

    write: Callable[[Path3D], bytes]
    options: dict[str, object] = field(default_factory=dict)
    oriented: bool = True
    suffix: str = ".txt"


def text(write: Callable[[Path3D], str], **kinds: object) -> Variant:
    """A variant that is plain text."""
    return Variant(lambda path: write(path).encode(), **kinds)  # type: ignore[arg-type]


def tum(path: Path3D, unit: str = "s", order: str = "xyzw", separator: str = " ") -> str:
    """TUM's layout without a header."""
    return rows(path.stamps(unit), path.numbers(order), separator)


def kitti(path: Path3D) -> list[list[str]]:
    """The twelve numbers of each pose."""
    return [[repr(x) for x in row] for row in path.poses[:, :3].reshape(-1, 12).tolist()]


def with_nan(path: Path3D) -> str:
    """Lines of NaN between the poses."""
    lines = tum(path).splitlines()
    middle = f"{(path.ns[1] + path.ns[0]) / 2e9:.9f} nan nan nan nan nan nan nan"
    return "\n".join([lines[0], middle, *lines[1:]])


def with_empty_cells(path: Path3D) -> str:
    """CSV of pandas with empty cells in place of NaN, between the poses and in the first line."""
    lines = tum(path, separator=",").splitlines()
    lost = [f"{s}.5,,,,,,," for s in (path.ns[0] // 10**9 - 2, path.ns[-1] // 10**9 + 2)]
    return "\n".join(["t,x,y,z,qx,qy,qz,qw", lost[0], *lines, lost[1], ""])


def repeating(path: Path3D) -> str:
    """One stamp twice, with another pose."""
    lines = tum(path).splitlines()
    stamp, *rest = lines[1].split()
    return "\n".join([*lines[:2], " ".join([stamp, "99", *rest[1:]]), *lines[2:], ""])


def frames(path: Path3D) -> str:
    """KITTI with the number of the frame before each pose."""
    return rows([str(k) for k in range(len(path.ns))], kitti(path))


VARIANTS: dict[str, Variant] = {
    **{f"TUM in {unit}": text(lambda path, unit=unit: tum(path, unit)) for unit in PER_SECOND},
    "TUM, stamps of doubles in ns": text(lambda p: rows([f"{s}.000000" for s in p.stamps("ns")], p.numbers())),
    "TUM with its header": text(lambda p: "# timestamp tx ty tz qx qy qz qw\n" + tum(p)),
    "TUM, w first": text(lambda p: tum(p, order="wxyz")),
    "TUM, w first, by the option": text(lambda p: tum(p, order="wxyz"), options={"quaternion": "wxyz"}),
    "TUM, several blanks and tabs": text(lambda p: tum(p, separator=" \t  ")),
    "TUM between commas": text(lambda p: tum(p, separator=",")),
    "TUM between semicolons": text(lambda p: tum(p, separator=" ; ")),
    "TUM, UTF-16": Variant(lambda p: tum(p).encode("utf-16")),
    "TUM, UTF-16 without its mark": Variant(lambda p: tum(p).encode("utf-16-le")),
    "TUM, UTF-8 with a mark, lines of Windows": Variant(lambda p: tum(p).replace("\n", "\r\n").encode("utf-8-sig")),
    "TUM, packed": Variant(lambda p: gzip.compress(tum(p).encode()), suffix=".txt.gz"),
    "TUM, lines of NaN": text(with_nan),
    "TUM, a stamp twice": text(repeating),
    "TUM with ROS covariances": text(lambda p: rows(p.stamps("s"), with_more(p.numbers(), ["0.01"] * 36))),
    "OpenVINS": text(lambda p: f"{OPENVINS}\n" + rows(p.stamps("s"), with_more(p.numbers(), ["0.01"] * 12))),
    "state file of OpenVINS": text(
        lambda p: (
            f"{OPENVINS_STATE}\n"
            + rows(p.stamps("s"), [[*n[3:], *n[:3], *["0.1"] * 9, "0.0", "2"] for n in p.numbers()])
        )
    ),
    "EuRoC": text(lambda p: f"{EUROC}\n" + rows(p.stamps("ns"), p.numbers("wxyz"), ",")),
    "EuRoC states": text(
        lambda p: f"{EUROC},{STATES}\n" + rows(p.stamps("ns"), with_more(p.numbers("wxyz"), ["0.1"] * 9), ",")
    ),
    "EuRoC without a header": text(lambda p: rows(p.stamps("ns"), p.numbers("wxyz"), ",")),
    "EuRoC with q_x q_y q_z q_w": text(
        lambda p: "timestamp,p_x,p_y,p_z,q_x,q_y,q_z,q_w\n" + rows(p.stamps("ns"), p.numbers(), ",")
    ),
    "whole stamps, x y z w between commas": text(lambda p: rows(p.stamps("ns"), p.numbers(), ",")),
    "VINS-Fusion": text(lambda p: rows(p.stamps("ns"), with_more(p.numbers("wxyz"), ["0.1"] * 3), ",", ",")),
    "OKVIS2": text(lambda p: f"{OKVIS}\n" + rows(p.stamps("ns"), with_more(p.numbers(), ["0.1"] * 3), ", ")),
    "OKVIS2 without a header": text(lambda p: rows(p.stamps("ns"), with_more(p.numbers(), ["0.1"] * 9), ", ")),
    "with an index": text(
        lambda p: (
            ",t,x,y,z,qx,qy,qz,qw\n"
            + rows(
                [str(k) for k in range(len(p.ns))],
                [[s, *n] for s, n in zip(p.stamps("s"), p.numbers(), strict=True)],
                ",",
            )
        )
    ),
    "4Seasons": text(
        lambda p: (
            "# frame_id, translation_x, translation_y, translation_z, quaternion_x, quaternion_y, quaternion_z, "
            + "quaternion_w, scale\n"
            + rows(p.stamps("ns"), with_more(p.numbers(), ["1.0"]), ",")
        )
    ),
    "ZED": text(lambda p: "timestamp,tx,ty,tz,ox,oy,oz,ow\n" + rows(p.stamps("ns"), p.numbers(), ",")),
    "mm in the header": text(
        lambda p: (
            "timestamp [ns],x [mm],y [mm],z [mm],qx,qy,qz,qw\n"
            + rows(p.stamps("ns"), [[*(repr(1e3 * float(x)) for x in n[:3]), *n[3:]] for n in p.numbers()], ",")
        )
    ),
    "stamps before matrices": text(lambda p: rows(p.stamps("ns"), kitti(p), ",")),
    "lost frames of pandas": text(with_empty_cells),
    "lost frames of Python": text(lambda p: with_empty_cells(p).replace(",,,,,,,", ",None" * 7)),
    "rostopic": text(
        lambda p: (
            f"{ROSTOPIC}\n"
            + rows(
                [str(stamp + 7) for stamp in p.ns],
                [["3", s, "world", *n, *["0.01"] * 36] for s, n in zip(p.stamps("ns"), p.numbers(), strict=True)],
                ",",
            )
        )
    ),
    "bagpy": text(
        lambda p: (
            "Time,header.stamp.secs,header.stamp.nsecs,header.frame_id,"
            + "pose.position.x,pose.position.y,pose.position.z,"
            + "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w\n"
            + rows(
                [f"{stamp / 1e9 + 5.0:.6f}" for stamp in p.ns],
                [[str(s // 10**9), str(s % 10**9), "odom", *n] for s, n in zip(p.ns, p.numbers(), strict=True)],
                ",",
            )
        )
    ),
    "positions": text(lambda p: rows(p.stamps("s"), [n[:3] for n in p.numbers()]), oriented=False),
    "zero quaternions": text(
        lambda p: rows(p.stamps("s"), [[*n[:3], "0", "0", "0", "0"] for n in p.numbers()]), oriented=False
    ),
    "constant quaternions": text(
        lambda p: rows(p.stamps("s"), [[*n[:3], "0", "0", "0", "1"] for n in p.numbers()]), oriented=False
    ),
    "NaN quaternions": text(
        lambda p: rows(p.stamps("s"), [[*n[:3], *["nan"] * 4] for n in p.numbers()]), oriented=False
    ),
    "EuRoC's leica0": text(
        lambda p: EUROC[: EUROC.index(",q_")] + "\n" + rows(p.stamps("ns"), [n[:3] for n in p.numbers()], ","),
        oriented=False,
    ),
}
