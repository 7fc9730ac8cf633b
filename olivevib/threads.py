"""One thread for linear algebra: sums then have one order, and every machine the same last bit.

The matrices of a trial are small: several threads make nothing faster and change results in the
last digits with the number of cores. Cameras and trials run in parallel instead.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping

_NAMES = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"),
    *("VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS"),
)


def use_one_thread(environment: MutableMapping[str, str]) -> None:
    """Make numeric libraries that are loaded after this use one thread."""
    environment.update(dict.fromkeys(_NAMES, "1"))


def uses_one_thread(environment: Mapping[str, str]) -> bool:
    """Whether linear algebra was told to use one thread."""
    return environment.get("OPENBLAS_NUM_THREADS", environment.get("OMP_NUM_THREADS")) == "1"
