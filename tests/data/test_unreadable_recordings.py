"""`read` on what is no recording at all: always one InputError that names the file."""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fgbaseline.data.formats import read
from fgbaseline.geometry import InputError

NO_RECORDINGS = {
    "empty": (b"", "the file is empty"),
    "text": (b"1 2 3\n", "this is a text file and no recording"),
    "random": (b"\xfe\xff\x00\x01", "this is not a recording .*fe ff 00 01"),
    "hdf5": (b"\x89HDF\r\n\x1a\n" + bytes(100), "this is an HDF5 file"),
    "single array": (b"\x93NUMPY\x01\x00" + bytes(70), "this is a single array"),
    "empty zip": (b"PK\x05\x06" + bytes(18), "this archive is not a recording; .* found nothing"),
    "zip magic only": (b"PK\x03\x04", "zip directory: the file is damaged"),
    "matlab 7.3": (b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384) + b"\x89HDF\r\n\x1a\n", "MATLAB 7.3"),
    "matlab header only": (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM", "not a UTIAS recording; .* nothing"),
}


@pytest.mark.parametrize("case", NO_RECORDINGS)
def test_files_that_are_no_recording(tmp_path, case):
    content, sentence = NO_RECORDINGS[case]
    path = tmp_path / "some.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=sentence) as raised:
        read(path)
    assert str(raised.value).startswith(str(path))


def test_places_that_are_no_file(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read(tmp_path / "missing.npz")
    with pytest.raises(InputError, match="this is a folder"):
        read(tmp_path)
    with pytest.raises(InputError, match=r"there can be no file|there is no such file"):
        read(str(tmp_path) + "/a\0b")
    with pytest.raises(InputError):
        read(tmp_path / ("x" * 5000))
    with pytest.raises(InputError, match=r"a\\nb: there is no such file"):
        read(tmp_path / "a\nb")
    with pytest.raises(InputError) as raised:
        read(str(tmp_path) + "/\udcff.npz")
    str(raised.value).encode("utf-8")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="not an ordinary file"):
        read(tmp_path / "pipe")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path):
    path = tmp_path / "secret.npz"
    path.write_bytes(b"PK")
    path.chmod(0)
    with pytest.raises(InputError, match="cannot be read"):
        read(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from([b"", b"PK\x03\x04", b"MATLAB 5.0".ljust(126) + b"IM"]), st.binary(max_size=300))
def test_arbitrary_bytes(tmp_path, magic, content):
    path = tmp_path / "bytes"
    path.write_bytes(magic + content)
    with pytest.raises(InputError):
        read(path)


def test_the_format_is_detected_from_the_content(tmp_path, course_arrays):
    path = tmp_path / "recording.mat"
    with path.open("wb") as file:
        np.savez(file, **course_arrays)
    sequence = read(path)
    assert (sequence.form, sequence.name) == ("course", "recording")
    assert read(str(path)).source == str(path)
