"""ROS 1 and ROS 2 bags, read with the library rosbags (extra `fgbaseline[ros]`), message by message."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fgbaseline.geometry import InputError

from .file_errors import FilePath, shown

MAGIC = (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\0")
"""first bytes of ROS 1 bags, and of the two storage formats of ROS 2"""
METADATA = "metadata.yaml"
STORAGE = (".db3", ".mcap")
"""ends of the files of ROS 2 bags"""


def is_bag(path: Path) -> bool:
    """Whether a path is a bag: a file by its first bytes, or the folder of a ROS 2 bag."""
    if path.is_dir():
        return (path / METADATA).is_file() and any(path.glob("*.db3*")) | any(path.glob("*.mcap*"))
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(16).startswith(MAGIC)


def split_topic(path: FilePath) -> tuple[Path, str] | None:
    """Bag and topic of `run.bag:/odom`; None for another path."""
    found = re.fullmatch(r"(.+?):(/?[A-Za-z~][\w/~]*)", os.fspath(path))
    if found is None or Path(path).exists() or not is_bag(Path(found[1])):
        return None
    return Path(found[1]), found[2]


class Bag:
    """An open bag."""

    def __init__(self, reader: Any, source: str) -> None:
        self._reader = reader
        self.source = source

    @property
    def topics(self) -> dict[str, str]:
        """Message type, without `/msg`, of each topic, sorted by name."""
        return {name: str(info.msgtype).replace("/msg/", "/") for name, info in sorted(self._reader.topics.items())}

    def messages(self, topics: tuple[str, ...]) -> Iterator[tuple[str, int, Any]]:
        """Topic, stamp (ns: of the header, or of the recording where there is none) and message, in recorded order."""
        chosen = [connection for connection in self._reader.connections if connection.topic in topics]
        for connection, recorded, data in self._reader.messages(chosen):
            message = self._reader.deserialize(data, connection.msgtype)
            header = getattr(message, "header", None)
            stamp = 0 if header is None else header.stamp.sec * 10**9 + header.stamp.nanosec
            yield connection.topic, stamp or recorded, message

    def last_message(self, topic: str) -> Any | None:
        """The message of a topic that was recorded last; None without one. No other is decoded."""
        chosen = [connection for connection in self._reader.connections if connection.topic == topic]
        last = None
        for connection, _, data in self._reader.messages(chosen):
            last = data, connection.msgtype
        return None if last is None else self._reader.deserialize(*last)


@contextmanager
def open_bag_file(path: Path) -> Iterator[Bag]:
    """The bag at `path`. Raises InputError where it is empty or cannot be read, or the library is not installed."""
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f"{shown(path)}: rosbags is not installed; pip install 'fgbaseline[ros]'") from None
    store = get_typestore(Stores.ROS2_HUMBLE)
    try:
        with AnyReader([path], default_typestore=store) as reader:
            if reader.message_count == 0:
                raise InputError(f"{shown(path)}: the bag has no messages; record it again")
            yield Bag(reader, shown(path))
    except (AnyReaderError, OSError) as error:
        raise InputError(f"{shown(path)}: the bag cannot be read ({' '.join(str(error).split())[:120]})") from error
