"""Canonical JSON and digests: equal content, equal bytes, whatever the order or spelling."""

import hashlib
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.identity import (
    JsonRows,
    canonical_json,
    digest,
    digest_bytes,
    digests,
    stream_seed,
    stream_seeds,
)
from tests.processes import python
from tests.refusals import refused

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="utf-8")),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("abcdef", max_size=3), inner, max_size=4)
    ),
    max_leaves=20,
)


def test_keys_are_sorted_nothing_is_padded_and_numbers_keep_their_kind() -> None:
    for value, text in (
        ({"b": [1, True, None], "a": "x"}, b'{"a":"x","b":[1,true,null]}'),
        (-0.0, b"0.0"),
        ((1.0, 1, [True]), b"[1.0,1,[true]]"),
        (np.float64(0.1), b"0.1"),
        # A float is the shortest text that reads back.
        ((1 / 3, 1e22, 5e-324), b"[0.3333333333333333,1e+22,5e-324]"),
    ):
        assert canonical_json(value) == text


def test_text_is_nfc_and_utf8() -> None:
    assert canonical_json("e\u0301") == canonical_json("\u00e9") == '"\u00e9"'.encode()
    assert canonical_json({"e\u0301": 1}) == canonical_json({"\u00e9": 1})


WITHOUT_FORM = [
    *(math.nan, math.inf, -math.inf, [1, {"a": math.nan}], 1j, np.int64(1), np.array([1.0])),
    *({1: "int key"}, {None: 1}, {"\u00e9": 1, "e\u0301": 2}, {1, 2}, "\ud800", object()),
    *(b"ab", bytearray(b"ab"), memoryview(b"ab")),
]


def test_what_has_no_canonical_form_is_refused() -> None:
    for value in WITHOUT_FORM:
        refused(ValueError, canonical_json, value, says=r".")


@pytest.mark.slow
@given(VALUES)
def test_canonical_json_is_json_that_has_the_same_canonical_json(value: Any) -> None:
    content = canonical_json(value)
    assert canonical_json(json.loads(content)) == content


@pytest.mark.slow
@given(st.dictionaries(st.text("abcdef", max_size=3), VALUES, max_size=5), st.randoms())
def test_order_of_keys_does_not_matter(value: dict[str, Any], random: Any) -> None:
    keys = list(value)
    random.shuffle(keys)
    assert canonical_json({key: value[key] for key in keys}) == canonical_json(value)


def test_digest_is_sha256_of_the_canonical_json() -> None:
    assert digest({"a": 1.0}) == hashlib.sha256(b'{"a":1.0}').hexdigest()
    assert digest_bytes(b"") == hashlib.sha256(b"").hexdigest()


def test_stream_seed_is_64_bits_of_a_written_preimage() -> None:
    preimage = b'[7,2,"cut_in",{"ego_speed":25.0,"gap":0.0}]'
    expected = int.from_bytes(hashlib.sha256(preimage).digest()[:8], "big")
    assert stream_seed(7, 2, "cut_in", {"gap": -0.0, "ego_speed": 25}) == expected
    assert 0 <= expected < 2**64


def test_stream_seed_never_changes() -> None:
    # A changed seed changes every noisy trace that was ever recorded.
    assert stream_seed(7, 0, "cut_in", {"gap": 20.0}) == 16862306026069089708


def test_every_part_of_the_situation_changes_the_stream_seed() -> None:
    for other in (
        (8, 0, "cut_in", {"gap": 20.0}),
        (7, 1, "cut_in", {"gap": 20.0}),
        (7, 0, "cut_out", {"gap": 20.0}),
        (7, 0, "cut_in", {"gap": 20.000000000000004}),
        (7, 0, "cut_in", {"gap": 20.0, "rain": 0.0}),
        (7, 0, "cut_in", {"lead": 20.0}),
    ):
        assert stream_seed(*other) != stream_seed(7, 0, "cut_in", {"gap": 20.0})


def test_digest_does_not_depend_on_the_hash_seed() -> None:
    program = (
        "from adeye.identity import digest;"
        "print(digest({k: {'x': 1.5} for k in {'a', 'b', 'c', 'd', 'e'}}))"
    )
    answers = {python("-c", program, PYTHONHASHSEED=seed).stdout for seed in ("0", "1", "2")}
    (answer,) = answers
    assert len(answer.strip()) == 64


def test_seeds_of_many_are_those_of_each() -> None:
    points = [{"b": 0.1 + at, "a": -0.0} for at in range(3)]
    texts = JsonRows.of({"a": 0.0}, ["b"]).texts({"b": [repr(0.1 + at) for at in range(3)]}, 3)
    alone = [stream_seed(7, at, "scenärio", point) for at, point in enumerate(points)]
    assert stream_seeds(7, "scenärio", range(3), texts) == alone


@pytest.mark.slow
@given(
    constant=st.dictionaries(st.text(max_size=3), st.floats(allow_nan=False, allow_infinity=False)),
    varied=st.dictionaries(
        st.text(min_size=4, max_size=5), st.lists(st.integers() | st.text(), min_size=2, max_size=2)
    ),
)
def test_rows_of_json_are_the_canonical_json_of_each(
    constant: dict[str, float], varied: dict[str, list[int | str]]
) -> None:
    try:
        rows = JsonRows.of(constant, varied)
        columns = {
            name: [canonical_json(value).decode() for value in values]
            for name, values in varied.items()
        }
        whole = [
            canonical_json({**constant, **{name: values[at] for name, values in varied.items()}})
            for at in range(2)
        ]
    except ValueError:  # lone surrogates, or two keys that are equal in NFC
        return
    assert [text.encode() for text in rows.texts(columns, 2)] == whole


def test_percent_signs_in_the_constant_part_stay() -> None:
    rows = JsonRows.of({"50%": "%s"}, ["x"])
    assert rows.texts({"x": ["1"]}, 1) == ['{"50%":"%s","x":1}']


def test_rows_with_a_key_twice_are_refused() -> None:
    refused(ValueError, JsonRows.of, {"a": 1}, ["a"], says="are not all different")


def test_digests_of_texts_are_sha256() -> None:
    assert digests(["a"]) == [digest_bytes(b"a")]
