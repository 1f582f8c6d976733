"""One thread for the linear algebra of the statistics: threads cost more than they save on small matrices."""

from collections.abc import Callable, Generator
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
Y = TypeVar("Y")
S = TypeVar("S")
R = TypeVar("R")


def in_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with one thread of linear algebra."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, "blas"):
            return function(*args, **kwargs)

    return limited


def steps_in_one_thread(
    function: Callable[P, Generator[Y, S, R]],
) -> Callable[P, Generator[Y, S, R]]:
    """Limit each step of a generator to one BLAS thread; the caller keeps all."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> Generator[Y, S, R]:
        steps = function(*args, **kwargs)
        take, give = in_one_thread(steps.__next__), in_one_thread(steps.send)
        try:
            asked = take()
            while True:
                asked = give((yield asked))
        except StopIteration as end:
            result: R = end.value
            return result

    return limited
