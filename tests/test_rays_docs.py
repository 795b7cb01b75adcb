"""Every example of docs/rays.md runs and prints what the page says."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "rays.md"


def test_examples_of_the_page_print_what_it_says() -> None:
    text = re.sub(r"^```.*$", "", PAGE.read_text(encoding="utf-8"), flags=re.M)
    examples = doctest.DocTestParser().get_doctest(text, {}, PAGE.name, str(PAGE), 0)
    assert len(examples.examples) > 20
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(examples, out=said.append)
    assert "".join(said) == ""


def test_tables_of_the_page_name_what_there_is() -> None:
    """Fields and calls that the tables speak of exist, and none is left out."""
    import clrt
    from clrt.rays import HIT_DTYPE

    text = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]+`) \| (?:float64|int64|3 float64) ", text, re.M)
    assert sorted(re.findall(r"`(\w+)`", "".join(rows))) == sorted(HIT_DTYPE.names or ())
    calls = {name for name in vars(clrt.RayCaster) if not name.startswith("_")}
    assert all(f"`{name}" in text or f".{name}" in text for name in calls)
