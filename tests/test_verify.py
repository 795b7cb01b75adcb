"""The catalogue of hard cases, with few rays; the command with planted cases; the naive variants' own right answers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.cli.main import cli
from clrt.errors import ClrtError
from clrt.precision import DEFAULT
from clrt.verify import case as registry
from clrt.verify import naive, naive_tree
from clrt.verify.case import EXACT, Case, Context, Outcome, Result, case
from clrt.verify.judge import Truth, disagreements, far_off, lost_in_tree, truth
from clrt.verify.rays import Rays, closed_sphere, cube, directions, hard_aims, inside, lattice, rays_of
from clrt.verify.run import LAST_CASE, catalogue, chosen, context_for, failures, run, run_case, to_json

RAYS = 12_000  #: where the rarest naive failures still show
CASES = catalogue()
SLOW = {6, 34, 35, 36, 37, 38, 40, 49, 50, 51, 52, 57, 58}  #: many programs to compile
ONE_RUNG = {39, 41, 42, 43, 44, 45, 46, 47, 48, 54}  #: a program a rung to compile: the default rung first, all of them in the long run


@pytest.fixture(scope="module")
def context() -> Context:
    return context_for(rays=RAYS)


@pytest.mark.parametrize(
    ("hard", "rungs"),
    [pytest.param(c, None, id=str(c.number), marks=[pytest.mark.slow] if c.number in SLOW | ONE_RUNG else []) for c in CASES]
    + [pytest.param(c, (DEFAULT,), id=f"{c.number}-{DEFAULT}") for c in CASES if c.number in ONE_RUNG],
)
def test_case_keeps_promises_and_bites(hard: Case, rungs: tuple[str, ...] | None, context: Context) -> None:
    context = context if rungs is None else replace(context, rungs=rungs)
    result = run_case(hard, context)
    assert not result.failures(context.rungs)
    assert result.outcome is not None
    assert result.outcome.naive > 0
    assert result.outcome.rays > 0
    for rung in hard.promised & set(context.rungs):
        assert result.outcome.wrong[rung] == 0


def test_catalogue_has_every_case() -> None:
    assert [c.number for c in CASES] == list(range(1, LAST_CASE + 1))
    assert all(c.title and c.provokes and c.promised for c in CASES)


def test_case_registered_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="case 1 is there twice"):
        case(1, "again", provokes="nothing", oracle="E")(_broken)


def test_case_with_unknown_oracle_or_rung_is_refused() -> None:
    with pytest.raises(ValueError, match="oracle 'Q'"):
        case(900, "title", provokes="nothing", oracle="Q")(_broken)
    with pytest.raises(ValueError, match="unknown rungs: wobbly"):
        case(900, "title", provokes="nothing", oracle="E", promised={"wobbly"})(_broken)
    assert 900 not in registry.CASES


def test_chosen_unknown_number_names_the_range() -> None:
    with pytest.raises(ClrtError, match=r"no case 999; the catalogue has 1 to \d+"):
        chosen([999])


def _planted(wrong: int, naive_wrong: int, promised: frozenset[str] = EXACT) -> Case:
    return Case(7, "planted", "nothing", "S", promised, lambda _: Outcome(10, {"fast": 3, "exact": wrong}, naive_wrong))


def _broken(_: Context) -> Outcome:
    raise RuntimeError("out of order")


def test_result_failures_by_promise() -> None:
    def faults(planted: Case) -> list[str]:
        return Result(planted, planted.run(Context()), 0.0).failures(("fast", "exact"))

    assert faults(_planted(0, 1)) == []  # the 3 of `fast` break no promise
    assert faults(_planted(2, 1)) == ["exact: 2 of 10 wrong"]
    assert faults(_planted(0, 1, EXACT | {"fast"})) == ["fast: 3 of 10 wrong"]
    assert faults(_planted(0, 0)) == ["the naive variant is right, so that the case proves nothing"]


def test_run_case_that_raises_fails_and_says_why(context: Context) -> None:
    result = run_case(Case(7, "planted", "nothing", "S", EXACT, _broken), context)
    assert result.failures(context.rungs) == ["RuntimeError: out of order"]
    row = to_json([result], context)["cases"][0]
    assert (row["passed"], row["rays"], row["naive"]) == (False, None, None)


def test_run_reports_progress(context: Context) -> None:
    seen: list[tuple[str, float]] = []
    results = run([_planted(0, 1), _planted(1, 1)], context, lambda phase, done: seen.append((phase, done)))
    assert seen == [("case 7: planted", 0.0), ("case 7: planted", 0.5), ("done", 1.0)]
    assert failures(results, context) == ["case 7, planted: exact: 1 of 10 wrong"]


Plant = Callable[[Case], None]


@pytest.fixture
def plant(monkeypatch: pytest.MonkeyPatch) -> Plant:
    """Puts a case in the place of the catalogue's of the same number."""
    return lambda planted: monkeypatch.setitem(registry.CASES, planted.number, planted)


