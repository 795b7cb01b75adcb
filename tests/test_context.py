"""Choosing a device: which is the default, which a name means, what is said where there is none."""

from __future__ import annotations

from types import SimpleNamespace

import pyopencl as cl
import pytest

from clrt.device import context, pocl_cpu
from clrt.errors import DeviceError

POCL, INTEL, CUDA = "Portable Computing Language", "Intel(R) OpenCL", "NVIDIA CUDA"


def _platform(name: str, *devices: SimpleNamespace) -> SimpleNamespace:
    platform = SimpleNamespace(name=name, get_devices=lambda: list(devices))
    for device in devices:
        device.platform = platform
    return platform


def _device(name: str, *, kind: int = cl.device_type.CPU, lanes: int = 8, extensions: str = "cl_khr_fp64 cl_khr_icd") -> SimpleNamespace:
    return SimpleNamespace(
        name=f" {name} ", type=kind, version="OpenCL 3.0 ", driver_version="1.2 ", max_compute_units=2, native_vector_width_float=lanes,
        extensions=extensions, global_mem_size=1 << 30,
    )  # fmt: skip


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> list[SimpleNamespace]:
    """Three platforms in an order that is not the one wanted; contexts and queues are not opened. Gives PoCL devices asked about."""
    asked: list[SimpleNamespace] = []
    platforms = [
        _platform(CUDA, _device("RTX", kind=cl.device_type.GPU)),
        _platform(INTEL, _device("Xeon Gold", lanes=16)),
        _platform(POCL, _device("pthread-Intel Xeon Gold")),
    ]
    monkeypatch.setattr(cl, "get_platforms", lambda: platforms)
    monkeypatch.setattr(cl, "Context", lambda devices: ("context", devices))
    monkeypatch.setattr(cl, "CommandQueue", lambda opened: ("queue", opened))
    monkeypatch.setattr(pocl_cpu, "name_processor", asked.append)
    return asked


def test_devices_are_listed_with_the_default_first(machine: list[SimpleNamespace]) -> None:
    found = context.list_devices()
    assert [(d.name, d.platform, d.default) for d in found] == [
        ("pthread-Intel Xeon Gold", POCL, True),
        ("Xeon Gold", INTEL, False),
        ("RTX", CUDA, False),
    ]
    assert found[1] == context.DeviceInfo("Xeon Gold", INTEL, "OpenCL 3.0", "1.2", 2, 16, True, 1 << 30, False)


@pytest.mark.parametrize(
    ("name", "platform"),
    [
        (None, POCL), ("", POCL), ("pthread", POCL), ("PORTABLE", POCL), ("rtx", CUDA), ("cuda", CUDA), ("xeon", POCL),
        # Of two devices that are the same processor, the platform's name tells which is meant.
        ("intel", INTEL), ("Intel(R) OpenCL", INTEL),
    ],
)  # fmt: skip
def test_name_chooses_a_device(machine: list[SimpleNamespace], name: str | None, platform: str) -> None:
    opened = context.open_device(name)
    assert opened.info.platform == opened.handle.platform.name == platform
    assert opened.context == ("context", [opened.handle])
    assert opened.queue == ("queue", opened.context)
    assert opened.info.default == (platform == POCL)


def test_only_pocl_is_told_the_processor(machine: list[SimpleNamespace]) -> None:
    context.open_device("cuda")
    context.open_device("intel")
    assert machine == []
    pocl = context.open_device().handle
    assert machine == [pocl]


def test_unknown_name_lists_what_there_is(machine: list[SimpleNamespace]) -> None:
    with pytest.raises(DeviceError) as error:
        context.open_device("radeon")
    assert str(error.value) == (
        f"no OpenCL device is called 'radeon'; there is: 'pthread-Intel Xeon Gold' ({POCL}); 'Xeon Gold' ({INTEL}); 'RTX' ({CUDA})"
    )


def test_device_without_float64_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cl, "get_platforms", lambda: [_platform("Small", _device("Tiny", extensions="cl_khr_icd"))])
    assert not context.list_devices()[0].fp64
    with pytest.raises(DeviceError, match="'Tiny' has no float64"):
        context.open_device()


def _no_loader() -> list[SimpleNamespace]:
    raise cl.LogicError("clGetPlatformIDs failed: PLATFORM_NOT_FOUND_KHR")


def _broken() -> list[SimpleNamespace]:
    raise cl.RuntimeError("clGetDeviceIDs failed: DEVICE_NOT_FOUND")


@pytest.mark.parametrize(
    "platforms", [_no_loader, list, lambda: [SimpleNamespace(name="Empty", get_devices=_broken)]], ids=["error", "none", "no device"]
)
def test_no_platform_names_the_command_that_installs_one(monkeypatch: pytest.MonkeyPatch, platforms: object) -> None:
    monkeypatch.setattr(cl, "get_platforms", platforms)
    for ask in (context.list_devices, context.open_device):
        with pytest.raises(DeviceError, match=r"pip install 'pyopencl\[pocl\]'"):
            ask()


def test_a_platform_without_devices_hides_no_other(machine: list[SimpleNamespace], monkeypatch: pytest.MonkeyPatch) -> None:
    there = cl.get_platforms()
    monkeypatch.setattr(cl, "get_platforms", lambda: [SimpleNamespace(name="Empty", get_devices=_broken), *there])
    assert len(context.list_devices()) == 3


@pytest.mark.parametrize(("width", "lanes"), [(64, 16), (16, 16), (15, 8), (8, 8), (4, 4), (2, 1), (1, 1), (0, 1)])
def test_lanes_are_the_widest_packet_that_fits(width: int, lanes: int) -> None:
    assert context.lanes_of(width) == lanes


def test_real_devices_can_be_opened_by_their_names() -> None:
    for info in context.list_devices():
        opened = context.open_device(info.platform)
        assert opened.info.platform == info.platform
        assert opened.info.lanes in (16, 8, 4, 1)
        assert opened.queue.device == opened.handle
