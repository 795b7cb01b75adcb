"""Reading a scene text: places and words of errors, the variants in the wild, and numbers to the last bit."""

from __future__ import annotations

import random
import time
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.faults import Faults
from clrt.scene.grammar import LETTERS
from clrt.scene.text import Declarations, decode, read_declarations
from clrt.scene.tokens import Token, tokenise
from clrt.scene.words import WORDS, Draft, Text, Word, WordCall

DATA = Path(__file__).parent / "data"
MALFORMED = sorted((DATA / "malformed").glob("*.txt"))

HEAD = "E 0 0 -1\nV 0 0 1\nF 45\nR 4 4\nL 5 5 -5\nM 1 1 1 0.1 0.9 0.3 20 0\n"
SCENE = HEAD + "S 0 0 3 1\n"


def read(text: str, *, bulk: bool = True) -> Declarations:
    """The declarations of a text without faults."""
    faults = Faults("scene.txt")
    found = read_declarations(text, "scene.txt", faults, bulk=bulk)
    faults.raise_if_any()
    return found


def errors(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        parse_scene(text, "scene.txt")
    return str(caught.value).split("\n")


def assert_same(one: Declarations, other: Declarations) -> None:
    """The same lines with the same bits."""
    assert one.rows.keys() == other.rows.keys()
    for form, rows in one.rows.items():
        assert np.array_equal(rows.lines, other.rows[form].lines), form
        assert rows.values.tobytes() == other.rows[form].values.tobytes(), form


def known_words() -> str:
    """All words there are, as messages list them: expected errors say {words}."""
    return ", ".join(sorted(WORDS))


# Errors: every file of tests/data/malformed holds the lines it must give, after "#! "


@pytest.mark.parametrize("path", MALFORMED, ids=lambda path: path.stem)
def test_malformed_file_gives_all_its_errors_with_their_places(path: Path) -> None:
    text = path.read_text(encoding="utf-8").replace("{words}", known_words())
    expected = [f"{path}:{line[3:]}" for line in text.split("\n") if line.startswith("#! ")]
    assert expected
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert str(caught.value).split("\n") == expected


def test_count_error_reads_as_the_format_says() -> None:
    text = HEAD + "\n" * 5 + "M 0.5 0.5 1.0 0.1 0.9 0.3 20.0 0.0 0.0\nS 0 0 3 1\n"
    assert errors(text) == ["scene.txt:12:3: error: M takes 8 or 10 numbers, found 9"]


@pytest.mark.parametrize("count", [20, 21, 25])
def test_errors_beyond_twenty_are_counted(count: int) -> None:
    found = errors(SCENE + "T 1 2\n" * count)
    expected = [f"scene.txt:{line}:3: error: T takes 9, 12 or 18 numbers, found 2" for line in range(8, 28)]
    more = {20: [], 21: ["scene.txt: 1 more error not shown"], 25: ["scene.txt: 5 more errors not shown"]}
    assert found == expected + more[count]


def test_one_bad_line_among_many_good_ones_is_the_only_error() -> None:
    lines = ["T 0 0 1 1 0 1 0 1 1 0 0 -1"] * 500
    lines[321] = "T 0 0 1 1 0 1 0 1e 1 0 0 -1"
    assert errors(HEAD + "\n".join(lines)) == ['scene.txt:328:17: error: expected a number (y of vertex 3), found "1e"']


def test_columns_count_characters_after_marks_and_tabs() -> None:
    text = "\ufeff" + SCENE + 'background "é" 0\t\tx\n'
    found = errors(text)
    assert found == [
        'scene.txt:8:12: error: expected a number (red), found ""é""',
        'scene.txt:8:19: error: expected a number (blue), found "x"',
    ]


@pytest.mark.parametrize("letter", sorted(LETTERS))
def test_every_letter_refuses_every_wrong_count(letter: str) -> None:
    for count in set(range(20)) - set(LETTERS[letter]):
        faults = Faults("scene.txt")
        read_declarations(f"\n {letter} " + "1 " * count, "scene.txt", faults)
        with pytest.raises(SceneError, match=rf"^scene.txt:2:{4 if count else 2}: error: {letter} takes .*, found {count}$"):
            faults.raise_if_any()


# Files that are no scene texts


def test_missing_file_names_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "rabbit.txt").write_text(SCENE)
    with pytest.raises(SceneError, match=r'rabit\.txt: error: there is no such file; did you mean ".*rabbit\.txt"\?$'):
        load_scene(tmp_path / "rabit.txt")
    with pytest.raises(SceneError, match=r"no-such-folder/a\.txt: error: there is no such file$"):
        load_scene(tmp_path / "no-such-folder" / "a.txt")


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="this is a folder"):
        load_scene(tmp_path)


def test_device_is_refused_without_reading_it() -> None:
    if not Path("/dev/zero").exists():
        pytest.skip("no /dev/zero here")
    with pytest.raises(SceneError, match="this is a device"):
        load_scene("/dev/zero")


