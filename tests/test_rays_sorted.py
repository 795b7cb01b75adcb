"""Large batches are sorted on the device, and blocks of triangles are tested by vectors of any width: no bit of an answer may tell."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from ray_meshes import MESHES

import clrt
from clrt.device import program, ray_sort
from clrt.generate import rabbit_like
from clrt.precision import RUNGS, Precision
from clrt.ray_arrays import RayArrays

Array = NDArray[Any]


def scattered(count: int, seed: int) -> tuple[Array, Array]:
    """Rays in and about the unit box in all directions; some are no rays: NaN, infinite, without direction, far away."""
    rng = np.random.default_rng(seed)
    origins, directions = rng.uniform(-1.2, 1.2, (count, 3)), rng.normal(size=(count, 3))
    for table, value in (
        (origins, np.nan),
        (directions, np.nan),
        (origins, np.inf),
        (directions, -np.inf),
        (directions, 0.0),
        (origins, 1e20),
    ):
        rows = rng.integers(0, count, max(1, count // 50))
        table[rows, rng.integers(0, 3, len(rows))] = value
    directions[rng.integers(0, count, count // 50)] = 0.0
    directions[: count // 20] *= 1e-200
    return origins, directions


@pytest.fixture(scope="module")
def caster() -> clrt.RayCaster:
    return clrt.RayCaster(rabbit_like(1000), precision="watertight")


def sorted_order(caster: clrt.RayCaster, rays: RayArrays) -> Array:
    import pyopencl as cl

    order = np.empty(len(rays), np.int32)
    cl.enqueue_copy(caster._device.queue, order, caster._sorter.order(caster._load(rays, slice(0, len(rays))), len(rays)))
    return order


def keys(caster: clrt.RayCaster, origins: Array, directions: Array) -> Array:
    """Octant, then the interleaved bits of the cell of a cube's grid over the mesh, for rays without a NaN."""
    corners = np.concatenate([item.vertices.reshape(-1, 3) for item in caster.scene.objects])
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    cells = 1 << program.SORT_BITS
    place = np.clip((origins - lo) * (cells / (hi - lo).max()), 0, cells - 1).astype(int)
    key = (directions < 0) @ [1, 2, 4]
    for bit in reversed(range(program.SORT_BITS)):
        key = 8 * key + ((place >> bit) & 1) @ [1, 2, 4]
    return np.asarray(key)


@pytest.mark.parametrize("count", [1, 15, 17, 1000, 20_000])
def test_sorted_rays_are_a_permutation_with_keys_in_order(caster: clrt.RayCaster, count: int) -> None:
    rng = np.random.default_rng(count)
    origins, directions = rng.uniform(-1.2, 1.2, (count, 3)), rng.normal(size=(count, 3))
    order = sorted_order(caster, RayArrays.of(origins, directions, 0.0, np.inf))
    assert (np.sort(order) == np.arange(count)).all()
    expected = keys(caster, origins, directions)
    assert (order == np.argsort(expected, kind="stable")).all()


def test_rays_that_are_none_are_sorted_too(caster: clrt.RayCaster) -> None:
    order = sorted_order(caster, RayArrays.of(*scattered(3000, 1), 0.0, np.inf))
    assert (np.sort(order) == np.arange(3000)).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("rung", list(RUNGS))
def test_sorted_and_unsorted_answers_are_the_same_bits(rung: str, dtype: type[np.floating], monkeypatch: pytest.MonkeyPatch) -> None:
    caster = clrt.RayCaster(rabbit_like(1000), precision=rung)
    with np.errstate(over="ignore", under="ignore"):
        origins, directions = (a.astype(dtype) for a in scattered(6000, 2))
    limits = np.random.default_rng(3).uniform(0.1, 3.0, 6000)
    limits[::7] = np.nan
    answers: list[list[bytes]] = []
    for fewest in (1 << 30, 1):
        monkeypatch.setattr("clrt.rays.FEWEST", fewest)
        calls = (caster.first_hit, caster.any_hit, caster.count_hits)
        answers.append([call(origins, directions, -0.1, limits).tobytes() for call in calls])
        answers[-1].append(str(caster.counters).encode())
        answers[-1] += [part.tobytes() for part in caster.all_hits(origins, directions, -0.1, limits)]
    assert answers[0] == answers[1]
    assert np.count_nonzero(caster.first_hit(origins, directions)["prim_id"] >= 0) > 300


