"""The bus from Python: only whole messages of the right type are decoded."""

from __future__ import annotations

import pytest
from leeway_lcm import leeway as wire

from leeway import bus


@pytest.mark.parametrize(
    "kind", [wire.joint_state_t, wire.joint_command_t, wire.obstacles_t, wire.status_t]
)
def test_only_whole_messages_are_decoded(kind: type) -> None:
    data = kind().encode()
    assert bus.decode(kind, data).encode() == data
    for short in range(len(data)):
        assert bus.decode(kind, data[:short]) is None
    assert bus.decode(kind, data + b"\0") is None
    assert bus.decode(kind, bytes(8) + data[8:]) is None


def test_the_address_of_a_bus() -> None:
    assert bus.address("udpm://239.1.2.3:7000?ttl=0") == ("239.1.2.3", 7000)
    for url in ("", "udpm://10.0.0.1:7000", "udpm://239.1.2.3:0", "udpm://239.1.2.3:65536", "x"):
        with pytest.raises(bus.BusError, match="expected udpm"):
            bus.address(url)
