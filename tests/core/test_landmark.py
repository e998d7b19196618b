from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.landmark import SUPPORTED_BITS, Landmark, LandmarkKind, decode, encode

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