def test_a_batch_large_enough_is_sorted_by_itself(caster: clrt.RayCaster, monkeypatch: pytest.MonkeyPatch) -> None:
    origins, directions = scattered(ray_sort.FEWEST, 4)
    asked: list[int] = []
    order = caster._sorter.order

    def counted(given: Any, count: int) -> Any:
        asked.append(count)
        return order(given, count)

    monkeypatch.setattr(caster._sorter, "order", counted)
    whole = caster.first_hit(origins, directions)
    assert caster.first_hit(origins[:-1], directions[:-1]).tobytes() == whole[:-1].tobytes()
    assert asked == [ray_sort.FEWEST]


def view(side: int, spread: float) -> tuple[Array, Array]:
    """Rays of a camera, row by row, whose origins are strewn about the eye."""
    rng = np.random.default_rng(6)
    across, down = np.meshgrid(*2 * [np.linspace(-0.7, 0.7, side)])
    directions = np.stack([across, down, np.full_like(across, -2.0)], axis=-1).reshape(-1, 3)
    return np.array([0.0, 0.0, 3.0]) + spread * rng.normal(size=directions.shape), directions


@pytest.mark.parametrize("spread", [0.0, 1e-3, 0.05])
@pytest.mark.parametrize("name", ["rabbit", "sphere", "grid on a lattice"])
@pytest.mark.parametrize("rung", list(RUNGS))
def test_neighbours_that_are_traced_as_a_bundle_answer_as_alone(rung: str, name: str, spread: float) -> None:
    """In their order, rays of a camera form bundles; dealt out at random, they do not."""
    casters = clrt.RayCaster(MESHES[name](), precision=rung)
    origins, directions = view(120, spread)  # 32 rays in a row spread by less than bundle.cl allows
    origins[1000], directions[2000], directions[3000] = np.nan, 0.0, [0.0, 0.0, 1.0]
    dealt = np.random.default_rng(7).permutation(len(origins))
    for call in (casters.first_hit, casters.any_hit):
        alone = call(origins[dealt], directions[dealt])
        assert call(origins, directions)[dealt].tobytes() == alone.tobytes()
    assert np.count_nonzero(casters.any_hit(origins, directions)) > 100


def test_rays_of_a_camera_are_in_order_and_scattered_ones_are_not() -> None:
    assert ray_sort.in_order_already(*view(200, 0.0), 1.0)
    assert ray_sort.in_order_already(*view(200, 1e-3), 1.0)
    assert not ray_sort.in_order_already(*view(200, 1.0), 1.0)
    assert not ray_sort.in_order_already(*scattered(40_000, 8), 1.0)
    assert not ray_sort.in_order_already(np.full((40_000, 3), np.nan), np.full((40_000, 3), np.nan), 1.0)


@pytest.mark.matrix(keep=3)
@pytest.mark.parametrize("without", ["__AVX512DQ__", "__AVX__"])
@pytest.mark.parametrize("width", [4, 8, 16])
@pytest.mark.parametrize("rung", ["exact", "double"])
def test_blocks_of_any_width_without_instructions_of_their_own_answer_the_same(
    rung: str, width: int, without: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The portable text of blocks.cl, which other processors compile, against the one for this machine."""
    mesh, (origins, directions) = rabbit_like(1000), scattered(3000, 5)
    expected = clrt.RayCaster(mesh, precision=rung).first_hit(origins, directions)
    compose = program.compose
    monkeypatch.setattr(program, "compose", lambda *a, **k: f"#undef __AVX512DQ__\n#undef {without}\n" + compose(*a, **k))
    monkeypatch.setattr(Precision, "lanes", lambda self, float_lanes: width)
    caster = clrt.RayCaster(mesh, precision=rung)
    assert caster.first_hit(origins, directions).tobytes() == expected.tobytes()
    assert caster.any_hit(*view(50, 0.0)).tolist() == [t < np.inf for t in caster.first_hit(*view(50, 0.0))["t"]]
