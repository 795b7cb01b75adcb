"""What a RayCaster takes and what it refuses: layouts and types of rays, forms of meshes. Results never depend on the layout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction as F
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.errors import ClrtError, MeshError, RayError
from clrt.generate import uv_sphere
from clrt.ray_mesh import at_unit_size, scene_of, surface_normals
from clrt.scene.model import Scene, Spheres

VERTICES, FACES = uv_sphere(60)
QUAD = (np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
Array = NDArray[Any]


@pytest.fixture(scope="module")
def caster() -> clrt.RayCaster:
    return clrt.RayCaster((VERTICES, FACES))


@pytest.fixture(scope="module")
def rays() -> tuple[Array, Array]:
    """Rays of which float16 and small integers hold every number: halves in [-2, 2], whole directions."""
    rng = np.random.default_rng(1)
    return rng.integers(-4, 5, (40, 3)) / 2.0, rng.integers(-3, 4, (40, 3)).astype(np.float64)


def read_only(a: Array) -> Array:
    copy = a.copy()
    copy.setflags(write=False)
    return copy


class Table:
    """A foreign object that knows how to become an array, as those of pandas do."""

    def __init__(self, values: Array) -> None:
        self.values = values

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return self.values if dtype is None else self.values.astype(dtype)


LAYOUTS: dict[str, Callable[[Array], Any]] = {
    "float32": lambda a: a.astype(np.float32),
    "float16": lambda a: a.astype(np.float16),
    "big-endian": lambda a: a.astype(">f8"),
    "fortran": np.asfortranarray,
    "every other row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "wider rows": lambda a: np.hstack([a, a])[:, :3],
    "backward": lambda a: a[::-1].copy()[::-1],
    "columns backward": lambda a: a[:, ::-1].copy()[:, ::-1],
    "unaligned": lambda a: np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(np.float64).reshape(a.shape),
    "read-only": read_only,
    "list": lambda a: a.tolist(),
    "rows": list,
    "masked, nothing hidden": lambda a: np.ma.masked_array(a, mask=False),
    "foreign": Table,
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_hits_are_the_same_bits_for_any_layout(caster: clrt.RayCaster, rays: tuple[Array, Array], layout: str) -> None:
    expected = caster.first_hit(*rays)
    assert 0 < np.count_nonzero(expected["prim_id"] >= 0) < len(expected)
    change = LAYOUTS[layout]
    assert caster.first_hit(change(rays[0]), change(rays[1])).tobytes() == expected.tobytes()


@pytest.mark.parametrize("dtype", [np.int8, np.int32, np.int64, np.uint64])
def test_whole_numbers_count_as_float64(caster: clrt.RayCaster, dtype: type[np.integer[Any]]) -> None:
    origins, directions = np.array([[0, 0, 0], [3, 0, 0], [0, 5, 0]]), np.array([[1, 2, 3], [1, 0, 0], [0, 7, 1]])
    expected = caster.first_hit(origins.astype(np.float64), directions.astype(np.float64))
    assert caster.first_hit(origins.astype(dtype), directions.astype(dtype)).tobytes() == expected.tobytes()


def test_numbers_keep_all_digits_of_float64(caster: clrt.RayCaster) -> None:
    """A limit of one float64 step more or less decides: nothing was rounded to float32 on the way."""
    quad = clrt.RayCaster(QUAD)
    start, step = np.array([[0.25, 0.5, -(1.0 + 2.0**-40)]]), np.array([[0.0, 0.0, 1.0]])
    t = 1.0 + 2.0**-40
    assert quad.any_hit(start, step, t_max=np.nextafter(t, 2.0)).tolist() == [True]
    assert quad.any_hit(start, step, t_max=t).tolist() == [False]
    assert quad.first_hit(start, step)["t"].tolist() == [t]


@pytest.mark.parametrize(
    ("origins", "directions", "shape"),
    [
        ((3,), (3,), (1,)), ((3,), (5, 3), (5,)), ((5, 3), (3,), (5,)), ((1, 3), (5, 3), (5,)), ((0, 3), (3,), (0,)),
        ((0, 3), (0, 3), (0,)), ((4, 5, 3), (3,), (4, 5)), ((4, 1, 3), (5, 3), (4, 5)), ((2, 3), (2, 3), (2,)),
    ],
)  # fmt: skip
def test_results_have_the_shape_of_the_rays(
    caster: clrt.RayCaster, origins: tuple[int, ...], directions: tuple[int, ...], shape: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(2)
    o, d = rng.normal(size=origins) / 4, rng.normal(size=directions)
    hits = caster.first_hit(o, d)
    assert hits.shape == caster.any_hit(o, d).shape == caster.count_hits(o, d).shape == shape
    flat = caster.first_hit(np.broadcast_to(o, (*shape, 3)).reshape(-1, 3), np.broadcast_to(d, (*shape, 3)).reshape(-1, 3))
    assert hits.tobytes() == flat.tobytes()


def test_no_rays_give_no_hits(caster: clrt.RayCaster) -> None:
    assert caster.first_hit([], []).shape == caster.any_hit([], [[0, 0, 1]]).shape == (0,)
    assert caster.counters["rays"] == 0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((4, 2)), r"origins: expected an array of shape \(n, 3\), found \(4, 2\)"),
        (np.zeros((3, 4)), r"origins: .*\(3, 4\)"),
        (1.0, r"origins: .*\(\)"),
        (np.zeros((4, 3), np.longdouble), "origins: .* would lose digits"),
        (np.full((4, 3), 2**53 + 1), r"origins: integers beyond 2\^53"),
        (np.full((4, 3), -(2**62)), r"origins: integers beyond 2\^53"),
        (np.zeros((4, 3), complex), "origins: expected real numbers.*complex128"),
        (np.zeros((4, 3), bool), "origins: expected real numbers.*bool"),
        (np.zeros((4, 3), object), "origins: expected real numbers.*objects"),
        ([[0, 0, None]] * 4, "origins: expected real numbers.*objects"),
        ([["0", "0", "0"]] * 4, "origins: expected real numbers"),
        ([[0.0, 0.0], [0.0, 0.0, 0.0]], "origins: not a rectangular array"),
        (np.zeros(4, "M8[s]"), "origins: expected real numbers"),
        (np.ma.masked_array(np.zeros((4, 3)), mask=np.eye(4, 3)), "origins: 3 elements are masked"),
        (None, "origins: expected real numbers"),
    ],
)
def test_unusable_rays_are_refused_by_name(caster: clrt.RayCaster, values: Any, message: str) -> None:
    for call in (caster.first_hit, caster.any_hit, caster.count_hits):
        with pytest.raises(RayError, match=message):
            call(values, np.ones((4, 3)))
    with pytest.raises(ValueError, match=message.replace("origins:", "directions:")):
        caster.first_hit(np.ones((4, 3)), values)


def test_unequal_numbers_of_origins_and_directions_are_refused(caster: clrt.RayCaster) -> None:
    with pytest.raises(RayError, match=r"origins and directions: shapes \(5, 3\) and \(4, 3\) do not go together"):
        caster.first_hit(np.zeros((5, 3)), np.ones((4, 3)))


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        (np.zeros(3), r"t_max: expected a number or an array of shape \(4,\).*\(3,\)"),
        (np.zeros((4, 1)), r"t_max: .*\(4, 1\)"),
        ("far", "t_max: expected real numbers"),
        (None, "t_max: expected real numbers"),
        (np.longdouble(1), "t_max: .* would lose digits"),
        (np.ma.masked_array([1.0, 2, 3, 4], mask=[0, 0, 1, 0]), "t_max: 1 elements are masked"),
    ],
)
def test_unusable_limits_are_refused_by_name(caster: clrt.RayCaster, limit: Any, message: str) -> None:
    with pytest.raises(RayError, match=message):
        caster.first_hit(np.zeros((4, 3)), np.ones((4, 3)), t_max=limit)
    with pytest.raises(RayError, match=message.replace("t_max", "t_min")):
        caster.any_hit(np.zeros((4, 3)), np.ones((4, 3)), t_min=limit)


def test_what_a_call_is_given_stays_as_it_was(caster: clrt.RayCaster, rays: tuple[Array, Array]) -> None:
    origins, directions = rays[0].copy(), rays[1].copy()
    caster.first_hit(origins, directions)
    assert (origins == rays[0]).all()
    assert (directions == rays[1]).all()


MESHES: dict[str, Any] = {
    "pair": QUAD,
    "pair of lists": (QUAD[0].tolist(), QUAD[1].tolist()),
    "float32, uint32": (QUAD[0].astype(np.float32), QUAD[1].astype(np.uint32)),
    "pair of tuples": (tuple(map(tuple, QUAD[0])), tuple(map(tuple, QUAD[1]))),
    "whole vertices": (QUAD[0].astype(int), QUAD[1]),
    "fortran": (np.asfortranarray(QUAD[0]), np.asfortranarray(QUAD[1])),
    "triangles": QUAD[0][QUAD[1]],
    "triangles, float32": QUAD[0][QUAD[1]].astype(np.float32),
    "triangles, nested lists": QUAD[0][QUAD[1]].tolist(),
    "object with faces": SimpleNamespace(vertices=QUAD[0], faces=QUAD[1]),
    "object with triangles": SimpleNamespace(vertices=Table(QUAD[0]), triangles=Table(QUAD[1])),
    "list of one pair": [QUAD],
    "with a vertex no face uses, which is NaN": (np.vstack([QUAD[0], [[np.nan] * 3]]), QUAD[1]),
}


@pytest.mark.parametrize("form", MESHES)
def test_hits_are_the_same_bits_for_any_form_of_mesh(form: str) -> None:
    rng = np.random.default_rng(3)
    origins, directions = rng.uniform(-1.2, 1.2, (30, 3)), rng.normal(size=(30, 3))
    expected = clrt.RayCaster(QUAD).first_hit(origins, directions)
    assert 0 < np.count_nonzero(expected["prim_id"] >= 0) < 30
    assert clrt.RayCaster(MESHES[form]).first_hit(origins, directions).tobytes() == expected.tobytes()


def test_trimesh_meshes_are_meshes() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((2.0, 4.0, 6.0))
    origins, directions = np.zeros(3), np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]])
    assert clrt.RayCaster(box).first_hit(origins, directions)["t"].tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(MeshError, match="to_mesh"):
        clrt.RayCaster(trimesh.Scene(box))


@pytest.mark.parametrize(
    "parts", [[QUAD, (VERTICES, FACES)], (QUAD, (VERTICES, FACES)), [QUAD, SimpleNamespace(vertices=VERTICES, faces=FACES)]]
)
def test_every_part_of_a_list_is_an_object(parts: Any) -> None:
    caster = clrt.RayCaster(parts)
    assert caster.first_prims.tolist() == [0, 2]
    # From z = -3: the sphere (radius 1) is met before the quad in z = 0, which shows beside it.
    hits = caster.first_hit([[0.01, 0.02, -3.0], [0.95, 0.9, -3.0], [5.0, 0, 0]], [0.0, 0.0, 1.0])
    assert hits["object_id"].tolist() == [1, 0, -1]
    assert hits["prim_id"][0] >= 2
    assert hits["prim_id"][1] in (0, 1)


NO_TRIANGLES: dict[str, Any] = {
    "pair": (np.zeros((0, 3)), np.zeros((0, 3), int)),
    "vertices without faces": (VERTICES, np.zeros((0, 3), int)),
    "lists": ([], []),
    "triangles": np.zeros((0, 3, 3)),
    "list": [],
}


@pytest.mark.parametrize("form", NO_TRIANGLES)
def test_every_ray_misses_a_mesh_without_triangles(form: str) -> None:
    caster = clrt.RayCaster(NO_TRIANGLES[form])
    hits = caster.first_hit(np.zeros((5, 3)), np.ones((5, 3)))
    assert np.isposinf(hits["t"]).all()
    assert (hits["prim_id"] == -1).all()
    assert not caster.any_hit(np.zeros((5, 3)), np.ones((5, 3))).any()
    assert not caster.count_hits(np.zeros((5, 3)), np.ones((5, 3))).any()


def test_an_object_without_triangles_keeps_its_number() -> None:
    caster = clrt.RayCaster([NO_TRIANGLES["pair"], QUAD, NO_TRIANGLES["pair"], (QUAD[0] + [0, 0, 1], QUAD[1])])
    hits = caster.first_hit([[0.1, 0.2, -1.0], [0.1, 0.2, 0.5]], [0.0, 0, 1])
    assert hits["object_id"].tolist() == [1, 3]
    assert (hits["prim_id"] - caster.first_prims[hits["object_id"]]).tolist() == [1, 1]


def spoilt(array: Array, place: tuple[int, ...], value: float) -> Array:
    copy = array.copy()
    copy[place] = value
    return copy


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        ((spoilt(VERTICES, (int(FACES[7, 1]), 2), np.nan), FACES[7:8]), r"mesh: face 0 is not finite.*nan"),
        ((spoilt(QUAD[0], (3, 0), np.inf), QUAD[1]), r"mesh: face 1 is not finite.*inf"),
        (spoilt(QUAD[0][QUAD[1]], (1, 2, 0), -np.inf), r"mesh: triangle 1 is not finite"),
        ([QUAD, (spoilt(QUAD[0], (0, 0), np.nan), QUAD[1])], r"mesh 2 of 2: face 0 \(and 1 more\) is not finite"),
        ((QUAD[0], [[0, 1, 4]]), "face 0 asks for vertex 4"),
        ((QUAD[0], [[0, 1, -1]]), "face 0 asks for vertex -1"),
        ((QUAD[0], QUAD[1].astype(float)), "faces hold float64"),
        ((QUAD[0], np.zeros((2, 4), int)), r"faces have the shape \(2, 4\)"),
        ((QUAD[0][:, :2], QUAD[1]), r"vertices have the shape \(4, 2\)"),
        ((QUAD[0].astype(np.longdouble), QUAD[1]), "mesh: vertices: .* would lose digits"),
        ((np.ma.masked_array(QUAD[0], mask=np.eye(4, 3)), QUAD[1]), "mesh: vertices: 3 elements are masked"),
        ((QUAD[0].astype(object), QUAD[1]), "mesh: vertices: .*objects"),
        ((QUAD[0], QUAD[1].astype(bool)), "mesh: faces: .*bool"),
        (list(QUAD), "as a tuple"),
        ([QUAD[0].tolist(), QUAD[1].tolist()], "as a tuple"),
        ([QUAD[0][:3], QUAD[1][[0, 0, 0]]], "as a tuple"),
        ([[*QUAD[0], [0, 0]], QUAD[1]], "not a rectangular array"),
        (np.zeros((4, 3)), r"expected a Scene, .* of shape \(4, 3\)"),
        ("bunny.ply", "load_mesh"),
        (42, "expected a Scene"),
        (None, "expected a Scene"),
    ],
)
def test_unusable_meshes_are_refused_by_name(mesh: Any, message: str | None) -> None:
    with pytest.raises(MeshError, match=message):
        clrt.RayCaster(mesh)


def test_unknown_precision_and_device_are_refused() -> None:
    with pytest.raises(ClrtError, match="no precision 'sharp'"):
        clrt.RayCaster(QUAD, precision="sharp")
    with pytest.raises(clrt.DeviceError, match="no OpenCL device is called 'abacus'"):
        clrt.RayCaster(QUAD, device="abacus")


def test_scenes_bring_their_ids_and_leave_out_spheres() -> None:
    two = scene_of([QUAD, (VERTICES + np.array([0.0, 0, 5]), FACES)])
    scene = Scene(two.camera, (), two.materials, two.objects, Spheres(np.array([[0.0, 0, -2]]), np.array([0.5]), np.zeros(1, np.int32)))
    hits = clrt.RayCaster(scene).first_hit([[0.3, 0.1, -4.0], [0.1, 0.2, 1.0]], [0.0, 0, 1])
    assert hits["object_id"].tolist() == [0, 1]
    assert hits["t"][0] == 4.0
    bad = replace(two.objects[0], vertices=spoilt(two.objects[0].vertices, (1, 0, 0), np.nan))
    with pytest.raises(MeshError, match="triangle 1 is not finite"):
        clrt.RayCaster(replace(scene, objects=(bad,)))


def test_flat_triangles_are_counted_in_a_warning() -> None:
    """Collinear corners in float64 that no axis helps: only exact arithmetic tells them from a needle."""
    line = np.array([[0.0, 0, 0], [0.1, 0.3, 0.7], [0.2, 0.6, 1.4]])
    needle = line.copy()
    needle[2, 0] = np.nextafter(0.2, 1.0)
    assert scene_of(line[None]).warnings == ("1 triangle has zero area and is never hit (the first: mesh, face 0)",)
    assert scene_of(needle[None]).warnings == ()
    many = np.concatenate([needle[None], np.repeat(line[None], 60, 0)])
    assert scene_of(many).warnings == ("60 triangles have zero area and are never hit (the first: mesh, face 1)",)


def test_normals_of_needles_are_those_of_exact_arithmetic() -> None:
    rng = np.random.default_rng(4)
    needles = rng.normal(size=(30, 3, 3)) * 10.0 ** rng.integers(-12, 13, (30, 1, 1))
    needles[:, 2] = needles[:, 0] * 0.75 + needles[:, 1] * 0.25  # on the edge, but for rounding
    needles[::3, 2] *= 1 + 1e-9
    for corners, normal in zip(needles, surface_normals(needles), strict=True):
        a, b, c = ([F(x) for x in corner.tolist()] for corner in corners)
        e1, e2 = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
        cross = [e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]]
        largest = max(map(abs, cross))
        expected = np.array([float(x / largest) for x in cross]) if largest else np.zeros(3)
        expected /= np.linalg.norm(expected) or 1.0
        assert np.abs(normal - expected).max() < 2.0**-22


@pytest.mark.parametrize("exponent", [-900, -30, 0, 30, 900])
def test_unit_size_rounds_nothing(exponent: int) -> None:
    scene = scene_of((np.ldexp(VERTICES, exponent), FACES))
    unit, scale = at_unit_size(scene)
    assert (unit.objects[0].vertices == scene.objects[0].vertices * scale).all()
    sides = np.ptp(unit.objects[0].vertices.reshape(-1, 3), axis=0)
    assert 0.5 <= sides.max() < 1.0


def test_sizes_beyond_the_range_of_float64_are_refused() -> None:
    with pytest.raises(MeshError, match="times smaller than the mesh"):
        clrt.RayCaster(np.array([[[1e300, 0, 0], [0, 1e300, 0], [0, 0, 5e-324]]]))
