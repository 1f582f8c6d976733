"""A cluster of two workers on this machine, for the tests of one file."""

from collections.abc import Iterator

import pytest

from experiments.cases import Resources, Workers, open_workers
from experiments.studyfile.cluster_section import ClusterSection


@pytest.fixture(scope="module")
def two_workers() -> Iterator[Workers]:
    """Two workers of Dask on the CPU."""
    with open_workers(Resources(cluster=ClusterSection(workers=2, gpu=False))) as workers:
        yield workers
