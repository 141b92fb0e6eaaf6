"""Laws of the damage that reader tests draw."""

from __future__ import annotations

from fuzzing import injured


def test_equal_seeds_injure_alike() -> None:
    """A failing case can be made again from its seed."""
    whole = bytes(range(256)) * 4
    assert all(injured(whole, seed) == injured(whole, seed) for seed in range(50))


def test_files_are_changed_in_many_ways() -> None:
    """Nearly every case differs from the valid file and from the others; some are shorter."""
    whole = b"count 12\nvalues 0.5 -3e2 7\n" * 20
    found = {injured(whole, seed) for seed in range(400)} - {whole}
    assert len(found) > 300
    assert any(len(data) < len(whole) // 2 for data in found)
    assert any(len(data) > len(whole) for data in found)
    assert any(b"nan" in data for data in found)
