"""clrt on a second OpenCL implementation: Intel's runtime for CPUs, from its Python packages or as installed on the machine.

Everything runs in processes of its own, which see that runtime alone; what they bring back is judged here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clrt.reference
from clrt.generate import uv_sphere
from clrt.precision import RUNGS
from clrt.reference.exact import first_hit
from clrt.scene.build import parse_scene

PLATFORM = "Intel(R) OpenCL"
PACKAGES = ("intel-opencl-rt", "intel-cmplr-lib-rt")
BOUND, MARGIN = 1e-4, 2e-5  # as in test_render_reference.py
SCENE = """E 0 0 -1
V 0 0 1
F 45
R 61 47
L 5 5 -5
L -3 4 -2 0.5 0.2 0.1
background 0.2 0.3 0.5
M 1 1 0.5 0.1 0.9 0.3 20 0.4 0 1
T -9 -1 12 9 -1 12 9 -1 0.5
T -9 -1 12 9 -1 0.5 -9 -1 0.5
O
M 0.5 0.5 1 0.1 0.9 0.3 20 0 0 1.6
T -1.4 -0.9 3 -0.2 -0.9 3 -0.8 0.8 3.5 -0.5 -0.5 -0.7 0.5 -0.5 -0.7 0 0.6 -0.8
M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5
S 0.5 -0.2 2.5 0.6
"""
RENDER = f"""
import sys, numpy as np, clrt
from clrt.scene.build import parse_scene
image = clrt.render(parse_scene(sys.stdin.read()), precision=sys.argv[1], device="{PLATFORM}")
np.save(sys.argv[2], image.pixels)
"""
CAST = f"""
import sys, numpy as np, clrt
data = np.load(sys.argv[2])
caster = clrt.RayCaster(data["triangles"], precision=sys.argv[1], device="{PLATFORM}")
hits = caster.first_hit(data["origins"], data["directions"])
np.savez(sys.argv[3], t=hits["t"], prim_id=hits["prim_id"], decided=[caster.counters.get("exact", 0)])
"""


def _library() -> Path | None:
    """The runtime's library, of the packages in this environment."""
    try:
        files = [file for name in PACKAGES for file in metadata.files(name) or ()]
    except metadata.PackageNotFoundError:
        return None
    found = (Path(str(file.locate())).resolve() for file in files if file.name == "libintelocl.so")
    return next((path for path in found if path.exists()), None)


def _is_installed() -> bool:
    """Whether this process sees Intel's platform as it is."""
    try:
        return any(platform.name.strip() == PLATFORM for platform in cl.get_platforms())
    except cl.Error:
        return False


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a process that renders on Intel's runtime."""
    library = _library()
    if library is None:
        if _is_installed():
            return dict(os.environ)
        pytest.skip(f"Intel's OpenCL runtime is not installed: pip install {' '.join(PACKAGES)}")
    icd = tmp_path_factory.mktemp("vendors") / "intel.icd"
    icd.write_text(f"{library}\n")
    folders = [str(library.parent), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
    return {**os.environ, "OCL_ICD_VENDORS": str(icd), "LD_LIBRARY_PATH": os.pathsep.join(folders)}


def _python(environment: dict[str, str], *arguments: str, stdin: str = "") -> str:
    done = subprocess.run([sys.executable, *arguments], env=environment, input=stdin, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_intel_platform_is_the_default(environment: dict[str, str]) -> None:
    """Of the package's runtime alone; PoCL comes first where both are there."""
    script = "import clrt, json; print(json.dumps([(d.platform, d.fp64, d.lanes) for d in clrt.devices()]))"
    found = json.loads(_python(environment, "-c", script))
    assert PLATFORM in [platform for platform, *_ in found]
    if _library() is not None:
        assert [platform for platform, *_ in found] == [PLATFORM]


@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_picture_on_intel_matches_reference(environment: dict[str, str], tmp_path: Path, precision: str) -> None:
    _python(environment, "-c", RENDER, precision, str(tmp_path / "picture.npy"), stdin=SCENE)
    reference = clrt.reference.render(parse_scene(SCENE))
    wrong = np.abs(np.load(tmp_path / "picture.npy") - reference.pixels).max(-1) > BOUND
    assert not (wrong & (reference.margin > MARGIN)).any()
    assert wrong.sum() <= 0.02 * wrong.size
    assert reference.pixels.std() > 0.05


def _aimed_rays(rng: np.random.Generator, triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from the middle of a closed mesh at its vertices and at points of its edges, which float32 cannot hit squarely."""
    corners, neighbours = triangles.reshape(-1, 3), triangles[:, [1, 2, 0]].reshape(-1, 3)
    chosen = rng.integers(0, len(corners), count)
    share = np.where(rng.random(count) < 0.5, 0.0, rng.random(count))[:, None]
    origins = rng.uniform(-0.3, 0.3, (count, 3)).astype(np.float32)
    target = corners[chosen] + share * (neighbours[chosen] - corners[chosen])
    return origins, (target - origins).astype(np.float32)


def test_casters_on_intel_agree_with_the_oracle(environment: dict[str, str], tmp_path: Path) -> None:
    """4,000 rays at vertices and edges: `exact` names the oracle's triangles, `watertight` and `double` lose none, `fast` may."""
    vertices, faces = uv_sphere(1500)
    triangles = vertices.astype(np.float32)[faces]
    origins, directions = _aimed_rays(np.random.default_rng(5), triangles, 4000)
    np.savez(tmp_path / "rays.npz", triangles=triangles, origins=origins, directions=directions)
    prim_id, t = first_hit(triangles, origins, directions)
    for precision in ("exact", "watertight", "double"):
        _python(environment, "-c", CAST, precision, str(tmp_path / "rays.npz"), str(tmp_path / "hits.npz"))
        hits = np.load(tmp_path / "hits.npz")
        assert (hits["prim_id"] >= 0).all()
        np.testing.assert_allclose(hits["t"], t, rtol=1e-5)
        if precision == "exact":
            assert np.array_equal(hits["prim_id"], prim_id)
            assert hits["decided"][0] > 0, "no ray was hard enough to need expansions"


def test_verify_of_closed_meshes_passes_on_intel(environment: dict[str, str]) -> None:
    _python(environment, "-m", "clrt", "verify", "--quiet", "--device", PLATFORM, "--case", "1", "--case", "16")


@pytest.mark.slow
def test_verify_passes_on_intel(environment: dict[str, str]) -> None:
    _python(environment, "-m", "clrt", "verify", "--quiet", "--device", PLATFORM)
