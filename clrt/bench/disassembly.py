"""What a compiled kernel is made of: instructions with the kernel lines they come from, its loops, its calls, its vectors on the stack.

Reads what GNU's objdump or LLVM's print of a shared library for x86-64.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from clrt.errors import ClrtError

DISASSEMBLERS = ("objdump", "llvm-objdump")
_FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
_PLACE = re.compile(r"^(?:; )?(\S+\.cl):(\d+)")
_INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\s+(\S+)(?:\s+(.*?))?\s*$")
_TARGET = re.compile(r"^(?:0x)?([0-9a-f]+)\b")
_CALLED = re.compile(r"<([^>+]+)")
_VECTOR = re.compile(r"%[xyz]mm\d")
_OF_STACK = re.compile(r"\(%r[sb]p\)")  # an index beside it means an array, which is in memory by right
_REDUCTION = re.compile(r"^v(?:extract|perm|shuf|unpck|mov[hs][hl]dup|psrldq)")


@dataclass(frozen=True)
class Instruction:
    """address; mnemonic and operands as the disassembler writes them; file and line of the kernel, "" and 0 where none is known."""

    address: int
    mnemonic: str
    operands: str
    file: str
    line: int

    @property
    def target(self) -> int | None:
        """Where a jump goes; None for what is none, and for one through a register."""
        found = _TARGET.match(self.operands) if self.mnemonic.startswith("j") else None
        return int(found[1], 16) if found else None

    @property
    def called(self) -> str | None:
        """The function called, "?" where it is not named; None for what is no call."""
        if not self.mnemonic.startswith("call"):
            return None
        found = _CALLED.search(self.operands)
        return found[1].removesuffix("@plt") if found else "?"

    @property
    def vector(self) -> bool:
        return bool(_VECTOR.search(self.operands))

    @property
    def spill(self) -> str | None:
        """"load" or "store" where a vector goes between a register and a fixed place on the stack."""
        if not self.vector or not _OF_STACK.search(self.operands):
            return None
        return "store" if self.operands.rstrip().endswith(")") else "load"

    @property
    def reduces(self) -> bool:
        """Whether it moves lanes across a vector, as a reduction does that is no mask test."""
        return self.vector and bool(_REDUCTION.match(self.mnemonic))


@dataclass(frozen=True)
class Loop:
    """A loop's instructions, without what stands there only to call a rare function."""

    function: str
    body: tuple[Instruction, ...]

    @property
    def files(self) -> set[str]:
        return {i.file for i in self.body if i.file}

    @property
    def calls(self) -> list[str]:
        return [i.called for i in self.body if i.called]

    def spills(self, kind: str) -> int:
        return sum(i.spill == kind for i in self.body)


def disassembler() -> str | None:
    """The path of a disassembler, or None."""
    return next((path for name in DISASSEMBLERS if (path := shutil.which(name))), None)


def disassemble(library: Path) -> str:
    """The text of all its functions. Raises ClrtError where no disassembler is installed or it cannot read the file."""
    tool = disassembler()
    if tool is None:
        raise ClrtError(f"no disassembler found ({' or '.join(DISASSEMBLERS)}); install binutils, or LLVM")
    done = subprocess.run([tool, "-d", "-l", "--no-show-raw-insn", str(library)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClrtError(f"{tool} cannot read {library}: {done.stderr.strip()}")
    return done.stdout


def functions(text: str) -> dict[str, list[Instruction]]:
    """Function -> its instructions, in the order of addresses."""
    found: dict[str, list[Instruction]] = {}
    current: list[Instruction] = []
    file, line = "", 0
    for row in text.splitlines():
        if function := _FUNCTION.match(row):
            current = found.setdefault(function[1], [])
            file, line = "", 0
        elif place := _PLACE.match(row):
            file, line = Path(place[1]).name, int(place[2])
        elif instruction := _INSTRUCTION.match(row):
            operands = (instruction[3] or "").split(" # ")[0]
            current.append(Instruction(int(instruction[1], 16), instruction[2], operands, file, line))
    return found


def inner_loops(name: str, body: list[Instruction], rare: Iterable[str] = ()) -> list[Loop]:
    """The loops of a function that hold no other, without the blocks that lead nowhere but to calls of the functions `rare`."""
    blocks = _blocks(body)
    dead = {head for head, block in blocks.items() if any(i.called in set(rare) for i in block)}
    edges = {head: [to for to in _followers(block, blocks) if to not in dead] for head, block in blocks.items() if head not in dead}
    loops = _loops(edges)
    heads = sorted(head for head, inside in loops.items() if not any(other in inside for other in loops if other != head))
    return [Loop(name, tuple(i for at in sorted(loops[head]) for i in blocks[at])) for head in heads]


def _blocks(body: list[Instruction]) -> dict[int, list[Instruction]]:
    """Address of its first instruction -> a run of instructions that is entered at its start and left at its end alone."""
    starts = {i.target for i in body if i.target is not None}
    blocks: dict[int, list[Instruction]] = {}
    current: list[Instruction] = []
    ended = True
    for instruction in body:
        if ended or instruction.address in starts:
            current = blocks.setdefault(instruction.address, [])
        current.append(instruction)
        ended = instruction.mnemonic.startswith(("j", "ret"))
    return blocks


def _followers(block: list[Instruction], blocks: Mapping[int, list[Instruction]]) -> list[int]:
    """Where control goes at the end of a block, within the function."""
    last, ordered = block[-1], sorted(blocks)
    goes_on = not last.mnemonic.startswith(("jmp", "ret"))
    after = [at for at in ordered if at > last.address][:1] if goes_on else []
    return after + [to for to in (last.target,) if to is not None and to in blocks]


def _loops(edges: Mapping[int, list[int]]) -> dict[int, set[int]]:
    """Head -> blocks of the natural loop that jumps back to it; several jumps to one head make one loop (Aho and others 2006, 9.6.6)."""
    before: dict[int, list[int]] = {}
    for at, targets in edges.items():
        for to in targets:
            before.setdefault(to, []).append(at)
    dominators = _dominators(edges, before)
    loops: dict[int, set[int]] = {}
    for at, targets in edges.items():
        for head in targets:
            if at not in dominators or head not in dominators[at]:
                continue
            inside = loops.setdefault(head, {head})
            waiting = [at]
            while waiting:
                block = waiting.pop()
                if block not in inside:
                    inside.add(block)
                    waiting += [b for b in before.get(block, []) if b in dominators]
    return loops


def _dominators(edges: Mapping[int, list[int]], before: Mapping[int, list[int]]) -> dict[int, set[int]]:
    """Block -> the blocks that every way to it from the function's start goes through; of those that can be reached."""
    start = min(edges)
    reached, waiting = {start}, [start]
    while waiting:
        fresh = [to for to in edges[waiting.pop()] if to not in reached]
        reached.update(fresh)
        waiting += fresh
    found = {at: set(reached) for at in reached} | {start: {start}}
    changed = True
    while changed:
        changed = False
        for at in sorted(reached - {start}):
            now = set.intersection(*(found[b] for b in before[at] if b in reached)) | {at}
            changed |= now != found[at]
            found[at] = now
    return found
