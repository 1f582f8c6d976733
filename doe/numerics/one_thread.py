"""One thread for the linear algebra of the statistics: their matrices are small, threads would only wait."""

from __future__ import annotations

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
    """Run each step of a generator so; whoever answers it has all threads."""

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
