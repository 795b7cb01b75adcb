"""What tests share: the device, and the real scenes where they are present."""

from __future__ import annotations

from pathlib import Path

import pytest

from clrt.device.context import Device, open_device

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def device() -> Device:
    """The default OpenCL device."""
    return open_device()


@pytest.fixture(scope="session")
def shared_scene() -> object:
    """A function: name -> path of a real scene; the test is skipped where it is not there."""

    def path(name: str) -> Path:
        found = SHARED / "scenes" / name
        if not found.exists():
            pytest.skip(f"{name} is not beside the checkout")
        return found

    return path
