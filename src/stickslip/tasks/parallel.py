"""Independent pieces of work, several at once."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

from threadpoolctl import threadpool_limits

__all__ = ["in_parallel"]

T = TypeVar("T")


def in_parallel(
    tasks: Sequence[Callable[[], T]], *, workers: int, advance: Callable[[], None]
) -> list[T]:
    """Return what the tasks return, in their order.

    Threads do, as kernels leave the interpreter's lock alone. Each does its linear algebra by
    itself: more threads than processors take twice as long. When the work is interrupted or fails,
    nothing more is begun, and the tasks at work, which are short, are waited for.

    Parameters
    ----------
    tasks
        What to do; none depends on another.
    workers
        How many are worked on at once.
    advance
        Called after each task.
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
