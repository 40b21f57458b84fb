"""Folders of rendered images; a module that uses them has a fixture `room` of its own length."""

import shutil
from pathlib import Path

import pytest

from ..builders.rendered import Room


@pytest.fixture(scope="module")
def written(room: Room, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return room.write_euroc(tmp_path_factory.mktemp("room") / "room_01")


@pytest.fixture
def euroc(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "room_01"))
