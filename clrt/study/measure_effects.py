"""What each effect of the scene costs, and what the picture loses without it: `clrt explain --measure`, with errors."""

from __future__ import annotations

from typing import Any

from clrt.explain import Explained, explain
from clrt.explain import measure as measure_costs
from clrt.precision import DEFAULT, rung
from clrt.study.numbers import counted, measured, number
from clrt.study.subject import Subject, silent
from clrt.timing import FEWEST


def measure(subject: Subject) -> dict[str, Any]:
    """The part `effects`. Raises DeviceError, LimitError, OSError."""
    subject.tell("effects: composing", 0.0)
    ladder = rung(DEFAULT)
    found = explain(subject.prepared, ladder, subject.device, silent)
    if not found.effects:
        return {"rows": [], "note": "the scene calls for no effect"}
    costs = measure_costs(
        found, subject.prepared, ladder, subject.device, max(FEWEST, subject.plan.rounds), lambda _, done: subject.tell("effects", done)
    )
    return {"rows": [row(effect) for effect in costs.effects], "samples": subject.samples}


def row(effect: Explained) -> dict[str, Any]:
    """One effect; its difference is that of two pictures of one seed."""
    cost = effect.cost
    assert cost is not None
    low, high = cost.interval_s
    shares = [(a - b) / a for a, b in zip(cost.with_s, cost.without_s, strict=True)]
    return {
        "effect": effect.name, "line": effect.line, "text": effect.text, "with_it": list(effect.brings),
        "cost": number(cost.cost_s, low, high, "s", len(cost.with_s)), "share_of_time": measured(shares, "1"),
        "changed_pixels": counted(cost.difference.pixels, "1"), "max_difference": counted(cost.difference.greatest, "radiance"),
        "error": counted(cost.difference.rms, "radiance"),
    }  # fmt: skip
