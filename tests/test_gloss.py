"""Rough mirrors and glass: draws against their density, albedos, white furnaces, lights by quadrature, the path reference; wrong lines."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from microfacets import alpha_of, lobe, means, pixel_views, smith_lambda
from ztest import assert_same, chi_square, chi_square_p, device_batches

import clrt
from clrt.device.context import Device
from clrt.device.ggx_albedo import lobe_albedo, lobe_table
from clrt.device.ggx_glass import glass_albedo, glass_row, index_ratios
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.reference.paths import render_paths
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Scene
from clrt.verify import probe

SCENES = Path(__file__).parents[1] / "scenes"
HEAD = "E 0 0 -4\nV 0 0 1\nF 24\nR 12 12\nbackground 1 1 1\n"
ROOM = (
    "E 0 0.6 -4\nV 0 -0.1 1\nF 40\nR 10 8\ndepth 3\nbackground 0.3 0.5 0.8\n"
    "M 0 0 0 0 0 0 1 0\narealight 6 5 4\nT -1 2.5 0 1 2.5 0 0 2.5 1.5\nO\n"
    "M 0.8 0.7 0.6 0.1 0.7 0.2 5 0\nT -6 -1 6 6 -1 6 6 -1 -6\nT -6 -1 6 6 -1 -6 -6 -1 -6\n"
)
BALLS = "S -0.8 0 0 1\nS 1.2 -0.2 0.4 0.8\n"
MEAN = re.compile(r"^# mean \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", re.MULTILINE)

_DRAW = """
kernel void probe_ggx(global const real *albedos, global const real *view, global const real *u, global const real *v,
                      global const real *rough, global real *facet, global real *out, global real *pdf, global real *kept,
                      global real *again) {
    const int i = get_global_id(0) * LANES;
    real_n normal[3] = {(real_n)0, (real_n)0, (real_n)1}, direction[3], m[3], way[3], back[3], chance, met;
    for (int a = 0; a < 3; a++) direction[a] = -load_lanes(view + a * get_global_size(0) * LANES + i);
    Facets facets;
    ggx_begin(albedos, normal, direction, load_lanes(rough + i), &facets);
    ggx_draw(&facets, load_lanes(u + i), load_lanes(v + i), m);
    ggx_mirrored(&facets, m, way);
    ggx_world(&facets, way, back);
    normalize_n(back);
    ggx_lobe(&facets, ggx_density(m[2], m[0] * m[0] + m[1] * m[1], facets.alpha), max_n(back[2], (real_n)1e-6f), &chance);
    store_lanes(chance, pdf + i);
    store_lanes(ggx_kept(&facets, max_n(back[2], (real_n)0)), kept + i);
    ggx_lobe(&facets, ggx_met(&facets, direction, back, &met), max_n(back[2], (real_n)1e-6f), &chance);
    store_lanes(chance, again + i);
    for (int a = 0; a < 3; a++) {
        ggx_world(&facets, m, way);
        store_lanes(way[a], facet + a * get_global_size(0) * LANES + i);
        store_lanes(back[a], out + a * get_global_size(0) * LANES + i);
    }
}
"""


def drawn(
    view: np.ndarray, roughness: np.ndarray | float, count: int, precision: str = "watertight", seed: int = 1
) -> dict[str, np.ndarray]:
    """Draws of ggx.cl about +z for `view` (3,) or (count, 3), at most 2^15 in one launch."""
    if count > 1 << 15:
        parts = [drawn(view, roughness, 1 << 15, precision, seed + i) for i in range(count >> 15)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    real, rng = rung(precision).real, np.random.default_rng(seed)
    items = count // probe.lanes_of(None, precision)
    u, v = rng.random((2, count)).astype(np.float32)
    u, v = np.minimum(u, 1 - 2.0**-24).astype(real), np.minimum(v, 1 - 2.0**-24).astype(real)
    arrays = [
        lobe_table().astype(real), np.ascontiguousarray(np.broadcast_to(view, (count, 3)).T.astype(real)), u, v,
        np.broadcast_to(np.asarray(roughness, real), (count,)).copy(),
        np.zeros((3, count), real), np.zeros((3, count), real), np.zeros(count, real), np.zeros(count, real), np.zeros(count, real),
    ]  # fmt: skip
    probe.run(_DRAW, "probe_ggx", items, arrays, device=None, precision=precision, files=(), effects=("facets",))
    return {"facet": arrays[5].T, "out": arrays[6].T, "pdf": arrays[7], "kept": arrays[8], "again": arrays[9]}


def direction(cosine: float) -> np.ndarray:
    return np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])


@pytest.mark.parametrize("cosine", [1.0, 0.6, 0.05])
@pytest.mark.parametrize("roughness", [0.15, 0.5, 1.0])
def test_facets_are_drawn_with_the_density_of_the_visible_ones(device: Device, cosine: float, roughness: float) -> None:
    """Chi-square over cells of facet normals, of D G1 max(o.m, 0) / o_z, by midpoints within each cell."""
    count, alpha, view = 1 << 17, alpha_of(roughness), direction(cosine)
    m = drawn(view, roughness, count)["facet"].astype(np.float64)
    # Cells of the azimuth and of 1 - sqrt(1 - r), r the squared slope's rank under D cos: steep facets, seen when grazing, fill cells.
    q = (m[:, 0] ** 2 + m[:, 1] ** 2) / m[:, 2] ** 2
    rank, phi = 1 - alpha / np.sqrt(q + alpha**2), np.arctan2(m[:, 1], m[:, 0]) / (2 * np.pi) + 0.5
    counts = np.histogram2d(rank, phi, (24, 24), ((0, 1), (0, 1)))[0].astype(np.int64)
    fine = 24 * 24
    part, turn = (np.arange(fine) + 0.5) / fine, 2 * np.pi * ((np.arange(fine) + 0.5) / fine - 0.5)
    tangent = alpha * np.sqrt(1 / (1 - part) ** 2 - 1)[:, None]
    z = 1 / np.sqrt(1 + tangent**2)
    met = np.maximum(z * (view[2] + view[0] * tangent * np.cos(turn)), 0.0)
    g1 = 1.0 / (1.0 + smith_lambda(np.asarray(cosine), alpha))
    chance = g1 * met / (cosine * z) * 2 * (1 - part)[:, None] / fine**2
    assert chance.sum() == pytest.approx(1.0, abs=2e-3), "Smith's G1 normalises the visible facets"
    expected = chance.reshape(24, 24, 24, 24).sum((1, 3))
    statistic, freedom = chi_square(counts, expected * (count / expected.sum()))
    assert chi_square_p(statistic, freedom) > 1e-4


@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_density_of_drawn_directions_is_that_of_the_formula(device: Device, precision: str) -> None:
    rng = np.random.default_rng(3)
    count = 4096
    cosine = np.maximum(rng.random(count), 0.02)
    view = np.column_stack([np.sqrt(1 - cosine**2), np.zeros(count), cosine])
    roughness = rng.uniform(0.1, 1.0, count)
    draw = drawn(view, roughness, count, precision)
    seen = draw["out"][:, 2] > 1e-3
    alpha = roughness**2
    m, out = draw["facet"][seen].astype(np.float64), draw["out"][seen].astype(np.float64)
    tangent_2, wide = (m[:, 0] ** 2 + m[:, 1] ** 2) / m[:, 2] ** 2, alpha[seen]
    d = wide**2 / (np.pi * m[:, 2] ** 4 * (wide**2 + tangent_2) ** 2)  # from x and y: z alone, rounded, does not tell small angles
    l_o = np.array([float(smith_lambda(np.asarray(c), a)) for c, a in zip(cosine[seen], alpha[seen], strict=True)])
    l_i = np.array([float(smith_lambda(np.asarray(c), a)) for c, a in zip(out[:, 2], alpha[seen], strict=True)])
    np.testing.assert_allclose(draw["pdf"][seen], d / (1 + l_o) / (4 * cosine[seen]), rtol=2e-3)
    np.testing.assert_allclose(draw["kept"][seen], (1 + l_o) / (1 + l_o + l_i), rtol=2e-4)
    np.testing.assert_allclose(draw["again"][seen], draw["pdf"][seen], rtol=2e-3, err_msg="by the half vector as by the facet")


def test_extreme_roughness_and_grazing_views_give_numbers(device: Device) -> None:
    count = 4096
    rng = np.random.default_rng(5)
    cosine = 10.0 ** rng.uniform(-30, 0, count)
    view = np.column_stack([np.sqrt(1 - cosine**2), np.zeros(count), cosine])
    draw = drawn(view, 10.0 ** rng.uniform(-12, 0, count), count)
    for name, values in draw.items():
        assert np.isfinite(values).all(), name
    assert (draw["kept"] >= 0).all()
    assert (draw["kept"] <= 1.0001).all()
    np.testing.assert_allclose(np.linalg.norm(draw["out"], axis=1), 1.0, rtol=1e-6)


def test_albedo_of_the_lobe_is_its_integral() -> None:
    for roughness in (0.05, 0.3, 0.6, 1.0):
        for cosine in (0.03, 0.3, 0.9, 1.0):
            whole, grazing = means(cosine, alpha_of(roughness))
            albedo, rim = lobe_albedo(np.array([cosine]), np.array([alpha_of(roughness)]))
            assert albedo[0] == pytest.approx(whole, abs=2e-4)
            assert rim[0] == pytest.approx(grazing * whole, abs=2e-4)


def test_table_of_the_albedo_keeps_its_bound() -> None:
    rng = np.random.default_rng(7)
    alpha, place = np.maximum(rng.random(300) ** 2, 1e-4), rng.random(300)
    cosine = np.minimum(place * alpha / (1 + alpha - place), 1.0)
    exact, _ = lobe_albedo(cosine, alpha)
    rows, columns = lobe_table().shape
    u, v = np.sqrt(alpha) * (rows - 1), place * (columns - 1)
    i, j = np.minimum(u.astype(int), rows - 2), np.minimum(v.astype(int), columns - 2)
    a, b, t = u - i, v - j, lobe_table()
    looked_up = (1 - a) * ((1 - b) * t[i, j] + b * t[i, j + 1]) + a * ((1 - b) * t[i + 1, j] + b * t[i + 1, j + 1])
    assert np.abs(looked_up - exact).max() < 4.5e-4


@pytest.mark.parametrize("fresnel", [True, False], ids=["fresnel", "constant"])
@pytest.mark.parametrize("ratio", [1 / 1.5, 1.5])
def test_albedo_of_rough_glass_is_the_mean_over_facets(ratio: float, fresnel: bool) -> None:
    """Against facets drawn in another way: by D cos, each weighted by what of it is seen."""
    steps = 700
    part, phi = (np.arange(steps) + 0.5) / steps, (np.arange(steps) + 0.5) / steps * np.pi
    for alpha in (0.1, 0.5):
        for cosine in (0.2, 0.6, 0.95):
            tangent = alpha * np.sqrt(1 / (1 - part) ** 2 - 1)[:, None]
            z = 1 / np.sqrt(1 + tangent**2)
            met = z * (cosine + np.sqrt(1 - cosine**2) * tangent * np.cos(phi))
            seen = met > 0
            c = np.where(seen, np.minimum(met, 1.0), 1.0)
            k = 1 - ratio**2 * (1 - c**2)
            turned = np.sqrt(np.maximum(k, 0))
            share = (((ratio * c - turned) / (ratio * c + turned)) ** 2 + ((c - ratio * turned) / (c + ratio * turned)) ** 2) / 2
            share = np.where(k < 0, 1.0, share if fresnel else 0.0)
            out, into = 2 * met * z - cosine, ratio * cosine - (ratio * c - turned) * z
            l_o = smith_lambda(np.asarray(cosine), alpha)
            g2 = np.where(out > 0, 1 / (1 + l_o + smith_lambda(np.where(out > 0, out, 1.0), alpha)), 0.0)
            g1 = np.where(into > 0, 1 / (1 + l_o) / (1 + smith_lambda(np.where(into > 0, into, 1.0), alpha)), 0.0)
            expected = np.where(seen, met / (cosine * z) * (share * g2 + (1 - share) * g1) * 2 * (1 - part)[:, None], 0.0).mean()
            assert glass_albedo(np.array([cosine]), alpha, ratio, fresnel)[0] == pytest.approx(expected, abs=2e-3)
            place = cosine * (1 + alpha) / (cosine + alpha)
            row = np.array(glass_row(float(np.sqrt(alpha)), ratio, fresnel))
            assert np.interp(place, np.linspace(0, 1, len(row)), row) == pytest.approx(expected, abs=4e-3)


def test_ratios_of_many_indices_stay_few() -> None:
    assert index_ratios([1.5]).tolist() == pytest.approx([1 / 1.5, 1.0, 1.5])
    many = index_ratios(np.linspace(1.1, 2.4, 40).tolist())
    assert len(many) == 32
    assert (many[0], many[-1]) == pytest.approx((1 / 2.4, 2.4))


def furnace(material: str, depth: int = 5, samples: int = 256) -> tuple[float, float]:
    """Mean, and its standard deviation over seeds, of a ball that fills the picture, light 1 from everywhere."""
    scene = parse_scene(f"{HEAD}depth {depth}\n{material}\nS 0 0 0 1\n")
    means_of = device_batches(scene, samples, range(6)).mean(axis=(1, 2, 3))
    return float(means_of.mean()), float(means_of.std(ddof=1) / np.sqrt(6))


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("roughness", [0.001, 0.05, 0.3, 0.6, 1.0])
def test_white_furnace_rough_mirror_loses_nothing(device: Device, roughness: float) -> None:
    mean, sigma = furnace(f"M 1 1 1 0 0 0 1 1\ngloss {roughness}")
    assert abs(mean - 1.0) < 3.0 * sigma + 4e-4  # and the bound of the table


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("roughness", [0.05, 0.6])
def test_white_furnace_rough_glass_with_fresnel_loses_what_the_depth_cuts_off(device: Device, roughness: float) -> None:
    """Of light inside a ball, 3% go on round it for long where the glass is nearly polished."""
    mean, sigma = furnace(f"M 1 1 1 0 0 0 1 0 1 1.5\ngloss {roughness}\nfresnel", depth=40, samples=64)
    assert -6e-3 < mean - 1.0 < 3.0 * sigma + 2e-3


def test_roughness_zero_is_the_polished_mirror(device: Device) -> None:
    polished = parse_scene(ROOM.replace("arealight 6 5 4", "") + "M 1 1 1 0 0 0 1 0.7\n" + BALLS + "L 0 4 -4\n")
    scene = parse_scene(ROOM.replace("arealight 6 5 4", "") + "M 1 1 1 0 0 0 1 0.7\ngloss 0\n" + BALLS + "L 0 4 -4\n")
    assert "gloss" not in Features.of(scene).effects
    assert np.array_equal(clrt.render(scene).pixels, clrt.render(polished).pixels)


@pytest.mark.slow
def test_nearly_polished_shows_what_the_mirror_shows(device: Device) -> None:
    text = ROOM + "M 0.9 0.8 0.7 0.1 0.4 0.3 20 0.6\nGLOSS\n" + BALLS
    mirror, rough = (parse_scene(text.replace("GLOSS", word)) for word in ("", "gloss 0.001"))
    difference = device_batches(mirror, 64, range(1))[0] - device_batches(rough, 64, range(1))[0]
    assert np.abs(difference).mean() < 8e-3


def expected_gloss(scene: Scene, column: int, row: int, steps: int = 4, nodes: int = 24) -> float:
    """What the floor of scenes/gloss.txt shows in a pixel: the lobe over the cones of the balls, by midpoints."""
    total = 0.0
    for d in pixel_views(scene, column, row, steps):
        point = scene.camera.eye - d * scene.camera.eye[1] / d[1]
        alpha = alpha_of((0.0, 0.15, 0.3, 0.5, 0.8)[int(np.floor(point[0] + 2.5))])
        view = np.array([-d[0], -d[2], -d[1]])  # z up
        whole = means(float(view[2]), alpha, 100)[0]
        for center, radius in zip(scene.spheres.centers, scene.spheres.radii, strict=True):
            axis = center - point
            distance = np.linalg.norm(axis)
            axis = axis / distance
            cone = 1.0 - np.sqrt(1.0 - (radius / distance) ** 2)
            c, phi = 1.0 - (np.arange(nodes) + 0.5) / nodes * cone, (np.arange(nodes) + 0.5) / nodes * 2 * np.pi
            side = np.cross(axis, [0.0, 0.0, 1.0])
            side /= np.linalg.norm(side)
            up = np.cross(axis, side)
            s = np.sqrt(1 - c**2)[:, None, None]
            light = c[:, None, None] * axis + s * (np.cos(phi)[:, None] * side + np.sin(phi)[:, None] * up)
            value, _ = lobe(view, light[..., [0, 2, 1]], alpha)
            total += 0.5 * 6.0 * float(value.mean()) * 2 * np.pi * cone / whole
    return total / steps**2


def test_scene_comment_holds_by_quadrature_and_on_the_device(device: Device) -> None:
    scene = load_scene(SCENES / "gloss.txt")
    found = MEAN.findall((SCENES / "gloss.txt").read_text())
    assert len(found) == 4
    pictures = device_batches(scene, 48, range(6))
    for c, r, *color in found:
        column, row, value = int(c), int(r), float(color[0])
        assert expected_gloss(scene, column, row) == pytest.approx(value, rel=4e-3)
        seen = pictures[:, row, column, 0]
        assert abs(seen.mean() - value) < 4.0 * seen.std(ddof=1) / np.sqrt(6) + 3e-3 * value


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(
    "material",
    ["M 0.9 0.8 0.7 0.1 0.4 0.3 20 0.6\ngloss 0.4", "M 0.9 0.8 0.7 0 0.1 0 20 0.2 0.7 1.5\ngloss 0.4",
     "M 0.9 0.8 0.7 0 0.1 0 20 0 0.9 1.5\nfresnel\ngloss 0.6"],
    ids=["mirror", "glass", "fresnel"],
)  # fmt: skip
def test_picture_is_that_of_the_path_reference(device: Device, material: str) -> None:
    """An area light, a floor, two balls that show each other."""
    scene = parse_scene(ROOM + material + "\n" + BALLS)
    reference = render_paths(scene, 600, 11)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


@pytest.mark.slow
def test_indirect_light_and_gloss_together_are_those_of_the_path_reference(device: Device) -> None:
    scene = parse_scene(ROOM + "indirect\nM 0.9 0.8 0.7 0.1 0.4 0.3 20 0.6\ngloss 0.3\n" + BALLS)
    reference = render_paths(scene, 600, 13)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


def test_lone_mirror_without_gloss_draws_nothing(device: Device) -> None:
    scene = parse_scene(HEAD + "M 1 1 1 0 0 0 1 0.5\nS 0 0 0 1\n")
    assert not {"gloss", "facets"} & {f.name for f in Features.of(scene).active}


def test_gloss_without_a_bounce_is_not_called_for() -> None:
    scene = parse_scene(HEAD + "depth 0\nM 1 1 1 0 0 0 1 0.5\ngloss 0.5\nS 0 0 0 1\n")
    assert "gloss" not in Features.of(scene).effects


def test_same_picture_whatever_the_launches(device: Device) -> None:
    scene = replace(parse_scene(ROOM + "M 0.9 0.8 0.7 0.1 0.4 0.3 20 0.6\ngloss 0.4\n" + BALLS), samples=8)
    first = clrt.render(scene).pixels
    assert np.array_equal(first, clrt.render(scene).pixels)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("gloss 0.5\nM 1 1 1 0 0 0 1 0.5\nS 0 0 3 1\n", r":6:1: error: gloss before any material"),
        ("M 1 1 1 0 1 0 1 0\ngloss 0.5\nS 0 0 3 1\n", r":7:1: error: gloss needs a mirror or glass to make rough; .* line 6"),
        ("M 1 1 1 0 1 0 1 1\ngloss 1.5\nS 0 0 3 1\n", r":7:7: error: .*roughness.* 0 to 1"),
        ("M 1 1 1 0 1 0 1 1\ngloss -0.1\nS 0 0 3 1\n", r":7:7: error: .*roughness"),
        ("M 1 1 1 0 1 0 1 1\ngloss nan\nS 0 0 3 1\n", r":7:7: error"),
        ("M 1 1 1 0 1 0 1 1\ngloss\nS 0 0 3 1\n", r":7:\d+: error: .*gloss"),
        ("M 1 1 1 0 1 0 1 1\ngloss 0.1\ngloss 0.2\nS 0 0 3 1\n", r":8:1: error: a second gloss of one material; the first is line 7"),
    ],
)
def test_wrong_line_is_refused_where_it_is_wrong(lines: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        parse_scene(HEAD + lines)
