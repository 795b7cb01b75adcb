"""Rays a second, against Embree from Python: primary rays and the shadow rays of one light, nothing else.

Embree's rays lie ready in arrays, and it writes one number for each; clrt's launches also make the rays and shade what they hit:

    primary    a picture without lights: rays made, traced, and given their ambient colour
    shadow     what shadows add to a lit picture
    both       the picture with light and shadows, all of it
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.machine import cores
from clrt.bench.peers import Embreex, embreex_available, primary_rays, shadow_rays
from clrt.bench.scenes import BenchScene, straight
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.features import Features
from clrt.precision import DEFAULT, rung
from clrt.renderer import build_trees, open_tracer, render
from clrt.scene.model import Scene
from clrt.timing import Series, interleave

Bools = NDArray[np.bool_]

#: what the difference of two of clrt's pictures tells: what shadow rays alone cost
DARK, LIT, SHADOWED = "clrt without lights", "clrt lit, no shadows", "clrt lit, with shadows"


def opened(scene: Scene, tree: str, device: Device, without: str | None = None) -> Tracer:
    """A tracer with trees built, buffers filled and program compiled; `without`: an effect to leave out."""
    prepared = build_trees(scene, tree, lambda phase, fraction: None)
    features = Features(tuple(line for line in Features.of(scene).lines if line[0] != without))
    return open_tracer(prepared, features, rung(DEFAULT), device, lambda phase, fraction: None)[1]


def measure_versus(bench: BenchScene, size: int, rounds: int, device: Device) -> dict[str, Any]:
    """Times of both tracers over the same rays of a square picture, in turns; their rays, and where they differ in what they hit."""
    scene = straight(bench.scene).with_size(size, size)
    tracers = {
        DARK: opened(replace(scene, lights=()), "sah", device),
        LIT: opened(scene, "sah", device, without="shadows"),
        SHADOWED: opened(scene, "sah", device),
    }
    counted = render(scene, device=device.info.name, count=True).stats
    assert counted is not None  # a renderer's picture has figures
    contenders: dict[str, Callable[[], object]] = {name: partial(tracer.run, 0, size) for name, tracer in tracers.items()}
    result: dict[str, Any] = {"scene": bench.name, "size": size, "rays": {"clrt": counted.ray_counts}}
    with ExitStack() as stack:
        if embreex_available():
            peer = stack.enter_context(Embreex([item.vertices for item in scene.objects], cores()))
            found, sees = _load_rays(peer, scene, result)
            contenders |= {f"embreex {kind}": partial(peer.trace, kind) for kind in ("primary", "shadow")}
        series = interleave(contenders, rounds)
        result["cores_used"] = {name: cores_used(run) for name, run in contenders.items()}
    if embreex_available():
        result["pixels_that_differ"] = _differences(found, sees, tracers)
    result["seconds"] = {name: times.to_json() for name, times in series.items()}
    return result | {"rates": rates_of(series, result["rays"])}


def _load_rays(peer: Embreex, scene: Scene, result: dict[str, Any]) -> tuple[Bools, Bools]:
    """Give the peer its rays. By pixel, what it finds: whether anything is hit, and whether the light is seen from there."""
    primary = primary_rays(scene)
    hits = peer.nearest(primary)
    shadow, pixels = shadow_rays(scene, hits)
    peer.load("primary", primary)
    peer.load("shadow", shadow)
    result["rays"]["embreex"] = {"primary": len(primary), "shadow": len(shadow)}
    found = hits.prim >= 0
    sees = np.zeros_like(found)
    sees[pixels] = ~peer.occluded("shadow")
    return found, sees


def cores_used(run: Callable[[], object]) -> float:
    """Processor time over wall time of three runs: below the number of cores where a tracer leaves some idle, or others use them."""
    cpu, wall = time.process_time(), time.perf_counter()
    for _ in range(3):
        run()
    return (time.process_time() - cpu) / (time.perf_counter() - wall)


def _differences(found: Bools, sees: Bools, tracers: dict[str, Tracer]) -> dict[str, int]:
    """Pixels where only one of the tracers hits anything, and where only one sees the light. Matt surfaces have an ambient part."""
    dark, lit = tracers[DARK].picture(), tracers[SHADOWED].picture()
    hit, bright = (dark != 0.0).any(axis=-1).ravel(), (lit != dark).any(axis=-1).ravel()
    return {"hit": int(np.count_nonzero(hit != found)), "lit": int(np.count_nonzero(bright != sees))}


def rates_of(series: dict[str, Series], rays: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Million rays a second by tracer and kind, by the best times; `both`: primary and shadow rays together."""
    best = {name: times.best for name, times in series.items()}
    shadow = max(best[SHADOWED] - best[LIT], 1e-9)
    rates = {"clrt": _millions(rays["clrt"], best[DARK], shadow, best[SHADOWED])}
    if "embreex" in rays:
        primary, shadow = best["embreex primary"], best["embreex shadow"]
        rates["embreex"] = _millions(rays["embreex"], primary, shadow, primary + shadow)
        rates["ratio"] = {kind: rates["clrt"][kind] / rates["embreex"][kind] for kind in rates["clrt"]}
    return rates


def _millions(rays: dict[str, int], primary_s: float, shadow_s: float, both_s: float) -> dict[str, float]:
    primary, shadow = rays["primary"], rays["shadow"]
    return {"primary": primary / primary_s / 1e6, "shadow": shadow / shadow_s / 1e6, "both": (primary + shadow) / both_s / 1e6}
