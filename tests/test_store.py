"""Arrays kept on disk: what comes back, what is noticed, what is removed, and several processes at once."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from clrt.store import Store, digest

ARRAYS = {
    "a": np.arange(7, dtype=np.float32),
    "b": np.random.default_rng(1).normal(size=(3, 5, 2)),
    "nothing": np.zeros((0, 3), np.int32),
    "word": np.array(["device"]),
}


def same(found: dict[str, np.ndarray] | None, arrays: dict[str, np.ndarray] = ARRAYS) -> bool:
    return (
        found is not None
        and list(found) == list(arrays)
        and all(found[n].dtype == a.dtype and found[n].shape == a.shape and np.array_equal(found[n], a) for n, a in arrays.items())
    )


def test_arrays_come_back_as_they_were(tmp_path: Path) -> None:
    store = Store(tmp_path / "made" / "when needed")
    assert store.get("x") is None
    store.put("x", ARRAYS)
    assert same(Store(store.folder).get("x"))
    assert store.get("y") is None
    assert [file.name for file in store.folder.iterdir()] == ["x.arrays"]


def test_arrays_that_come_back_are_read_only(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put("x", ARRAYS)
    found = store.get("x")
    assert found is not None
    with pytest.raises(ValueError, match="read-only"):
        found["a"][0] = 1


def test_digest_tells_parts_apart() -> None:
    names = [digest(b"ab", b"c"), digest(b"a", b"bc"), digest(b"abc"), digest(b"c", b"ab"), digest(np.arange(3).data.cast("B")), digest()]
    assert len(set(names)) == len(names)
    assert digest(b"ab", b"c") == names[0]


@pytest.mark.parametrize("damage", ["cut", "one bit", "empty", "another file", "too short"])
def test_broken_entry_is_removed(tmp_path: Path, damage: str) -> None:
    store = Store(tmp_path)
    store.put("x", ARRAYS)
    (file,) = tmp_path.iterdir()
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1 if damage == "one bit" else 0
    broken = {"cut": data[:-9], "one bit": data, "empty": b"", "another file": b"\x89PNG" * 99, "too short": data[:12]}[damage]
    file.write_bytes(broken)
    assert store.get("x") is None
    assert list(tmp_path.iterdir()) == []
    store.put("x", ARRAYS)
    assert same(store.get("x"))


def test_least_recently_used_entries_make_room(tmp_path: Path) -> None:
    numbers = {"n": np.zeros(1000)}
    store = Store(tmp_path, limit=40_000)  # room for four files of 8,000 bytes and a little
    long_ago = time.time() - 1000
    for i in range(4):
        store.put(f"k{i}", numbers)
        os.utime(tmp_path / f"k{i}.arrays", (long_ago + i, long_ago + i))
    assert store.get("k0") is not None  # used now
    store.put("k4", numbers)
    assert sorted(file.stem for file in tmp_path.iterdir()) == ["k0", "k2", "k3", "k4"]
    assert sum(file.stat().st_size for file in tmp_path.iterdir()) <= 40_000


def test_entry_too_large_for_the_bound_is_not_kept(tmp_path: Path) -> None:
    store = Store(tmp_path, limit=40_000)
    store.put("small", {"n": np.zeros(1000)})
    store.put("large", {"n": np.zeros(2000)})
    assert store.get("large") is None
    assert store.get("small") is not None


def test_what_a_dead_process_left_is_removed_in_time(tmp_path: Path) -> None:
    fresh, old, other = tmp_path / "1.part", tmp_path / "2.part", tmp_path / "notes.txt"
    for file in (fresh, old, other):
        file.write_bytes(bytes(100))
    for file in (old, other):
        os.utime(file, (1, 1))
    Store(tmp_path).put("x", ARRAYS)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["1.part", "notes.txt", "x.arrays"]


def test_store_that_cannot_be_written_keeps_nothing(tmp_path: Path) -> None:
    file = tmp_path / "no folder"
    file.write_text("")
    store = Store(file / "trees")
    store.put("x", ARRAYS)
    assert store.get("x") is None


_MANY = """
import sys
import numpy as np
from pathlib import Path
from clrt.store import Store
store, keys = Store(Path(sys.argv[1]), limit=90_000), np.random.default_rng(int(sys.argv[2])).integers(0, 12, 150)
missed = 0
for key in keys:
    found = store.get(f"k{key}")
    if found is None:
        missed += 1
        store.put(f"k{key}", {"n": np.full(1000, key)})
    else:
        assert found["n"].shape == (1000,) and (found["n"] == key).all()
print(missed)
"""


def test_processes_at_once_never_meet_half_an_entry(tmp_path: Path) -> None:
    """Three processes read, write and make room in one folder; each array that comes back is whole, and some do.

    Keys come in random order: in turn, one more of them than there is room for, a process that runs by itself would find none.
    """
    command = [sys.executable, "-c", _MANY, str(tmp_path)]
    running = [subprocess.Popen([*command, str(i)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for i in range(3)]
    ends = [process.communicate(timeout=600) for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], ends
    missed = [int(out) for out, _ in ends]
    assert sum(missed) >= 12  # each key was put before it was found
    assert max(missed) < 100
    assert not list(tmp_path.glob("*.part"))
