"""Runs the catalogue: cases in turn, results as rows and as JSON. Prints nothing."""

from __future__ import annotations

import importlib
import pkgutil
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import clrt
from clrt import verify
from clrt.device.context import open_device
from clrt.errors import ClrtError
from clrt.verify.case import CASES, DEFAULT_RAYS, FULL_RAYS, ORACLES, RUNG_NAMES, Case, Context, Result

LAST_CASE = 58  #: of the catalogue in docs/numerics.md
Progress = Callable[[str, float], None]


def catalogue() -> list[Case]:
    """All cases there are, by number: every module `cases_*` of this package is imported for them."""
    for module in pkgutil.iter_modules(verify.__path__):
        if module.name.startswith("cases_"):
            importlib.import_module(f"{verify.__name__}.{module.name}")
    return [CASES[number] for number in sorted(CASES)]


def chosen(numbers: Iterable[int]) -> list[Case]:
    """The cases of these numbers, all of them for none. Raises ClrtError for a number that is not in the catalogue."""
    cases, wanted = catalogue(), set(numbers)
    if unknown := wanted - {case.number for case in cases}:
        raise ClrtError(f"there is no case {min(unknown)}; the catalogue has {cases[0].number} to {cases[-1].number}")
    return [case for case in cases if not wanted or case.number in wanted]


def context_for(device: str | None = None, *, full: bool = False, rays: int | None = None) -> Context:
    """A context on a device, with the rungs that it can do. Raises DeviceError where no device fits."""
    fp64 = open_device(device).info.fp64
    context = Context(rays=rays or (FULL_RAYS if full else DEFAULT_RAYS), full=full, device=device)
    context.rungs = tuple(rung for rung in context.rungs if fp64 or rung != "double")
    return context


def run_case(case: Case, context: Context) -> Result:
    """One case. What it raises is its result: a case that cannot be run proves nothing."""
    start = time.perf_counter()
    try:
        outcome, error = case.run(context), ""
    except Exception as failure:  # any fault at all is this case's, not the end of the others
        outcome, error = None, f"{type(failure).__name__}: {failure}"
    finally:
        context.forget()  # each caster holds buffers for all of a case's rays
    return Result(case, outcome, time.perf_counter() - start, error)


def run(cases: Sequence[Case], context: Context, progress: Progress | None = None) -> list[Result]:
    """The cases in turn; `progress` is called with a title and the fraction done before each."""
    results = []
    for place, case in enumerate(cases):
        if progress is not None:
            progress(f"case {case.number}: {case.title}", place / len(cases))
        results.append(run_case(case, context))
    if progress is not None:
        progress("done", 1.0)
    return results


def failures(results: Iterable[Result], context: Context) -> list[str]:
    """A line a broken promise: `case 3, ...: exact: 2 of 1,000 wrong`. Empty: all is well."""
    return [f"case {r.case.number}, {r.case.title}: {fault}" for r in results for fault in r.failures(context.rungs)]


def to_json(results: Sequence[Result], context: Context) -> dict[str, Any]:
    """Everything about a run in JSON types. A count is null where the case does not apply to the rung."""
    return {
        "clrt": clrt.__version__,
        "device": open_device(context.device).info.name,
        "full": context.full,
        "seed": context.seed,
        "rungs": list(context.rungs),
        "passed": not failures(results, context),
        "seconds": round(sum(r.seconds for r in results), 3),
        "cases": [_case_json(r, context) for r in results],
    }


def _case_json(result: Result, context: Context) -> dict[str, Any]:
    case, outcome = result.case, result.outcome
    faults = result.failures(context.rungs)
    return {
        "case": case.number,
        "title": case.title,
        "provokes": case.provokes,
        "oracle": ORACLES[case.oracle],
        "promised": [rung for rung in RUNG_NAMES if rung in case.promised],
        "rays": outcome.rays if outcome else None,
        "wrong": {rung: outcome.wrong.get(rung) if outcome else None for rung in context.rungs},
        "naive": outcome.naive if outcome else None,
        "note": outcome.note if outcome else "",
        "passed": not faults,
        "failures": faults,
        "seconds": round(result.seconds, 3),
    }
