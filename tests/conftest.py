"""What tests share: the device, and the real scenes where they are present."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import pytest

from clrt.device.context import Device, open_device

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `matrix(keep=k)`, which goes through many programs, k cases spread over all are quick, the others slow."""
    cases = defaultdict[tuple[Path, str], list[pytest.Item]](list)
    for item in items:
        if item.get_closest_marker("matrix"):
            cases[item.path, getattr(item, "originalname", item.name)].append(item)
    for group in cases.values():
        mark = group[0].get_closest_marker("matrix")
        assert mark is not None
        quick = {i * len(group) // mark.kwargs["keep"] for i in range(mark.kwargs["keep"])}
        for place in set(range(len(group))) - quick:
            group[place].add_marker(pytest.mark.slow)


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