def test_path_with_a_null_character_is_refused() -> None:
    with pytest.raises(SceneError, match="error:"):
        load_scene("a\0b.txt")


@pytest.mark.parametrize("text", ["", "\n\n", " \t\r\n", "\ufeff"])
def test_empty_file_says_what_a_scene_needs(tmp_path: Path, text: str) -> None:
    path = tmp_path / "empty.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=r"empty\.txt:1:1: error: the text is empty; a scene has at least"):
        load_scene(path)


@pytest.mark.parametrize(
    ("data", "place", "said"),
    [
        (b"E 0 0\n\x89PNG\r\n", "2:1", "0x89"),
        (b"E 0 0\n# \xc3\xa9\xe9 1\n", "2:4", "0xe9"),
        (b"E 0 0\nV 0\x00 1\n", "2:4", "0x00"),
        (b"\xff\xfeE\x00 \x00", "1:1", "UTF-16"),
    ],
)
def test_binary_data_is_refused_with_its_place(data: bytes, place: str, said: str) -> None:
    with pytest.raises(SceneError, match=f"^scene.txt:{place}: error: .*{said}"):
        decode(data, "scene.txt")


def test_unreadable_file_is_a_scene_error(tmp_path: Path) -> None:
    path = tmp_path / "loop.txt"
    path.symlink_to(path)
    with pytest.raises(SceneError, match="cannot be read"):
        load_scene(path)


# Variants in the wild


@pytest.mark.parametrize("path", sorted((DATA / "variants").glob("*.txt")), ids=lambda path: path.stem)
@pytest.mark.parametrize("change", ["crlf", "cr", "no final newline", "blank lines", "mark", "commas", "tabs", "comments"])
def test_variant_of_a_file_reads_the_same(path: Path, change: str) -> None:
    plain = path.read_text(encoding="utf-8")
    lines = plain.rstrip("\n").split("\n")
    text = {
        "crlf": "\r\n".join(lines) + "\r\n",
        "cr": "\r".join(lines),
        "no final newline": "\n".join(lines),
        "blank lines": plain + "\n  \n\t\n",
        "mark": "\ufeff" + plain,
        "commas": "\n".join(line if "//" in line or "#" in line else line.replace(" ", " , ") for line in lines),
        "tabs": plain.replace(" ", "\t"),
        "comments": "\n".join(line + "//, é # 1" for line in lines),
    }[change]
    expected = read(plain)
    assert_same(read(text), expected)
    assert_same(read(text, bulk=False), expected)
    assert [(c.name, c.line, c.values) for c in read(text).words] == [(c.name, c.line, c.values) for c in expected.words]


def test_file_with_mark_and_crlf_reads_from_disk(tmp_path: Path) -> None:
    path = tmp_path / "scene.txt"
    path.write_bytes(b"\xef\xbb\xbf" + SCENE.replace("\n", "\r\n").encode())
    assert load_scene(path).spheres.radii.tolist() == [1.0]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("T 1,2", [("T", 1), ("1", 3), ("2", 5)]),
        ("  L 1// 2", [("L", 3), ("1", 5)]),
        ("M 1/2#3", [("M", 1), ("1/2", 3)]),
        ('mesh "a b#c//d,e.obj" x="1 2"', [("mesh", 1), ('"a b#c//d,e.obj"', 6), ('x="1 2"', 23)]),
        ('mesh "open # end', [("mesh", 1), ('"open # end', 6)]),
        ("# all", []),
    ],
)
def test_tokens_of_a_line(line: str, expected: list[tuple[str, int]]) -> None:
    assert tokenise(line) == [Token(text, column) for text, column in expected]


# Words with text fields and keys, through a word of the test's own


@pytest.fixture
def poster(monkeypatch: pytest.MonkeyPatch) -> list[WordCall]:
    """A registered word `poster FILE scale=1 title=none` that keeps its calls."""
    calls: list[WordCall] = []

    def keep(_: Draft, call: WordCall) -> None:
        calls.append(call)

    scale = LETTERS["S"][4][3]
    word = Word((Text("file"),), 'poster "a b.png"', keep, keys=((scale, 1.0), (Text("title"), "none")), once=False)
    monkeypatch.setitem(WORDS, "poster", word)
    return calls


def test_word_takes_quoted_text_and_keys(poster: list[WordCall]) -> None:
    parse_scene(SCENE + 'poster a.png\nposter title="x, y" "b #1.png" radius=2.5 // end\n')
    assert [call.text("file") for call in poster] == ["a.png", "b #1.png"]
    assert [call.number("radius") for call in poster] == [1.0, 2.5]
    assert [call.text("title") for call in poster] == ["none", "x, y"]


