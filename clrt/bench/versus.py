"""Rays a second, against other tracers: primary rays and the shadow rays of one light, in one view, in turns.

Peers in Python get rays that lie ready in arrays; Embree from C++ makes them itself, packet by packet, and so does clrt, whose launches
also shade what they hit:

    primary    a picture without lights: rays made, traced, and given their ambient colour
    shadow     what shadows add to a lit picture
    both       the picture with light and shadows, all of it
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench import view
from clrt.bench.machine import cores
from clrt.bench.peers import Embreex, PeerHits, RaySet, embreex_available, primary_rays, shadow_rays
from clrt.bench.scenes import BenchScene
from clrt.bench.worker import EMBREE, Missing, Peers
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.errors import ClrtError
from clrt.features import Features
from clrt.precision import DEFAULT, RUNGS, rung
from clrt.rays import RayCaster
from clrt.renderer import build_trees, open_tracer, render
from clrt.scene.model import Scene
from clrt.timing import Series, interleave, paired

Bools = NDArray[np.bool_]
Contenders = dict[str, Callable[[], object]]

KINDS = ("primary", "shadow", "both")
EMBREEX = "embreex"
#: the difference of two of clrt's pictures tells what shadow rays alone cost
DARK, LIT, SHADOWED = "without lights", "lit, no shadows", "lit, with shadows"
#: rays through a lens: the picture, the same without anything to hit, and what Embree's driver takes to read them
_PICTURE, _NOTHING, _COPY = "clrt, picture", "clrt, picture of nothing", f"{EMBREE}, reading"
_LEAST = 1e-6  #: seconds; a difference of two times may be lost in noise


def opened(scene: Scene, tree: str, device: Device, without: str | None = None, precision: str = DEFAULT) -> Tracer:
    """A tracer with trees built, buffers filled and program compiled; `without`: an effect to leave out."""
    prepared = build_trees(scene, tree, lambda phase, fraction: None, device)
    features = Features(tuple(line for line in Features.of(scene).lines if line[0] != without))
    return open_tracer(prepared, features, rung(precision), device, lambda phase, fraction: None)[1]


@dataclass
class Round:
    """What takes turns over one size of the view. rays : of each contender, by kind; counts : what peers found; cpu : cores in use."""

    contenders: Contenders = field(default_factory=dict)
    rays: dict[str, dict[str, int]] = field(default_factory=dict)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    cpu: dict[str, float] = field(default_factory=dict)


def measure_versus(bench: BenchScene, sizes: tuple[int, ...], rounds: int, device: Device, scratch: Path) -> dict[str, Any]:
    """A row a size: times of all contenders in turns, their rates, and clrt's over each of them."""
    scene = view.view_of(bench)
    files = scratch / "view.bin", scratch / "view.npy"
    view.write_scene(scene, files[0])
    view.write_triangles(scene, files[1])
    with ExitStack() as stack:
        peers = stack.enter_context(Peers(*files, cores(), scratch))
        embreex = stack.enter_context(Embreex([o.vertices for o in scene.objects], cores())) if embreex_available() else None
        if embreex is None:
            peers.missing.append(Missing(EMBREEX, "embreex is not installed; `pip install 'clrt[bench]'` brings it"))
        rows = [_one_size(scene.with_size(size, size), rounds, device, peers, embreex, scratch) for size in sizes]
        general = _general(scene.with_size(sizes[-1], sizes[-1]), rounds, device, peers, embreex, scratch)
    return {"scene": bench.name, "triangles": scene.triangle_count, "peers": peers.describe(), "views": rows, "general": general}


def _one_size(scene: Scene, rounds: int, device: Device, peers: Peers, embreex: Embreex | None, scratch: Path) -> dict[str, Any]:
    size = scene.camera.width
    turns, tracers = Round(), {name: _tracers(scene, name, device) for name in RUNGS}
    counted = render(scene, device=device.info.name, count=True).stats
    assert counted is not None
    assert counted.ray_counts is not None  # a picture that is counted has them
    for name, three in tracers.items():
        turns.contenders |= {f"clrt {name}, {what}": partial(tracer.run, 0, size) for what, tracer in three.items()}
        turns.rays[f"clrt {name}"] = {kind: counted.ray_counts[kind] for kind in ("primary", "shadow")}
    primary = primary_rays(scene)
    hits = nearest_hits(scene, primary, device)
    shadow, pixels = shadow_rays(scene, hits)
    _add_workers(turns, peers, {"primary": primary, "shadow": shadow}, size, scratch)
    row: dict[str, Any] = {"size": size, "hit_share": float(np.mean(hits.prim >= 0))}
    if embreex is not None:
        embreex.load("primary", primary)
        embreex.load("shadow", shadow)
        turns.contenders |= {f"{EMBREEX}, {kind}": partial(embreex.trace, kind) for kind in ("primary", "shadow")}
        turns.rays[EMBREEX] = {"primary": len(primary), "shadow": len(shadow)}
        row["pixels_that_differ"] = _differences(*_found(embreex, primary, pixels), tracers[DEFAULT])
    series = interleave(turns.contenders, rounds, before=1)
    turns.cpu |= {name: cores_used(turns.contenders[name]) for name in turns.contenders if name.startswith((f"clrt {DEFAULT}", EMBREEX))}
    turns.cpu |= {worker.name: statistics.median(worker.cpu) for worker in peers.workers}
    row |= {"rays": turns.rays, "counts": turns.counts, "cores_used": turns.cpu}
    return row | {"seconds": {name: times.to_json() for name, times in series.items()}} | compared(series, turns.rays)


