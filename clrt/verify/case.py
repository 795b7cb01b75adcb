"""What a hard case is: a function from a context to counts of disagreements, registered under its number.

    @case(1, "vertex-aimed rays, closed sphere", provokes="pole and fan leaks", oracle="E", promised=CLOSED)
    def vertex_aimed(context: Context) -> Outcome: ...

Each case also runs a deliberately naive variant, which must fail: that proves that the case bites.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from clrt.precision import RUNGS

if TYPE_CHECKING:
    from clrt.rays import RayCaster
    from clrt.scene.model import Scene

RUNG_NAMES = ("fast", "watertight", "exact", "double")  #: the columns of the table
ALL = frozenset(RUNG_NAMES)
SAFE = frozenset({"watertight", "exact", "double"})  #: everything but `fast`, which promises nothing at edges
EXACT = frozenset({"exact"})
DEFAULT_RAYS = 100_000
FULL_RAYS = 1_000_000
ORACLES = {
    "E": "exact rational arithmetic",
    "B": "brute force with the same predicate",
    "D": "float64 or better",
    "S": "closed form",
    "X": "bitwise equality",
}


@dataclass(frozen=True)
class Outcome:
    """What a case found.

    rays : rays (or samples, pixels, builds) that each rung was asked
    wrong : name of a rung -> disagreements with the oracle; None or absent where the case does not apply to that rung
    naive : disagreements of the naive variant; 0 says that the case does not bite, which is a failure of the case
    note : what the counts leave out, one line
    """

    rays: int
    wrong: Mapping[str, int | None]
    naive: int
    note: str = ""


@dataclass
class Context:
    """What a case may use.

    rays : how many rays the case is to use; a case with costlier rays takes a fixed share (`share`)
    full : a long run, with 1e6 rays a case
    seed : of all randomness, through `rng`
    device : part of a device's name, None for the default one
    rungs : rungs to judge, those that this version and device have
    """

    rays: int = DEFAULT_RAYS
    full: bool = False
    seed: int = 20_130
    device: str | None = None
    rungs: tuple[str, ...] = field(default_factory=lambda: tuple(name for name in RUNG_NAMES if name in RUNGS))
    _casters: dict[Hashable, RayCaster] = field(default_factory=dict, repr=False)

    def share(self, part: float, least: int = 64) -> int:
        """`part` of the rays, at least `least`."""
        return max(least, round(self.rays * part))

    def rng(self, number: int) -> np.random.Generator:
        """A generator that depends on the seed and the number of the case alone, so that one case can be run by itself."""
        return np.random.default_rng((self.seed, number))

    def caster(self, key: Hashable, mesh: Any, rung: str, tree: str = "sah") -> RayCaster:
        """A RayCaster, kept under (key, rung, tree) for the time of a case: the key must name the mesh. Raises what RayCaster raises."""
        from clrt.rays import RayCaster

        place = (key, rung, tree)
        if place not in self._casters:
            self._casters[place] = RayCaster(mesh, precision=rung, tree=tree, device=self.device)
        return self._casters[place]

    def render(self, scene: Scene, rung: str, size: tuple[int, int] | None = None) -> np.ndarray:
        """Pixels of a scene on this device with a rung: (height, width, channels) as `Image.pixels`."""
        import clrt

        return np.asarray(clrt.render(scene, size=size, device=self.device, precision=rung).pixels)

    def each_rung(self, count: Callable[[str], int | None]) -> dict[str, int | None]:
        """`count` of every rung there is: the mapping for `Outcome.wrong`."""
        return {rung: count(rung) for rung in self.rungs}

    def forget(self) -> None:
        """Free the casters."""
        self._casters.clear()


@dataclass(frozen=True)
class Case:
    """One line of the catalogue (the design table in docs/numerics.md). `promised`: the rungs for which 0 disagreements are promised."""

    number: int
    title: str
    provokes: str
    oracle: str
    promised: frozenset[str]
    run: Callable[[Context], Outcome]


@dataclass(frozen=True)
class Result:
    """A case that was run. `outcome` is None where it ended in an exception, which `error` tells."""

    case: Case
    outcome: Outcome | None
    seconds: float
    error: str = ""

    def failures(self, rungs: Iterable[str]) -> list[str]:
        """Why the case fails, for these rungs; nothing where it passes. Counts of rungs that promise nothing do not matter."""
        if self.outcome is None:
            return [self.error]
        wrong = self.outcome.wrong
        counts = [(rung, wrong.get(rung)) for rung in rungs if rung in self.case.promised]
        faults = [f"{rung}: {count:,} of {self.outcome.rays:,} wrong" for rung, count in counts if count]
        faults += [f"{rung}: promised, and not judged" for rung, count in counts if count is None]
        if not self.outcome.naive:
            faults.append("the naive variant is right, so that the case proves nothing")
        return faults


CASES: dict[int, Case] = {}  #: filled by the modules of cases; `clrt.verify.run.catalogue` imports them all


def case(
    number: int, title: str, *, provokes: str, oracle: str, promised: Iterable[str] = SAFE
) -> Callable[[Callable[[Context], Outcome]], Callable[[Context], Outcome]]:
    """Register a function as the case of that number. Raises ValueError for a number, oracle or rung that cannot be."""

    def register(run: Callable[[Context], Outcome]) -> Callable[[Context], Outcome]:
        if number in CASES:
            raise ValueError(f"case {number} is there twice: {CASES[number].title!r} and {title!r}")
        if oracle not in ORACLES:
            raise ValueError(f"case {number} has the oracle {oracle!r}; choose one of {', '.join(ORACLES)}")
        if unknown := set(promised) - ALL:
            raise ValueError(f"case {number} promises for unknown rungs: {', '.join(sorted(unknown))}")
        CASES[number] = Case(number, title, provokes, oracle, frozenset(promised), run)
        return run

    return register
