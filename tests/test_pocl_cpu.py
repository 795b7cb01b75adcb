"""Naming a processor that PoCL does not know: the record's first pointer to "generic" is written, once, and nothing else."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from clrt.device import pocl_cpu
from clrt.errors import DeviceError

VERSION = "OpenCL 3.0 PoCL HSTR: pthread-x86_64-unknown-linux-gnu-"
AVX2 = {"sse4_1", "ssse3", "avx", "f16c", "avx2", "fma", "bmi1", "bmi2", "movbe"}
AVX512 = AVX2 | {"avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512cd"}
RECORD = 4096

linux_only = pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="memory is read through /proc/self/mem")


class Record:
    """A device's record: zeros but for pointers to texts, and two words that are no addresses."""

    def __init__(self, pointers: dict[int, bytes]) -> None:
        self.memory = ctypes.create_string_buffer(RECORD)
        self.texts = {offset: ctypes.create_string_buffer(text) for offset, text in pointers.items()}
        self.put(40, 0x7FFF_FFFF_F000)  # in the range of addresses, but nothing is mapped there
        self.put(48, 12)
        for offset, text in self.texts.items():
            self.put(offset, ctypes.addressof(text))

    def put(self, offset: int, word: int) -> None:
        ctypes.c_uint64.from_address(ctypes.addressof(self.memory) + offset).value = word

    def text(self, offset: int) -> bytes:
        address = ctypes.c_uint64.from_address(ctypes.addressof(self.memory) + offset).value
        return ctypes.string_at(address)

    def handle(self, cpu: str = "generic") -> SimpleNamespace:
        return SimpleNamespace(version=VERSION + cpu, driver_version="3.0-rc2 ", int_ptr=ctypes.addressof(self.memory))


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that has named no processor yet, on an x86-64 machine with AVX2."""
    monkeypatch.setattr(pocl_cpu, "_named", {})
    monkeypatch.setattr(pocl_cpu, "_cpu_flags", lambda: AVX2)
    monkeypatch.setattr(os, "uname", lambda: SimpleNamespace(machine="x86_64"))


@pytest.mark.parametrize(
    ("flags", "name"),
    [
        (AVX512 | {"avx512_bf16", "gfni"}, "skylake-avx512"),
        (AVX512 - {"avx512dq"}, "haswell"),
        (AVX2, "haswell"),
        (AVX2 - {"movbe"}, "ivybridge"),
        ({"avx", "fma4", "f16c", "sse4_1"}, "bdver1"),
        ({"avx", "sse4_1", "ssse3"}, "sandybridge"),
        ({"sse4_1", "ssse3"}, "penryn"),
        ({"ssse3"}, "core2"),
        ({"sse2"}, "x86-64"),
        (set(), "x86-64"),
    ],
)
def test_processor_name_has_no_instruction_set_beyond_the_flags(flags: set[str], name: str) -> None:
    assert pocl_cpu.processor_name(flags) == name


def test_cpu_flags_are_those_of_the_first_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    text = "processor\t: 0\nflags\t\t: fpu avx2 fma\nbugs\t\t: spectre\n\nprocessor\t: 1\nflags\t\t: fpu\n"
    monkeypatch.setattr(Path, "read_text", lambda self: text)
    assert pocl_cpu._cpu_flags() == {"fpu", "avx2", "fma"}


@linux_only
def test_the_one_slot_is_given_the_name_and_nothing_else_changes() -> None:
    record = Record({200: b"generic", 208: b"pthread", 640: b"generic-but-longer"})
    before = record.memory.raw
    assert pocl_cpu.name_processor(record.handle()) == "haswell"
    assert record.text(200) == b"haswell"
    assert [i for i in range(RECORD) if record.memory.raw[i] != before[i] and not 200 <= i < 208] == []
    assert record.texts[200].value == b"generic", "PoCL's own text may be shared with others"


@linux_only
def test_a_second_device_of_the_process_is_named_too() -> None:
    first, second = Record({200: b"generic"}), Record({312: b"generic"})
    assert pocl_cpu.name_processor(first.handle()) == pocl_cpu.name_processor(second.handle()) == "haswell"
    assert (first.text(200), second.text(312)) == (b"haswell", b"haswell")
    # The version that PoCL reports stays as it is; a device opened again needs nothing.
    assert pocl_cpu.name_processor(first.handle()) is None


@linux_only
def test_a_pointer_behind_the_first_is_left_alone_even_when_opened_again() -> None:
    """It belongs to something else: a freed record, or an object of the compiler's that would free our text."""
    record = Record({200: b"generic", 1208: b"generic"})
    assert pocl_cpu.name_processor(record.handle()) == "haswell"
    assert pocl_cpu.name_processor(record.handle()) is None
    assert (record.text(200), record.text(1208)) == (b"haswell", b"generic")


@linux_only
@pytest.mark.parametrize("pointers", [{}, {200: b"haswell"}, {RECORD - 64: b"generic"}], ids=["none", "another name", "far behind"])
def test_nothing_is_written_where_no_slot_is_found(pointers: dict[int, bytes]) -> None:
    record = Record(pointers)
    before = record.memory.raw
    with pytest.raises(DeviceError, match=r"PoCL \(3\.0-rc2\) does not know this processor.*newer PoCL.*intel-opencl-rt"):
        pocl_cpu.name_processor(record.handle())
    assert record.memory.raw == before


@linux_only
def test_a_record_that_cannot_be_read_is_an_error_not_a_fault() -> None:
    handle = SimpleNamespace(version=VERSION + "generic", driver_version="3.0", int_ptr=4096)
    with pytest.raises(DeviceError, match="cannot be told its name"):
        pocl_cpu.name_processor(handle)


@pytest.mark.parametrize("version", [VERSION + "skylake-avx512", VERSION + "znver3", "OpenCL 3.1 (Build 0)"])
def test_devices_that_know_their_processor_are_untouched(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pocl_cpu, "_slots_of_unknown", _unreachable)
    assert pocl_cpu.name_processor(SimpleNamespace(version=version, driver_version="3.1", int_ptr=0)) is None


def test_other_machines_are_untouched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "uname", lambda: SimpleNamespace(machine="aarch64"))
    monkeypatch.setattr(pocl_cpu, "_slots_of_unknown", _unreachable)
    assert pocl_cpu.name_processor(SimpleNamespace(version=VERSION + "generic", driver_version="3.0", int_ptr=0)) is None


def _unreachable(record: int) -> list[int]:
    raise AssertionError("the record was read")
