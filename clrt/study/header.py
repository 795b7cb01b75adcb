"""What was studied, on what, when: without it no number of a study means anything."""

from __future__ import annotations

import hashlib
import platform
from typing import Any

from clrt import __version__
from clrt.device.program import OPTIONS
from clrt.machine import cores, cpu_model, load_average, memory_gib, now
from clrt.precision import DEFAULT
from clrt.study.subject import FIRST_SEED, REFERENCE_SEED, Subject

_CONTRACTION = "off (FP_CONTRACT OFF), but for sums of products that are marked so, where it is on"


def header(subject: Subject) -> dict[str, Any]:
    """The part `header`; its load average has the value before alone, until `finish`."""
    info, handle = subject.device.info, subject.device.handle
    return {
        "scene": str(subject.path), "scene_sha256": hashlib.sha256(subject.path.read_bytes()).hexdigest(), "clrt": __version__,
        "date": now(),
        "machine": {"processor": cpu_model(), "cores": cores(), "threads": info.compute_units, "memory": memory_gib(),
                    "system": platform.platform()},
        "opencl": {"platform": info.platform, "device": info.name, "driver": info.driver, "compiler": handle.platform.version.strip()},
        "build_options": list(OPTIONS), "contraction": _CONTRACTION, "load_average": [load_average()[0], None],
        "size": list(subject.size), "quick": subject.plan.quick, "samples": subject.samples, "rung": DEFAULT,
        "seeds": {"points": subject.plan.seeds, "first": FIRST_SEED, "reference": subject.plan.batches, "reference_first": REFERENCE_SEED},
    }  # fmt: skip


def finish(found: dict[str, Any]) -> dict[str, Any]:
    """With the load average of now as the one after."""
    return {**found, "load_average": [found["load_average"][0], load_average()[0]]}
