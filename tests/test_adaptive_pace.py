"""What launches take, as a line: against lines that are known."""

from __future__ import annotations

import pytest

from clrt.adaptive.pace import Pace


def test_nothing_learnt_is_an_empty_launch_and_the_work_as_expected() -> None:
    assert Pace(2e-4).line() == (2e-4, 1.0)


def test_line_is_found_from_launches_that_lie_on_it() -> None:
    pace = Pace(1e-4)
    for work in (0.001, 0.02, 0.3, 0.004):
        pace.learn(work, 0.003 + 0.7 * work)
    assert pace.line() == pytest.approx((0.003, 0.7))


def test_fixed_part_is_no_less_than_that_of_an_empty_launch() -> None:
    pace = Pace(0.01)
    for work in (0.1, 0.2, 0.4):
        pace.learn(work, work)  # a line through zero
    fixed, factor = pace.line()
    assert fixed == 0.01
    assert 3 * fixed + factor * 0.7 == pytest.approx(0.7)  # all launches together took what they took


def test_launches_of_one_size_give_a_factor_alone() -> None:
    pace = Pace(0.0)
    for _ in range(5):
        pace.learn(0.1, 0.25)
    assert pace.line() == pytest.approx((0.0, 2.5))
