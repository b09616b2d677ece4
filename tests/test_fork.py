"""Processes that are forked, spawned or served after the kernel was used: none hangs, all give the same bits."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import quadfringe as qf
from quadfringe.config.cameras import VirtualConfig

pytestmark = pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")

PATIENCE_S = 60.0
Digest = Callable[[], str]


def digest(shape: qf.Shape) -> str:
    """All maps of a shape, bit by bit."""
    return hashlib.sha256(
        b"".join(np.ascontiguousarray(values).tobytes() for values in shape.maps.values())
    ).hexdigest()


def decoded(shot: Any, plan: qf.Plan) -> str:
    return digest(qf.decode(shot, plan))


@pytest.fixture(scope="module", params=["published", "joint"])
def scanner(request: pytest.FixtureRequest) -> Iterator[qf.Scanner]:
    camera = {"width_px": 640, "height_px": 480, "focal_px": (1612.0, 1612.0), "centre_px": (319.5, 239.5)}
    scene = qf.SceneConfig(surface="hand", noise=0.01)
    decode = qf.DecodeConfig(method=request.param, response="linear")
    config = qf.SystemConfig(capture=VirtualConfig(), scene=scene, decode=decode, camera=camera)
    with qf.open(config) as opened:
        opened.measure()
        yield opened


def in_child(work: Digest, method: str = "fork") -> str:
    """The result of `work` in a forked child; a failure if it hangs."""
    context = multiprocessing.get_context(method)
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=lambda: sender.send(work()))
    child.start()
    found = receiver.recv() if receiver.poll(PATIENCE_S) else None
    if found is None:
        child.kill()
    child.join()
    assert found is not None, f"the child hung or failed, exit code {child.exitcode}"
    return str(found)


@contextmanager
def working(work: Callable[[], object]) -> Iterator[None]:
    """Repeat `work` in another thread."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.is_set():
            work()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def test_a_forked_child_decodes_after_its_parent(scanner: qf.Scanner) -> None:
    shot = scanner.grab()
    decoder = qf.Decoder(shot, scanner.plan)
    expected = digest(decoder.decode(shot))
    assert in_child(lambda: digest(decoder.decode(shot))) == expected
    assert in_child(lambda: decoded(shot, scanner.plan)) == expected
    assert in_child(lambda: digest(scanner.decode(scanner.grab())))
    assert digest(decoder.decode(shot)) == expected


def test_a_child_starts_the_threads_that_were_asked_for(scanner: qf.Scanner) -> None:
    shot = scanner.grab()
    decode = scanner.config.decode.model_copy(update={"threads": 3})
    decoder = qf.Decoder(shot, qf.Plan(912, scanner.config.fringes, scanner.calibration, decode=decode))
    expected = digest(decoder.decode(shot))
    grandchild = lambda: in_child(lambda: digest(decoder.decode(shot)) + f" {threads_of(os.getpid())}")  # noqa: E731
    found, threads = in_child(grandchild).split()
    assert found == expected
    assert int(threads) >= 4


def threads_of(process: int) -> int:
    return len(os.listdir(f"/proc/{process}/task"))  # noqa: PTH208


def test_children_forked_while_threads_decode(scanner: qf.Scanner) -> None:
    shot = scanner.grab()
    decoder = qf.Decoder(shot, scanner.plan)
    expected = digest(decoder.decode(shot))
    with working(lambda: decoder.decode(shot)):
        for _ in range(5):
            assert in_child(lambda: digest(decoder.decode(shot))) == expected


def test_locks_that_another_thread_holds_are_free_in_a_child(scanner: qf.Scanner) -> None:
    plan = qf.Plan(912, scanner.config.fringes, decode=scanner.config.decode.model_copy(update={"response": "auto"}))
    shot = scanner.grab()
    decoder = qf.Decoder(shot, plan)
    held, ended = threading.Event(), threading.Event()

    def hold() -> None:
        with decoder._estimating, scanner._planning:
            held.set()
            ended.wait(PATIENCE_S)

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait(PATIENCE_S)
    try:
        assert in_child(lambda: digest(decoder.decode(shot)))
        assert in_child(lambda: digest(scanner.decode(shot)))
    finally:
        ended.set()
        thread.join()


def serve(decoder: qf.Decoder, shots: list[Any], indices: Any, results: Any) -> None:
    """A worker as that of a data loader: it gets indices from a queue until there is None."""
    while (index := indices.get()) is not None:
        results.put((index, digest(decoder.decode(shots[index]))))


def test_workers_of_a_data_loader(scanner: qf.Scanner) -> None:
    shots = [scanner.grab() for _ in range(4)]
    decoder = qf.Decoder(shots[0], scanner.plan)
    expected = {index: digest(decoder.decode(shot)) for index, shot in enumerate(shots)}
    context = multiprocessing.get_context("fork")
    indices, results = context.Queue(), context.Queue()
    workers = [context.Process(target=serve, args=(decoder, shots, indices, results)) for _ in range(2)]
    for worker in workers:
        worker.start()
    try:
        for index in [*expected, None, None]:
            indices.put(index)
        assert dict(results.get(timeout=PATIENCE_S) for _ in shots) == expected
    finally:
        for worker in workers:
            worker.join(PATIENCE_S)
            worker.kill()
            worker.join()


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_every_start_method_decodes(scanner: qf.Scanner, method: str) -> None:
    shot = scanner.grab()
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        assert pool.submit(decoded, shot, scanner.plan).result(PATIENCE_S) == decoded(shot, scanner.plan)


def test_joblib_decodes(scanner: qf.Scanner) -> None:
    import joblib

    shot = scanner.grab()
    found = joblib.Parallel(n_jobs=2, backend="loky")(joblib.delayed(decoded)(shot, scanner.plan) for _ in range(2))
    assert found == [decoded(shot, scanner.plan)] * 2


def test_a_stream_is_refused_in_a_child(scanner: qf.Scanner) -> None:
    def ask() -> str:
        try:
            next(stream)
        except RuntimeError as error:
            return str(error)
        return "a shot"

    with scanner.stream() as stream:
        next(stream)
        assert 'starts with "spawn"' in in_child(ask)
        assert next(stream).shape is not None
