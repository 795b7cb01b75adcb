"""For tests of composed programs: sets of features (all but one, those that some need, a few in which all pairs meet), and their traces."""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Iterable
from functools import cache, lru_cache

from clrt.device.program import kernel_folder
from clrt.features import FEATURES, Feature, Features
from clrt.features.feature import Joint

#: what can be asked for by name: effects, and helpers that something of the scene calls for
NAMES = tuple(f.name for f in FEATURES if not isinstance(f.called_by, Joint))
_BY_NAME = {f.name: f for f in FEATURES}


def all_but(feature: Feature) -> Features:
    """As many features as there can be in a program without `feature`: what needs it is left out, and what nothing needs any more."""
    left = Features.named(set(NAMES) - _callers(feature))
    assert feature not in left.active
    return left


def _callers(part: Feature | Joint) -> set[str]:
    """Names without which `part` is not called for: of all parts of which any calls; where all have to, of that which leaves most."""
    if isinstance(part, Feature):
        return _callers(part.called_by) if isinstance(part.called_by, Joint) else {part.name}
    callers = [_callers(each) for each in part.parts]
    if part.every:
        return max(callers, key=lambda names: len(Features.named(set(NAMES) - names).active))
    return set().union(*callers)


def with_needs(names: Iterable[str]) -> Features:
    """The features of these names and those that they need, with one that calls for each helper among them."""
    wanted = {name for given in names for name in _needs(_BY_NAME[given])}
    return Features.named(wanted)


def _needs(part: Feature | Joint) -> set[str]:
    """Names that bring `part` into a program."""
    if isinstance(part, Joint):
        parts = part.parts if part.every else part.parts[:1]
        return {name for each in parts for name in _needs(each)}
    own = _needs(part.called_by) if isinstance(part.called_by, Joint) else {part.name}
    return own.union(*(_needs(needed) for needed in part.needs))


def mixed_sets(count: int) -> list[Features]:
    """`count` sets of about half of all features, seeded; the last has the pairs, too, that meet in none of them."""
    numbers = random.Random(20261122)
    chosen = [{name for name in NAMES if numbers.random() < 0.5} for _ in range(count)]
    for pair in itertools.combinations(NAMES, 2):
        if not any(names.issuperset(pair) for names in chosen):
            chosen[-1].update(pair)
    return [with_needs(names) for names in chosen]


_FUNCTION = re.compile(r"^(?:HOT|static|kernel|inline)\b[^;{}()]*?(?:__attribute__\(\(\w+\)\)[^;{}()]*?)?\b(\w+)\(", re.M)
_MACRO, _TYPE = re.compile(r"^#define (\w+)", re.M), re.compile(r"^} (\w+);", re.M)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
_STRUCTS = re.compile(r'#line 1 "structs"\n(.*?)#line', re.S)


@lru_cache(maxsize=4)
def _read(source: str) -> tuple[str, frozenset[str], frozenset[str]]:
    """The text of the structs, all words of the code, the files that it is from."""
    words = frozenset(re.findall(r"\w+", _COMMENT.sub("", source)))
    return _STRUCTS.findall(source)[0], words, frozenset(re.findall(r'#line \d+ "([^"]*)"', source))


@cache
def own_names(feature: Feature) -> frozenset[str]:
    """What a feature's file defines: functions, macros, types; and the kernel arguments that it adds."""
    return (_defined(feature.kernel) | {name for name, _ in feature.parameters}) - _defined(feature.replaces)


@cache
def _defined(file: str) -> frozenset[str]:
    text = (kernel_folder() / file).read_text(encoding="utf-8") if file else ""
    return frozenset(name for pattern in (_FUNCTION, _MACRO, _TYPE) for name in pattern.findall(text))


def traces(feature: Feature, source: str) -> list[str]:
    """What a composed program holds of a feature: its file, names that it defines, members of structs. Comments are no code."""
    structs, words, names = _read(source)
    files = [feature.kernel] if feature.kernel in names else []
    members = {name for name, *_ in (*feature.material, *feature.light, *feature.frame)}
    found = sorted(own_names(feature) & words)
    return files + found + [name for name in sorted(members) if re.search(rf" {name}(\[\d+\])?;", structs)]
