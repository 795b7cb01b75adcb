"""How long trees take, by NumPy and by the device in turns: `python -m clrt.bench.forest scene.txt --cut 2`.

Each triangle is cut into four, `--cut` times, and copies stand side by side. Prints a line a way: seconds of wall and of processor
time (best of the rounds), the greatest memory of the process, and the size of the tree; refuses trees that differ.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from pathlib import Path

import numpy as np

from clrt.device.context import Device, open_device
from clrt.forest import choose
from clrt.kdtree.common import F64
from clrt.kdtree.tree import KdTree
from clrt.scene.build import load_scene

_ARRAYS = ("split_axis", "split_pos", "child", "count", "indices")


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--cut", type=int, default=0)
    parser.add_argument("--copies", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--ways", nargs="+", default=["numpy", "device"], choices=["numpy", "device"])
    asked = parser.parse_args()
    mesh = _mesh(asked.scene, asked.cut, asked.copies)
    print(f"{len(mesh):,} triangles, {os.getloadavg()[0]:.1f} processes wanted to run")
    device = open_device()
    best: dict[str, tuple[float, float, KdTree]] = {}
    for turn in range(asked.rounds + (asked.rounds > 1)):  # the first of several compiles and is not kept
        for way in asked.ways:
            taken = _timed(mesh, way, device)
            if turn or asked.rounds == 1:
                before = best.get(way, taken)
                best[way] = (min(before[0], taken[0]), min(before[1], taken[1]), taken[2])
    for way, (wall, processor, tree) in best.items():
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
        print(f"{way:7} {wall:8.3f} s  {processor:8.3f} s of processors  {peak:6} MB  {tree.node_count:,} nodes, depth {tree.depth}")
    trees = [tree for _, _, tree in best.values()]
    if any(not np.array_equal(getattr(tree, name), getattr(trees[0], name)) for tree in trees for name in _ARRAYS):
        raise SystemExit("the trees differ")


def _timed(mesh: F64, way: str, device: Device) -> tuple[float, float, KdTree]:
    os.environ[choose.VARIABLE] = way
    wall, processor = time.perf_counter(), time.process_time()
    (tree,), _ = choose.build_trees([mesh], np.zeros((1, 3)), "sah", device)
    return time.perf_counter() - wall, time.process_time() - processor, tree


def _mesh(scene: Path, cut: int, copies: int) -> F64:
    """The scene's largest object, cut and repeated."""
    mesh = max((item.vertices for item in load_scene(scene).objects), key=len)
    for _ in range(cut):
        a, b, c = mesh[:, 0], mesh[:, 1], mesh[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        mesh = np.concatenate([np.stack(corners, axis=1) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    aside = np.array([1.1 * np.ptp(mesh[:, :, 0]), 0, 0])
    return np.ascontiguousarray(np.concatenate([mesh + i * aside for i in range(copies)]))


if __name__ == "__main__":
    main()
