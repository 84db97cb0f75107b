"""Independent tasks in several threads."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

from threadpoolctl import threadpool_limits

T = TypeVar("T")


def in_parallel(
    tasks: Sequence[Callable[[], T]], *, workers: int, advance: Callable[[], None]
) -> list[T]:
    """Run independent tasks in ``workers`` threads, and return their results in order.

    Threads suffice, as kernels release the interpreter's lock. Each does its linear algebra alone:
    more threads than processors take twice as long. ``advance`` is called after each task. After an
    interruption or an error no further task is started, and running ones, which are short, end.
    """
    with threadpool_limits(1), ThreadPoolExecutor(max_workers=workers) as pool:
        futures = [pool.submit(task) for task in tasks]
        try:
            for done in as_completed(futures):
                done.result()
                advance()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [future.result() for future in futures]
