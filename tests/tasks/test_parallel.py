"""Independent pieces of work at once: their order, and how an interruption ends them."""

import threading
from collections.abc import Callable
from time import sleep

import pytest

from stickslip.tasks.parallel import in_parallel


def test_work_in_parallel_keeps_its_order() -> None:
    done: list[int] = []
    tasks: list[Callable[[], int]] = [lambda k=k: k * k for k in range(20)]
    found = in_parallel(tasks, workers=4, advance=lambda: done.append(1))
    assert found == [k * k for k in range(20)]
    assert len(done) == 20


def test_work_that_is_interrupted_begins_nothing_more() -> None:
    begun: list[int] = []
    gate = threading.Event()

    def task(number: int) -> None:
        begun.append(number)
        if number > 0:
            gate.wait(10.0)
            sleep(0.01)  # so that a thousand take longer than to stop them

    def interrupt() -> None:
        gate.set()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        in_parallel([lambda k=k: task(k) for k in range(1000)], workers=2, advance=interrupt)
    assert len(begun) < 1000