@pytest.mark.usefixtures("poster")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("poster", '8:1: error: poster takes 1 value, as in "poster "a b.png"", found 0'),
        ("poster a.png radius=0", '8:21: error: radius must be greater than 0 and at most 1e+30, found "0"'),
        ("poster a.png radius=", '8:21: error: expected a number (radius), found ""'),
        ("poster a.png radius=1 radius=2", '8:23: error: the key "radius" stands twice on this line'),
        ("poster a.png raduis=1", '8:14: error: poster has no key "raduis"; did you mean "radius"? (its keys: radius, title)'),
        ('poster "a.png', '8:8: error: expected a second double quote after ""a.png" (file)'),
        ('poster ""', "8:8: error: expected a text (file), found nothing"),
        ("postre a.png", '8:1: error: unknown word "postre"; did you mean "poster"? (the words: {words})'),
    ],
)
def test_word_that_does_not_fit_its_grammar(line: str, expected: str) -> None:
    assert errors(SCENE + line) == [f"scene.txt:{expected}".replace("{words}", known_words())]


# Numbers to the last bit


def hard_decimals() -> list[str]:
    """Decimals that careless conversion gets wrong: long, half-way between floats, subnormal, with odd spellings."""
    rng = random.Random(7)
    found = [repr(rng.uniform(-1, 1) * 10.0 ** rng.randint(-320, 29)) for _ in range(3000)]
    found += ["".join(rng.choices("0123456789", k=rng.randint(17, 40))) + f"e-{rng.randint(10, 60)}" for _ in range(1000)]
    # 1 + 2^-53, exactly half-way between 1 and the next float, then a last digit above and below
    half = "1.00000000000000011102230246251565404236316680908203125"
    found += [half, half + "0" * 30 + "1", half[:-1] + "4", "9007199254740993", "5e-324", "2.4703282292062327e-324", "1e-400"]
    found += [".5", "5.", "+.5E+1", "-0", "-0.0", "00012", "0e999", "1E05", "1.e-5"]
    return found


def test_numbers_are_correctly_rounded() -> None:
    decimals = hard_decimals()
    decimals += ["0"] * (-len(decimals) % 9)
    text = "\n".join("T " + " ".join(decimals[i : i + 9]) for i in range(0, len(decimals), 9))
    expected = np.array([float(d) for d in decimals])
    for bulk in (True, False):
        values = read(text, bulk=bulk).rows["T", 9].values
        assert values.tobytes() == expected.tobytes()


def test_single_precision_conversion_would_be_noticed() -> None:
    decimals = hard_decimals()
    careless = np.array([float(np.float32(d)) if abs(float(d)) < 1e30 else float(d) for d in decimals[:100]])
    assert careless.tobytes() != np.array([float(d) for d in decimals[:100]]).tobytes()


def test_readers_agree_on_any_characters_of_numbers() -> None:
    """Bulk and exact reading accept and refuse the same tokens, each with the same value."""
    rng = random.Random(11)
    accepted = 0
    for _ in range(4000):
        token = "".join(rng.choices("0123456789+-.eEFT", weights=[3] * 10 + [1] * 7, k=rng.randint(1, 5)))
        results = []
        for bulk in (True, False):
            faults = Faults("scene.txt")
            rows = read_declarations(f"F {token}", "scene.txt", faults, bulk=bulk).rows
            results.append(rows["F", 1].values.tobytes() if rows else None)
        assert results[0] == results[1], token
        accepted += results[0] is not None
    assert 500 < accepted < 3500  # both kinds occur


def test_random_scene_reads_back_bit_for_bit() -> None:
    rng = np.random.default_rng(3)
    vertices = rng.standard_normal((40, 9)) * 10.0 ** rng.integers(-30, 29, (40, 1))
    spheres = np.abs(rng.standard_normal((10, 4)))
    lines = [f"{letter} " + " ".join(map(repr, row)) for letter, rows in (("T", vertices), ("S", spheres)) for row in rows.tolist()]
    scene = parse_scene(HEAD + "\n".join(lines))
    assert scene.objects[0].vertices.tobytes() == vertices.tobytes()
    assert np.column_stack([scene.spheres.centers, scene.spheres.radii]).tobytes() == spheres.tobytes()


def many_triangles(count: int) -> str:
    rng = np.random.default_rng(5)
    return "\n".join("T " + " ".join(f"{v:.6g}" for v in row) for row in rng.uniform(-1, 1, (count, 12)).tolist())


def test_bulk_reader_is_several_times_faster_and_gives_the_same() -> None:
    text = many_triangles(20_000)
    fast: list[float] = []
    slow: list[float] = []
    for _ in range(2):
        for times, bulk in ((fast, True), (slow, False)):
            start = time.process_time()
            found = read(text, bulk=bulk)
            times.append(time.process_time() - start)
            if bulk:
                in_bulk = found
    assert_same(in_bulk, found)
    assert min(slow) > 3.0 * min(fast)
