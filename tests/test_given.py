"""Images that were given wrongly are named: in another order, one of them twice, turned, blurred, or of fewer bits."""

from __future__ import annotations

from functools import cache
from itertools import combinations, permutations
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.data import Calibration
from quadfringe.decoding import params
from quadfringe.decoding.causes import wrong_bits
from quadfringe.decoding.given import same_images
from quadfringe.decoding.readings import other_readings
from quadfringe.decoding.symptoms import Bits, bits_in_use
from quadfringe.doctor import examine_shot
from quadfringe.evaluation import world

NAMES = ("red", "green", "blue", "ir")
ORDERS = [order for order in permutations(NAMES) if sum(a != b for a, b in zip(order, NAMES, strict=True)) > 2]
COLOURS = [order for order in ORDERS if order[3] == "ir"]


def refused(shot: qf.Shot, calibration: Calibration | None = None, method: str = "joint") -> qf.DecodeError:
    with pytest.raises(qf.DecodeError) as caught:
        qf.decode(shot, qf.Plan(912, calibration=calibration, decode={"method": method}))
    return caught.value


def first(shot: qf.Shot, calibration: Calibration | None = None) -> tuple[str, str]:
    found = [one for one in examine_shot(shot, qf.Plan(912, calibration=calibration)) if one.grade != "good"]
    return found[0].name, found[0].found


def reordered(shot: qf.Shot, order: tuple[str, ...]) -> qf.Shot:
    return qf.Shot(*(shot.channels[name] for name in order))