def _tracers(scene: Scene, precision: str, device: Device) -> dict[str, Tracer]:
    return {
        DARK: opened(replace(scene, lights=()), "sah", device, precision=precision),
        LIT: opened(scene, "sah", device, without="shadows", precision=precision),
        SHADOWED: opened(scene, "sah", device, precision=precision),
    }


def nearest_hits(scene: Scene, rays: RaySet, device: Device) -> PeerHits:
    """What the rays hit first, by clrt's rung `double`, objects and their triangles by number."""
    caster = RayCaster(scene, "double", device=device.info.name)
    hits = caster.first_hit(rays.origins, rays.directions)
    first = np.append(caster.first_prims, 0)  # object -1, none
    prim = np.where(hits["prim_id"] >= 0, hits["prim_id"] - first[hits["object_id"]], -1)
    return PeerHits(hits["object_id"].astype(np.int64), prim, hits["t"])


def _add_workers(turns: Round, peers: Peers, rays: Mapping[str, RaySet], size: int, scratch: Path) -> None:
    """Contenders of all peers in processes of their own; one that fails at its first try is dropped."""
    files = {kind: scratch / f"{kind}-{size}.npy" for kind in rays}
    for kind, given in rays.items():
        view.write_rays(given, files[kind])
    for worker in list(peers.workers):
        try:
            if worker.name == EMBREE:
                runs = {f"{EMBREE}, {kind}": partial(worker.run, kind, size, size) for kind in ("primary", "shadow", "light", "picture")}
                runs[f"{EMBREE}, picture"]()
                found, asked, blocked, _ = (int(word) for word in worker.ask("hits"))
                count = {"primary": size * size, "shadow": asked}
            else:
                count = {kind: int(worker.ask("load", kind, file)[0]) for kind, file in files.items()}
                found, blocked = (int(worker.ask("hits", kind)[0]) for kind in ("primary", "shadow"))
                runs = {f"{worker.name}, {kind}": partial(worker.run, "run", kind) for kind in ("primary", "shadow")}
        except (ClrtError, ValueError) as error:
            peers.drop(worker, str(error))
            continue
        worker.cpu.clear()
        turns.contenders |= runs
        turns.rays[worker.name] = count
        turns.counts[worker.name] = {"hits": found, "blocked": blocked}


def times_of(contender: str, kind: str, series: Mapping[str, Series]) -> tuple[float, ...]:
    """Seconds of a contender for rays of a kind, round by round."""
    if contender.startswith("clrt"):
        dark, lit, shadowed = (series[f"{contender}, {what}"] for what in (DARK, LIT, SHADOWED))
        return {"primary": dark.seconds, "shadow": _less(shadowed, lit), "both": shadowed.seconds}[kind]
    if contender == EMBREE:
        ways = series[f"{EMBREE}, shadow"], series[f"{EMBREE}, light"]
        shadow = min(ways, key=lambda way: way.median).seconds  # from the point or from the light: whichever is faster
        return {"primary": series[f"{EMBREE}, primary"].seconds, "shadow": shadow, "both": series[f"{EMBREE}, picture"].seconds}[kind]
    primary, shadow = (series[f"{contender}, {one}"].seconds for one in ("primary", "shadow"))
    return {"primary": primary, "shadow": shadow, "both": tuple(a + b for a, b in zip(primary, shadow, strict=True))}[kind]


