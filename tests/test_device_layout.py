"""Structs have the same size and offsets in NumPy and on the device."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest

from clrt.device import layout, program
from clrt.device.context import Device
from clrt.features import REAL


def _offsets_on_device(device: Device, name: str, dtype: np.dtype[np.void]) -> list[int]:
    members = dtype.names or ()
    lines = [f"out[{i}] = (int)((size_t)&one.{m} - (size_t)&one);" for i, m in enumerate(members)]
    body = f"{name} one; {' '.join(lines)} out[{len(members)}] = sizeof({name});"
    source = layout.c_struct(name, dtype) + f"kernel void f(global int *out) {{ {body} }}"
    built = program.build(device, source)
    out = np.zeros(len(members) + 1, np.int32)
    buffer = cl.Buffer(device.context, cl.mem_flags.WRITE_ONLY, out.nbytes)
    cl.Kernel(built, "f")(device.queue, (1,), (1,), buffer)
    cl.enqueue_copy(device.queue, out, buffer)
    return out.tolist()


@pytest.mark.parametrize("real", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("Triangle", layout.triangle),
        ("EdgePlanes", layout.edge_planes),
        ("Object", layout.object_record),
        ("Surface", layout.surface),
        ("Light", layout.light),
        ("Light", lambda real: layout.light(real, [("axis", real, (3,)), ("edge", real)])),
        ("Sun", layout.sun),
        ("Sphere", layout.sphere),
        ("Material", lambda real: layout.material(real, [("reflect", real)])),
        ("Frame", lambda real: layout.frame(real, [("light_count", np.int32)])),
    ],
)
def test_struct_layout_matches_device(device: Device, name: str, make: object, real: type) -> None:
    dtype = make(real)  # type: ignore[operator]
    expected = [dtype.fields[m][1] for m in dtype.names] + [dtype.itemsize]
    assert _offsets_on_device(device, name, dtype) == expected


def test_float32_triangle_records_fill_a_cache_line() -> None:
    assert layout.triangle(np.float32).itemsize == 64
    assert layout.edge_planes(np.float32).itemsize == 64


def test_real_is_a_placeholder_not_a_type() -> None:
    with pytest.raises(TypeError):
        np.dtype(REAL)
