"""What a board says of itself is believed within the limits of the firmware and the chip, and not beyond."""

import struct

import numpy as np
import pytest

from firmware_bridge import LPC1768_DTYPE, FrameType, parse_message, set_rate
from gfimu import InputError
from tests.firmware_bridge.made_frames import encode_message

GIVEN = {"rate": 100, "code": 10, "format": 11, "baud": 0, "present": 15, "cause": 1, "streaming": 1, "sensors": 4}


def identity(**changes):
    said = GIVEN | changes
    version = (9, 1, 2, 3)
    middle = (said["rate"], said["code"], said["format"], said["baud"], said["present"], said["cause"])
    payload = struct.pack("<4BHBBIBBBBIHH", *version, *middle, said["streaming"], said["sensors"], 7, 400, 0)
    packet = np.frombuffer(encode_message(FrameType.IDENTITY, 0, 0, payload), LPC1768_DTYPE)[0].copy()
    packet["status"], packet["temperature"] = 0, -(2**15)
    return parse_message(packet)


def test_an_identity_is_read():
    found = identity()
    assert (found.firmware, found.rate_hz, found.rate_code, found.streaming) == ("1.2.3", 100, 10, True)


@pytest.mark.parametrize(
    ("key", "believed", "refused"),
    [("rate", 10, 9), ("rate", 3200, 3201), ("code", 15, 16), ("streaming", 1, 2), ("sensors", 4, 5)],
)
def test_both_sides_of_each_limit(key, believed, refused):
    assert identity(**{key: believed}) is not None
    assert identity(**{key: refused}) is None


@pytest.mark.parametrize(("rate", "code"), [(9, 10), (3201, 10), (100, 16), (100, -1)])
def test_commands_beyond_the_limits_are_refused(rate, code):
    set_rate(min(max(rate, 10), 3200), min(max(code, 0), 15))
    with pytest.raises(InputError):
        set_rate(rate, code)
