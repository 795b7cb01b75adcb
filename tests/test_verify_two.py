"""The catalogue by two processes: the same results as by one, whatever becomes of the other."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from clrt.verify import two
from clrt.verify.case import Case, Context, Outcome, Result
from clrt.verify.run import chosen, context_for, run

CHEAP = (33, 41, 42, 53, 55, 56)  #: no program to compile, or a tiny one


def outcomes(results: list[Result]) -> list[tuple[int, Outcome | None, str]]:
    return [(r.case.number, r.outcome, r.error) for r in results]


def test_two_processes_find_what_one_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(two, "WORTH", 2)
    context = replace(context_for(rays=2000), rungs=("fast", "exact"))
    told: list[float] = []
    results = two.run_in_two(chosen(CHEAP), context, lambda phase, done: told.append(done))
    assert outcomes(results) == outcomes(run(chosen(CHEAP), context))
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 1.0)


def planted(count: int, threads: set[str]) -> list[Case]:
    def ran(context: Context) -> Outcome:
        threads.add(threading.current_thread().name)
        return Outcome(1, {}, 1)

    return [Case(900 + i, "planted", "nothing", "S", frozenset(), ran) for i in range(count)]


@pytest.mark.parametrize("program", ["pass", "import sys; sys.stdin.readline()", "input(); print('no JSON')", "input(); print('{}')"])
def test_cases_of_a_process_that_dies_are_run_here(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    start = two.subprocess.Popen
    monkeypatch.setattr(two.subprocess, "Popen", lambda command, **streams: start([sys.executable, "-c", program], **streams))
    threads: set[str] = set()
    results = two.run_in_two(planted(two.WORTH, threads), Context())
    assert [r.case.number for r in results] == list(range(900, 900 + two.WORTH))
    assert all(r.outcome is not None for r in results)
    assert threads == {"MainThread"}


def test_other_process_fails_a_case_without_losing_the_rest() -> None:
    """It does not know the planted cases: the first one ends it."""
    results = two.run_in_two(planted(two.WORTH, set()), Context())
    assert [r.error for r in results] == [""] * two.WORTH


def test_few_cases_start_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(two.subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
    assert len(two.run_in_two(planted(two.WORTH - 1, set()), Context())) == two.WORTH - 1


def test_other_process_ends_with_its_standard_input_whatever_it_is_at() -> None:
    settings = '{"rungs": ["exact"]}'
    other = subprocess.Popen([sys.executable, "-m", two.__name__, settings], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert other.stdin is not None
    assert other.stdout is not None
    other.stdin.write("56\n" + 40 * "53\n")
    other.stdin.flush()
    assert '"error": ""' in other.stdout.readline()
    other.send_signal(signal.SIGINT)
    assert '"error": ""' in other.stdout.readline()
    other.stdin.close()
    assert other.wait(60) == 0
    assert other.stdout.read().count("error") < 38, "it did not go through all of them"
