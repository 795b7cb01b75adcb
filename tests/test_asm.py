"""The compiled traversal calls no function, and the reader of disassemblies counts what stands there."""

from __future__ import annotations

import platform
from pathlib import Path

import pytest

from clrt.bench import asm, disassembly
from clrt.bench.disassembly import functions, inner_loops
from clrt.device.context import POCL, list_devices
from clrt.errors import ClrtError
from clrt.generate import make

#: an inner loop (two blocks, one of them left for a rare call) inside an outer one, as GNU's objdump prints it
GNU = """
render.so:     file format elf64-x86-64

0000000000001000 <walk>:
walk():
/tmp/x/kdtree.cl:7
    1000:	push   %rbx
    1001:	vmovaps %zmm1,0x40(%rsp)
    1009:	vmovaps 0x40(%rsp),%zmm2        # 4060 <somewhere>
/tmp/x/kdtree.cl:9 (discriminator 2)
    1011:	vfmadd213ps 0x80(%rsp,%rsi,1),%zmm5,%zmm3
    1019:	vextractf64x4 $0x1,%zmm3,%ymm4
    1020:	jne    1040 <walk+0x40>
    1022:	jmp    1011 <walk+0x11>
    1040:	call   2000 <seldom>
    1045:	jmp    1011 <walk+0x11>
    1050:	ret

0000000000002000 <seldom>:
    2000:	call   1010 <memcpy@plt>
    2005:	ret
"""
LLVM = """
0000000000001000 <walk>:
; walk():
; /tmp/x/kdtree.cl:9
    1011:     \tvaddps\t0x80(%rsp), %zmm5, %zmm3
    1020:     \tjne\t0x1011 <walk+0x11>
    1022:     \tcallq\t0x1010 <memcpy@plt>
    1050:     \tretq
"""


def test_instructions_have_the_lines_they_come_from() -> None:
    walk = functions(GNU)["walk"]
    assert [(i.file, i.line) for i in walk[:4]] == [("kdtree.cl", 7)] * 3 + [("kdtree.cl", 9)]
    assert [i.target for i in walk if i.target is not None] == [0x1040, 0x1011, 0x1011]


def test_fixed_places_on_the_stack_are_spills_and_arrays_are_none() -> None:
    walk = functions(GNU)["walk"]
    assert [i.spill for i in walk[:5]] == [None, "store", "load", None, None]
    assert [i.reduces for i in walk[:5]] == [False] * 4 + [True]


def test_blocks_that_only_call_a_rare_function_are_no_part_of_a_loop() -> None:
    walk = functions(GNU)["walk"]
    (whole,), (without,) = inner_loops("walk", walk), inner_loops("walk", walk, {"seldom"})
    assert whole.calls == ["seldom"]
    assert without.calls == []
    assert [i.address for i in without.body] == [0x1011, 0x1019, 0x1020, 0x1022]


def test_a_loop_around_another_is_left_out() -> None:
    text = "0000000000000000 <f>:\n 1:\tnop\n 2:\tnop\n 3:\tjne 2 <f+2>\n 4:\tjne 1 <f+1>\n 5:\tret\n"
    (loop,) = inner_loops("f", functions(text)["f"])
    assert [i.address for i in loop.body] == [2, 3]


def test_what_llvm_prints_is_read_the_same() -> None:
    walk = functions(LLVM)["walk"]
    assert [i.called for i in walk] == [None, None, "memcpy", None]
    assert walk[0].spill == "load"
    assert len(inner_loops("walk", walk)) == 1


def test_without_a_disassembler_one_is_asked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ClrtError, match="install binutils"):
        disassembly.disassemble(tmp_path / "render.so")


@pytest.mark.skipif(disassembly.disassembler() is None, reason="no disassembler (objdump, llvm-objdump) is installed")
@pytest.mark.skipif(platform.machine() != "x86_64", reason="instructions of x86-64 alone are read")
@pytest.mark.parametrize(
    ("precision", "rare"),
    [
        pytest.param("fast", set(), marks=pytest.mark.slow),
        ("watertight", {"triangle_grazing"}),
        ("exact", {"triangle_unsure", "group_decide"}),
    ],
)
def test_traversal_calls_no_function(precision: str, rare: set[str], tmp_path: Path) -> None:
    if all(device.platform != POCL for device in list_devices()):
        pytest.skip("only PoCL leaves compiled kernels behind")
    scene = tmp_path / "scene.txt"
    make("rabbit-like", scene, 1000, seed=1)
    code = disassembly.functions(disassembly.disassemble(asm.leave_kernel(scene, precision, tmp_path)))
    # What float32 cannot decide goes to a function of its own, with copies of what it reads.
    assert asm.traversal_calls(code) <= rare | ({"memcpy"} if rare else set())
    loops = asm.traversal_loops(code)
    assert any("triangle.cl" in loop.files for loop in loops)
    assert [loop.calls for loop in loops if loop.calls] == []
