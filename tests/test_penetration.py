"""Channels that see different depths of a translucent material: the uncertainty grows, and where it hides is known."""

from __future__ import annotations

from support.bars import hold

from quadfringe.evaluation.penetration import GREEN_AND_IR, ONE_ORDER, judged


def test_the_uncertainty_contains_the_disagreement_of_the_channels() -> None:
    sound, seen = (judged("peaks", offsets, seed=2) for offsets in ((0.0,) * 4, GREEN_AND_IR))
    hold("penetration.stated_over_rms", seen.stated_rad / seen.rms_rad)
    hold("penetration.stated_over_sound", seen.stated_rad / sound.stated_rad)
    hold("penetration.wrong_percent", [sound.wrong, seen.wrong])


def test_an_offset_like_that_of_an_order_is_another_order() -> None:
    """Green and infrared are as the order before would have them: no test on one shot can tell the two."""
    found = judged("peaks", ONE_ORDER, seed=2, everywhere=True)
    hold("penetration.hidden_order_percent", found.wrong)


def test_an_offset_that_all_channels_share_is_a_place_of_the_surface() -> None:
    found = judged("peaks", (0.3, 0.3, 0.3, 0.3), seed=2, everywhere=True)
    hold("penetration.shared_offset_rad", abs(found.rms_rad - 0.3))
