"""Strategies that do harm from the second selection on; what came before is stored."""

import os
import time
from typing import Any

import numpy as np
from gaplab_plugins.calm import Calm


class Misbehaving(Calm):
    """The base: it selects as Calm does, and then does harm."""

    name = "misbehaving"

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        genome = super().select(belief, search, rng)
        return self.harm(genome) if belief.samples else genome

    def harm(self, genome: Any) -> Any:
        return genome


class Raises(Misbehaving):
    name = "misbehaving_raises"

    def harm(self, genome: Any) -> Any:
        raise ValueError("x" * 1_000_000)


class Prints(Misbehaving):
    name = "misbehaving_prints"

    def harm(self, genome: Any) -> Any:
        for _ in range(200):
            print("y" * 100_000)
        return genome


class EndsProcess(Misbehaving):
    name = "misbehaving_ends_process"

    def harm(self, genome: Any) -> Any:
        os._exit(3)


class Exits(Misbehaving):
    name = "misbehaving_exits"

    def harm(self, genome: Any) -> Any:
        raise SystemExit(3)


class Hangs(Misbehaving):
    name = "misbehaving_hangs"

    def harm(self, genome: Any) -> Any:
        while True:
            time.sleep(1)


class ReturnsRow(Misbehaving):
    name = "misbehaving_returns_row"

    def harm(self, genome: Any) -> Any:
        return genome[None, :]


class ReturnsScalar(Misbehaving):
    name = "misbehaving_returns_scalar"

    def harm(self, genome: Any) -> Any:
        return 0.5


class ReturnsNothing(Misbehaving):
    name = "misbehaving_returns_nothing"

    def harm(self, genome: Any) -> Any:
        return None


class ReturnsNan(Misbehaving):
    name = "misbehaving_returns_nan"

    def harm(self, genome: Any) -> Any:
        return np.full_like(genome, np.nan)
