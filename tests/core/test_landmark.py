from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.landmark import (
    SUPPORTED_BITS,
    Landmark,
    LandmarkKind,
    decode,
    encode,
    id_set,
    parse_ids,
    recommended_ids,
    spacing,
)

GOLDEN = "1101000101011"


def test_the_papers_example_is_13_both_ways() -> None:
    assert decode(GOLDEN) == 13
    assert encode(13) == GOLDEN


@pytest.mark.parametrize("bits", SUPPORTED_BITS)
def test_every_id_is_read_as_it_is_written(bits: int) -> None:
    codes = {number: encode(number, bits) for number in range(1, 2**bits)}
    assert len(set(codes.values())) == len(codes)
    for number, code in codes.items():
        assert len(code) == 2 * bits + 5
        assert code.startswith("110")
        assert code.endswith("011")
        assert decode(code) == number


@pytest.mark.parametrize("bits", SUPPORTED_BITS)
def test_id_zero_is_not_used(bits: int) -> None:
    assert decode("110" + "00" * bits + "11") is None


@settings(deadline=None)
@given(st.text(alphabet="01", min_size=13, max_size=13))
def test_whatever_is_decoded_encodes_to_itself(code: str) -> None:
    number = decode(code)
    if number is not None:
        assert encode(number, 4) == code
    else:
        assert code not in {encode(n, 4) for n in range(1, 16)}


@pytest.mark.parametrize(("number", "bits"), [(0, 4), (16, 4), (-1, 4), (256, 8), (1, 3), (1, 7)])
def test_impossible_ids_are_refused(number: int, bits: int) -> None:
    with pytest.raises(InputError, match="expected"):
        encode(number, bits)


@pytest.mark.parametrize("code", ["", "11", "1101", GOLDEN + "0", GOLDEN[:-1], "2" * 13])
def test_other_strings_are_no_code(code: str) -> None:
    assert decode(code) is None


def test_sizes() -> None:
    kind = LandmarkKind()
    assert kind.segments == 13
    assert kind.height == pytest.approx(0.65)
    assert kind.axis_depth == pytest.approx(0.035)
    assert LandmarkKind(bits=8).height == pytest.approx(1.05)
    assert LandmarkKind(shape="flat").axis_depth == 0.0
    assert Landmark(13, 1.0, 2.0).code == GOLDEN


@pytest.mark.parametrize("bad", [{"segment": 0.0}, {"diameter": -1.0}, {"bits": 7}])
def test_impossible_kinds_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(InputError, match="expected"):
        LandmarkKind(**bad)  # type: ignore[arg-type]


LARGEST = {
    **{(bits, 1): 2**bits - 1 for bits in SUPPORTED_BITS},
    **{(bits, 2): 2 ** (bits - 1) for bits in SUPPORTED_BITS},
    **{(4, 3): 2, (5, 3): 4, (6, 3): 8, (8, 3): 20},
    **{(4, 4): 2, (5, 4): 2, (6, 4): 4, (8, 4): 16},
}
"""How many words of so many bits can differ in so many places: the tables of coding theory."""


@pytest.mark.parametrize(("bits", "distance"), LARGEST)
def test_id_sets_are_as_large_as_can_be(bits: int, distance: int) -> None:
    chosen = id_set(bits, distance)
    assert len(chosen) == LARGEST[bits, distance]
    assert list(chosen) == sorted(set(chosen))
    assert 0 not in chosen
    codes = [encode(number, bits) for number in chosen]
    for i, one in enumerate(codes):
        for other in codes[:i]:
            assert sum(a != b for a, b in zip(one, other, strict=True)) >= distance
    assert spacing(chosen, bits) >= distance


@settings(deadline=None)
@given(
    st.sampled_from(SUPPORTED_BITS).flatmap(
        lambda bits: st.tuples(st.just(bits), st.sets(st.integers(1, 2**bits - 1), min_size=2))
    )
)
def test_spacing_is_that_of_the_codes(case: tuple[int, set[int]]) -> None:
    bits, ids = case
    codes = [encode(number, bits) for number in ids]
    nearest = min(
        sum(a != b for a, b in zip(one, other, strict=True))
        for i, one in enumerate(codes)
        for other in codes[:i]
    )
    assert spacing(ids, bits) == nearest


@pytest.mark.parametrize(("bits", "distance"), [(5, 2), (6, 3), (8, 3), (8, 4)])
def test_misread_segments_are_noticed(bits: int, distance: int) -> None:
    """Fewer wrong segments than the distance never turn one landmark of the set into another."""
    chosen = set(id_set(bits, distance))
    for number in chosen:
        for wrong in range(1, 2**bits):
            if wrong.bit_count() < distance:
                assert number ^ wrong not in chosen


def test_spacing_of_small_sets() -> None:
    assert spacing(range(1, 16)) == 1
    assert spacing([13]) == 4
    assert spacing([7, 7, 7], 5) == 5
    with pytest.raises(InputError, match="expected 1 to 15"):
        spacing([3, 16])


@pytest.mark.parametrize(("bits", "distance"), [(5, 0), (5, 5), (7, 2), (3, 1)])
def test_impossible_id_sets_are_refused(bits: int, distance: int) -> None:
    with pytest.raises(InputError, match="expected"):
        id_set(bits, distance)


@pytest.mark.parametrize("bits", SUPPORTED_BITS)
def test_the_fewer_ids_the_farther_apart(bits: int) -> None:
    assert recommended_ids(bits) == id_set(bits, 2)
    before = 5
    for count in range(1, 2 ** (bits - 1) + 1):
        chosen = recommended_ids(bits, count)
        assert len(set(chosen)) == count
        now = min(spacing(chosen, bits), 4)
        assert now >= max(d for d in (2, 3, 4) if LARGEST[bits, d] >= count)
        assert 2 <= now <= before
        before = now


@pytest.mark.parametrize(("bits", "count"), [(4, 9), (5, 0), (8, 129), (5, -1)])
def test_more_ids_than_there_are_far_apart(bits: int, count: int) -> None:
    with pytest.raises(InputError, match=r"count is -?\d+: .*expected 1 to"):
        recommended_ids(bits, count)


def test_more_bits_are_proposed() -> None:
    with pytest.raises(InputError, match="or 6 bits"):
        recommended_ids(5, 20)


@given(st.sets(st.integers(1, 255), min_size=1))
def test_ids_are_read_as_they_are_written(ids: set[int]) -> None:
    assert parse_ids(",".join(map(str, ids)), 8) == tuple(sorted(ids))
    low, high = min(ids), max(ids)
    assert parse_ids(f" {low} - {high}".replace(" - ", "-"), 8) == tuple(range(low, high + 1))


@pytest.mark.parametrize(
    "text",
    ["", ",", "a", "1-", "-1", "1--2", "0", "16", "3-1", "²", "1;2", "9" * 5000, "1-" + "9" * 30],
)
def test_what_is_no_list_of_ids(text: str) -> None:
    with pytest.raises(InputError, match=r"^ids is "):
        parse_ids(text, 4)