def test_command_exits_0_where_promises_hold(plant: Plant) -> None:
    plant(_planted(0, 4))
    result = CliRunner().invoke(cli, ["verify", "--case", "7"], standalone_mode=False)
    assert result.return_value == 0
    assert "1 of 1 cases pass" in result.output
    assert "(3)" in result.output  # `fast` promises nothing


def test_command_exits_1_where_one_is_broken(plant: Plant) -> None:
    plant(_planted(2, 4))
    result = CliRunner().invoke(cli, ["verify", "--case", "7"], standalone_mode=False)
    assert result.return_value == 1
    assert "FAIL" in result.output
    assert "broken promise: case 7, planted: exact: 2 of 10 wrong" in result.output


def test_command_quiet_prints_broken_promises_only(plant: Plant) -> None:
    plant(_planted(2, 4))
    result = CliRunner().invoke(cli, ["verify", "--quiet", "--case", "7"], standalone_mode=False)
    assert result.return_value == 1
    assert result.output == "clrt: broken promise: case 7, planted: exact: 2 of 10 wrong\n"


def test_command_json_has_all_keys(plant: Plant, tmp_path: Path) -> None:
    plant(_planted(0, 4))
    path = tmp_path / "cases.json"
    assert CliRunner().invoke(cli, ["verify", "--case", "7", "--quiet", "--json", str(path)], standalone_mode=False).return_value == 0
    data = json.loads(path.read_text())
    assert set(data) == {"clrt", "device", "full", "seed", "rungs", "passed", "seconds", "cases"}
    (row,) = data["cases"]
    assert set(row) == {"case", "title", "provokes", "oracle", "promised", "rays", "wrong", "naive", "note",
                        "passed", "failures", "seconds"}  # fmt: skip
    assert (data["passed"], row["wrong"]["exact"], row["wrong"]["fast"], row["wrong"]["watertight"]) == (True, 0, 3, None)


def test_command_json_on_standard_output_is_json_alone(plant: Plant) -> None:
    plant(_planted(0, 4))
    result = CliRunner().invoke(cli, ["verify", "--case", "7", "--json", "-"], standalone_mode=False)
    assert json.loads(result.output)["cases"][0]["case"] == 7


def test_command_unknown_case_or_folder_is_an_error(tmp_path: Path) -> None:
    for arguments in (["--case", "999"], ["--case", "7", "--json", str(tmp_path / "none" / "x.json")]):
        result = CliRunner().invoke(cli, ["verify", *arguments], standalone_mode=False)
        assert isinstance(result.exception, ClrtError | OSError)


def test_naive_predicates_agree_with_the_oracle_on_easy_rays() -> None:
    """They fail hard cases for their arithmetic, not because they are wrong altogether."""
    rng, tri = np.random.default_rng(0), closed_sphere(300)
    rays = rays_of(inside(rng, 300, tri), directions(rng, 300))
    expected = truth(tri, rays)
    for predicate in (naive.TEXTBOOK, naive.MoellerTrumbore(nan_hits=True), naive.contracted_edges):
        prim, t = naive.brute_force(tri, rays, predicate)
        assert np.mean(prim == expected.prim_id) > 0.99
        np.testing.assert_allclose(t, expected.t, rtol=1e-4)


def test_naive_tree_agrees_with_all_triangles_on_easy_rays() -> None:
    rng, tri = np.random.default_rng(1), closed_sphere(300)
    rays = rays_of(inside(rng, 500, tri), directions(rng, 500))
    everything = naive.brute_force(tri, rays)
    for sorter in (naive_tree.strictly, naive_tree.flat_below, naive_tree.by_clipped_area):
        walk = naive_tree.walk(naive_tree.build(tri, 8, sorter), tri, rays)
        assert np.mean(walk.t == everything[1]) > 0.99
        assert walk.tests.mean() < len(tri) / 4