def compared(series: Mapping[str, Series], rays: Mapping[str, Mapping[str, int]]) -> dict[str, Any]:
    """Million rays a second by the median; the ratio of the default rung's rate to every peer's; each rung's time over that of `fast`."""
    own = f"clrt {DEFAULT}"
    count = {name: {**given, "both": given["primary"] + given["shadow"]} for name, given in rays.items()}
    rates = {name: {kind: count[name][kind] / statistics.median(times_of(name, kind, series)) / 1e6 for kind in KINDS} for name in rays}
    ratios = {
        name: {
            kind: paired(times_of(name, kind, series), times_of(own, kind, series)).times(count[own][kind] / count[name][kind]).to_json()
            for kind in KINDS
        }
        for name in rays if not name.startswith("clrt")
    }  # fmt: skip
    fast = times_of("clrt fast", "both", series)
    over = {name: paired(times_of(f"clrt {name}", "both", series), fast).to_json() for name in RUNGS}
    return {"rates": rates, "ratios": ratios, "over_fast": over}


def _general(scene: Scene, rounds: int, device: Device, peers: Peers, embreex: Embreex | None, scratch: Path) -> dict[str, Any]:
    """Rays through a lens: each begins elsewhere. clrt draws them and shades what they hit; all others find the very same in arrays."""
    seen, size = view.with_lens(scene), scene.camera.width
    rays = view.lens_rays(seen)
    caster = RayCaster(seen, DEFAULT, device=device.info.name)
    contenders: Contenders = {
        _PICTURE: partial(opened(seen, "sah", device).run, 0, size),
        _NOTHING: partial(opened(view.emptied(seen), "sah", device).run, 0, size),
        "clrt, RayCaster.first_hit": partial(caster.first_hit, rays.origins, rays.directions),
    }
    files = scratch / "general.npy", scratch / "general.bin"
    view.write_rays(rays, files[0])
    view.write_packets(rays, size, files[1])
    for worker in peers.workers:
        if worker.name == EMBREE:
            worker.ask("load", files[1])
            contenders |= {EMBREE: partial(worker.run, "general"), _COPY: partial(worker.run, "copy")}
        else:
            worker.ask("load", "general", files[0])
            contenders[worker.name] = partial(worker.run, "run", "general")
    if embreex is not None:
        embreex.load("general", rays)
        contenders[EMBREEX] = partial(embreex.trace, "general")
    series = interleave(contenders, rounds, before=1)
    hit = float(np.mean(caster.first_hit(rays.origins, rays.directions)["prim_id"] >= 0))
    seconds = {name: times.to_json() for name, times in series.items()}
    return {"size": size, "rays": len(rays), "hit_share": hit, "seconds": seconds} | compared_general(series, len(rays))


def compared_general(series: Mapping[str, Series], rays: int) -> dict[str, Any]:
    """Rates and clrt's ratios over others, of tracing alone for clrt and Embree: without what makes or reads the rays."""
    own = _less(series[_PICTURE], series[_NOTHING])
    taken = {"clrt": own} | {name: s.seconds for name, s in series.items() if name not in (_NOTHING, _COPY)}
    if _COPY in series:
        taken[EMBREE] = _less(series[EMBREE], series[_COPY])
    rates = {name: rays / statistics.median(seconds) / 1e6 for name, seconds in taken.items()}
    others = {name: seconds for name, seconds in taken.items() if not name.startswith("clrt")}
    return {"rates": rates, "ratios": {name: paired(seconds, own).to_json() for name, seconds in others.items()}}


def _less(whole: Series, part: Series) -> tuple[float, ...]:
    """The difference of two contenders, round by round."""
    return tuple(max(a - b, _LEAST) for a, b in zip(whole.seconds, part.seconds, strict=True))


def cores_used(run: Callable[[], object]) -> float:
    """Processor time over wall time of three runs: below the number of cores where a tracer leaves some idle, or others use them."""
    cpu, wall = time.process_time(), time.perf_counter()
    for _ in range(3):
        run()
    return (time.process_time() - cpu) / (time.perf_counter() - wall)


def _found(embreex: Embreex, primary: RaySet, pixels: NDArray[np.int64]) -> tuple[Bools, Bools]:
    """By pixel, what the peer finds: whether anything is hit, and whether the light is seen from there."""
    found = embreex.nearest(primary).prim >= 0
    sees = np.zeros_like(found)
    sees[pixels] = ~embreex.occluded("shadow")
    return found, sees


def _differences(found: Bools, sees: Bools, tracers: Mapping[str, Tracer]) -> dict[str, int]:
    """Pixels where only one of the tracers hits anything, and where only one sees the light. Matt surfaces have an ambient part."""
    for tracer in tracers.values():
        tracer.run(0, tracer.height)
    dark, lit = tracers[DARK].picture(), tracers[SHADOWED].picture()
    hit, bright = (dark != 0.0).any(axis=-1).ravel(), (lit != dark).any(axis=-1).ravel()
    return {"hit": int(np.count_nonzero(hit != found)), "lit": int(np.count_nonzero(bright != sees))}