# Order


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.parametrize("order", COLOURS, ids="-".join)
def test_a_cycle_of_the_colours_is_named(order: Any, method: str, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    error = refused(reordered(shot, order), calibration, method)
    assert f"the channels seem to be in the order {', '.join(order)}:" in str(error)
    assert f"give the image given as red as {order[0]}" in error.fix


@pytest.mark.parametrize("order", [order for order in ORDERS if order not in COLOURS], ids="-".join)
def test_every_order_with_infrared_is_named(order: Any, bench: tuple[qf.Shot, Calibration]) -> None:
    assert f"the channels seem to be in the order {', '.join(order)}:" in str(refused(reordered(bench[0], order)))


def test_every_order_is_read(bench: tuple[qf.Shot, Calibration]) -> None:
    shot = bench[0]
    wrong = reordered(shot, ("green", "blue", "red", "ir"))
    (right,) = [one for one in other_readings(wrong) if one.shot.channels["red"] is shot.red and one.shot.ir is shot.ir
                and one.shot.channels["green"] is shot.green]  # fmt: skip
    assert right.found == "the channels seem to be in the order green, blue, red, ir"
    assert len(other_readings(wrong)) == 23


# One image twice


@pytest.mark.parametrize(("first_name", "second_name"), list(combinations(NAMES, 2)))
def test_one_image_in_two_channels_is_named(
    first_name: str, second_name: str, bench: tuple[qf.Shot, Calibration]
) -> None:
    shot = reordered(bench[0], tuple(first_name if name == second_name else name for name in NAMES))
    error = refused(shot)
    assert error.reason == "same image"
    assert f"{first_name} and {second_name} are the same image" in str(error)
    assert first(shot, bench[1])[0] == "same image"


def test_a_brighter_copy_is_the_same_image(bench: tuple[qf.Shot, Calibration]) -> None:
    red, *_ = images = list(bench[0].channels.values())
    copy = np.round(0.7 * red.astype(np.float32)).astype(np.uint8)
    found = same_images(qf.Shot(red, copy, images[2], images[3]))
    assert found is not None
    assert found.found == "red and green are the same image"


@pytest.mark.parametrize("scene", ["plane", "face_patches_12", "painted_face", "rods", "fringes_9px"])
def test_different_images_are_not_the_same(scene: str) -> None:
    for shot in (world.take(scene, 4).shot, qf.Shot(*(flat() for _ in NAMES))):
        assert same_images(shot) is None


@cache
def flat() -> NDArray[np.uint8]:
    return np.full((64, 64), 100, np.uint8)


# Turned


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.parametrize("turns", [1, 3])
def test_images_turned_by_90_degrees_are_named(turns: int, method: str, bench: tuple[qf.Shot, Calibration]) -> None:
    shot, calibration = bench
    square = (slice(None), slice(64, 448))
    turned = qf.Shot(*(np.ascontiguousarray(np.rot90(image[square], turns)) for image in shot.channels.values()))
    camera = calibration.camera.model_copy(update={"width_px": 384, "centre_px": (191.5, 191.5)})
    error = refused(turned, calibration.model_copy(update={"camera": camera}), method)
    # The published method knows it from the fringes, before any geometry.
    assert error.reason == ("turned images" if method == "published" else "mirrored or rotated")
    assert "turned by 90 degrees" in str(error)


# Blur


@pytest.mark.parametrize("share", [0.3, 0.36, 0.5])
def test_a_blur_that_takes_the_fringes_out_is_named(share: float, bench: tuple[qf.Shot, Calibration]) -> None:
    """Shares of a period of 17 px; noise is added after the blur."""
    noise = np.random.default_rng(7)
    blurred = []
    for image in bench[0].channels.values():
        light = cv2.GaussianBlur(image.astype(np.float32), (0, 0), share * 17)
        blurred.append(np.clip(light + noise.normal(0, 5, light.shape), 0, 255).astype(np.uint8))
    assert first(qf.Shot(*blurred))[0] == "blur"


def test_weak_fringes_on_a_sharp_object_are_no_blur(bench: tuple[qf.Shot, Calibration]) -> None:
    noise = np.random.default_rng(7)
    edges = 60 * (np.indices((384, 512)).sum(axis=0) // 64 % 2) + 60
    weak = [np.clip(edges + 0.02 * i + noise.normal(0, 5, i.shape), 0, 255) for i in bench[0].channels.values()]
    assert refused(qf.Shot(*(image.astype(np.uint8) for image in weak))).reason != "blur"


# Bits


@pytest.mark.parametrize("bits", range(8, 16))
def test_the_bits_of_crests_that_are_cut_off_are_told(bits: int, bench: tuple[qf.Shot, Calibration]) -> None:
    top = 2**bits - 1
    light = [image.astype(np.float64) / 200 for image in bench[0].channels.values()]
    shot = qf.Shot(*(np.minimum(top * image, top).astype(np.uint16) for image in light))
    assert bits_in_use(shot) == Bits(bits, True, top)


@pytest.mark.parametrize(("held", "told"), [(11, 12), (13, 14), (14, 14), (15, None), (16, None)])
def test_bits_of_a_camera_are_told_without_such_crests(
    held: int, told: int | None, bench: tuple[qf.Shot, Calibration]
) -> None:
    images = [np.round(image.astype(np.float64) / 256 * 2**held) for image in bench[0].channels.values()]
    shot = qf.Shot(*(image.astype(np.uint16) for image in images))
    found = bits_in_use(shot)
    assert (None if found is None else found.held) == told
    if found is not None:
        assert found.sure == (told <= params.SURE_BITS)
        assert first(shot, bench[1])[0] == "bits"


def test_a_dim_shot_says_at_least_how_many_bits_it_holds(bench: tuple[qf.Shot, Calibration]) -> None:
    """A quarter of the light of a 12-bit camera leaves values of 10 bits, which its next shot exceeds."""
    images = [image.astype(np.uint16) * 4 for image in bench[0].channels.values()]
    named = wrong_bits(qf.Shot(*images))
    assert named is not None
    assert "at least 10 bits" in named.found
    assert "--bits 12, or as many as the camera delivers" in named.fix
    crests = wrong_bits(qf.Shot(*(np.minimum(5 * image, 1023) for image in images)))
    assert crests is not None
    assert "they hold 10 bits" in crests.found
    assert crests.fix.endswith("--bits 10")


# Infrared


@pytest.mark.parametrize(("rows", "grade"), [(0.3, "good"), (2.5, "warning")])
def test_infrared_that_is_shifted_along_y_is_no_fault(
    rows: float, grade: str, bench: tuple[qf.Shot, Calibration]
) -> None:
    shot, calibration = bench
    moved = cv2.warpAffine(shot.ir, np.array([[1, 0, 0], [0, 1, rows]]), shot.ir.shape[::-1], borderMode=1)
    told = examine_shot(qf.Shot(shot.red, shot.green, shot.blue, moved), qf.Plan(912, calibration=calibration))
    worst = next((one for one in told if one.grade in ("fault", "warning")), None)
    assert grade == ("good" if worst is None else worst.grade)
    if worst is not None:
        assert worst.name == "infrared registration"
        assert "px along y would mend it; along y, fringes do not shift" in worst.found
        assert "along x" not in worst.found
