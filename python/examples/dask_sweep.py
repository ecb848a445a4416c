"""Many tosses on the workers of a Dask cluster, here on this machine.

Every part is a function of its seeds alone. If a worker is lost, another one computes its part
again, with the same bytes.

python python/examples/dask_sweep.py
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import tumble
from distributed import Client, LocalCluster

TOSSES = 400
PART = 25
STEPS = 400

Floats = npt.NDArray[np.float64]


def part(seeds: range) -> Floats:
    """End states of the tosses with these seeds: (B, 13)."""
    starts = np.concatenate([tumble.drop(seed).states for seed in seeds])
    runs = tumble.rollout(tumble.drop(), starts, steps=STEPS, threads=1)
    if runs.unsolved:
        raise RuntimeError(f"not solved: {runs.unsolved[:5]}")
    return runs.states[:, -1, 0].copy()


def parts(tosses: int = TOSSES) -> list[range]:
    return [range(first, min(first + PART, tosses)) for first in range(0, tosses, PART)]


def sweep(client: Client, tosses: int = TOSSES) -> Floats:
    """End states of all tosses, in the order of their seeds: (tosses, 13)."""
    futures = client.map(part, parts(tosses), pure=True)
    ends: Floats = np.concatenate(client.gather(futures))
    return ends


def main() -> None:
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            ends = sweep(client)
    alone = np.concatenate([part(seeds) for seeds in parts()])
    same = ends.tobytes() == alone.tobytes()
    print(f"{len(ends)} tosses; the bytes of one process: {same}")
    print(f"mean place at the end: {ends[:, 0:2].mean(axis=0)} m")


if __name__ == "__main__":
    main()