def test_meshes_are_closed() -> None:
    """Every edge is shared by two triangles, run through in opposite directions."""
    for tri in (closed_sphere(200), closed_sphere(200, (1e3, 0, 0)), cube()):
        start, end = tri.reshape(-1, 3), np.roll(tri, -1, axis=1).reshape(-1, 3)
        forward = sorted(map(tuple, np.concatenate([start, end], axis=1).tolist()))
        backward = sorted(map(tuple, np.concatenate([end, start], axis=1).tolist()))
        assert forward == backward


def test_lattice_covers_its_square_once() -> None:
    tri = lattice(6).astype(np.float64)
    area = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])[:, 2] / 2
    assert (area > 0).all()
    assert area.sum() == 36.0


def test_hard_aims_hit_corners_and_edges() -> None:
    rng, tri = np.random.default_rng(2), closed_sphere(200)
    rays = hard_aims(rng, 300, tri)
    ends = (rays.origins + rays.directions).astype(np.float64)[:100]
    nearest = np.linalg.norm(ends[:, None] - tri.reshape(1, -1, 3), axis=2).min(axis=1)
    assert nearest.max() < 1e-6


def _hits(prim: list[int], t: list[float]) -> np.ndarray:
    from clrt.rays import HIT_DTYPE

    hits = np.zeros(len(prim), HIT_DTYPE)
    hits["prim_id"], hits["t"] = prim, t
    hits["object_id"] = np.where(hits["prim_id"] < 0, -1, 0)
    return hits


def test_disagreements_by_promise() -> None:
    expected = Truth(np.array([4, 4, 4, -1, 4]), np.array([1.0, 1.0, 1.0, np.inf, 1.0]))
    hits = _hits([4, 5, -1, -1, 4], [1.0, 1.0, np.inf, np.inf, 1.0 + 2e-6])
    assert disagreements("exact", hits, expected).tolist() == [False, True, True, False, True]
    assert disagreements("watertight", hits, expected).tolist() == [False, False, True, False, True]


def test_disagreements_count_what_is_no_number() -> None:
    expected = Truth(np.array([4, -1, -1]), np.array([1.0, np.inf, np.inf]))
    hits = _hits([4, -1, -1], [1.0, np.nan, np.inf])
    hits["u"][0] = np.nan
    hits["normal"][2] = 1.0
    assert disagreements("fast", hits, expected).all()


def test_far_off_at_four_ulps() -> None:
    step = float(np.finfo(np.float32).eps)
    assert far_off(np.array([1 + 3.9 * step, 1 + 4.1 * step, np.nan]), np.ones(3)).tolist() == [False, True, True]


def test_lost_in_tree_counts_true_hits_alone() -> None:
    tri = np.array([[[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 0, 2], [1, 0, 2], [0, 1, 2]]], np.float64)
    rays = Rays(np.array([[0.2, 0.2, 0.0], [2.0, 2.0, 0.0], [0.2, 0.2, 0.0]]), np.array([[0.0, 0.0, 1.0]] * 3))
    everything = Truth(np.array([0, 0, 0]), np.array([1.0, 1.0, 1.0]))  # the second is no true hit
    by_tree = Truth(np.array([1, -1, 0]), np.array([2.0, np.inf, 1.0]))
    assert lost_in_tree(tri, rays, by_tree, everything, exactly=False) == 1
    assert lost_in_tree(tri, rays, by_tree, everything, exactly=True) == 2


def test_markdown_goes_between_the_marks_of_a_page(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- verify:begin -->\nold\n<!-- verify:end -->\nafter\n")
    done = CliRunner().invoke(cli, ["verify", "--case", "33", "--markdown", str(page), "--quiet"], standalone_mode=False)
    assert done.return_value == 0, done.output
    text = page.read_text()
    assert text.startswith("before\n<!-- verify:begin -->\n")
    assert text.endswith("<!-- verify:end -->\nafter\n")
    assert "| 33 | NaN and infinite vertices | 12 | 0 | 0 | 0 | 0 | 12 | pass |" in text
    assert "old" not in text
