"""`python -m tests.soak.memory [MINUTES]`: memory of a service's processes under small experiments, once a minute."""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console

from tests.e2e.service import Service
from tests.soak.clients import QUADRUPED, STRATEGIES, TOY

AT_ONCE = 4
"""Experiments that are under way."""

KINDS = [
    TOY,
    *(
        QUADRUPED | {"engine": engine, "tunables": tunables}
        for engine in ("mujoco", "pybullet", "physx")
        for tunables in (["friction"], ["mass"], ["length_scale"])
    ),
]
"""In place and not: of the last one each simulator is built anew."""


def main(minutes: float = 120.0) -> None:
    with TemporaryDirectory(prefix="gaplab-memory-") as folder:
        service, under_way, number, begun = Service(Path(folder)).start(), list[Any](), 0, time.monotonic()
        try:
            while (passed_s := time.monotonic() - begun) < 60 * minutes:
                tell(service, passed_s / 60, number)
                while time.monotonic() < begun + passed_s + 60:
                    under_way = [path for path in under_way if service.get(path)["state"] in {"QUEUED", "RUNNING"}]
                    while len(under_way) < AT_ONCE:
                        number += 1
                        spec = KINDS[number % len(KINDS)] | {"strategy": STRATEGIES[number % len(STRATEGIES)]}
                        under_way.append(f"/experiments/{service.post('/experiments', spec | {'seed': number})['id']}")
                    time.sleep(1)
        finally:
            service.kill()


def tell(service: Any, minutes: Any, experiments: Any) -> None:
    """Print the memory of every process that has more than 50 MB, the largest first."""
    found = {}
    for pid in service.processes():
        try:
            pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
            name = Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").strip()
        except OSError:  # it has ended
            continue
        found[pid] = pages * 4096 // 2**20, name.split("/")[-1][:40]
    large = sorted((each for each in found.values() if each[0] > 50), reverse=True)
    text = ", ".join(f"{name} {mb}" for mb, name in large)
    total = sum(mb for mb, _ in found.values())
    Console().print(f"{minutes:.0f} min, {experiments} experiments, {total} MB: {text}", soft_wrap=True)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
