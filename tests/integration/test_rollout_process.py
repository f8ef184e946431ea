"""Rollouts in a subprocess: whatever happens to it, the caller gets an answer, and so does the next one."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any

import pytest

from gaplab.services.core.errors import EngineUnavailable, LimitReached
from gaplab.services.core.strategies import strategies
from gaplab.services.plugins import contents
from gaplab.services.replay.process import MOST_OUTPUT, NICENESS, AnswerCache, EngineInterrupted, RolloutProcess
from gaplab.services.waiting_line import WaitingLine
from tests.fakes import CAREFUL
from tests.waiting import wait_until

DEADLINE_S = 120.0


@pytest.fixture(scope="module")
def rollouts() -> Iterator[Any]:
    """Has a process already or not; most tests end it."""
    found = RolloutProcess()
    yield found
    found.close()


def gone(pid: Any) -> bool:
    """Whether a process has ended, waited for or not: with all of its threads, which hold its pipes until then."""
    with suppress(ChildProcessError):
        return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def test_calls_are_executed_by_one_subprocess_of_lower_priority(rollouts: Any) -> None:
    first, second = rollouts.call(os.getpid), rollouts.call(os.getpid)

    assert first == second == rollouts.pid != os.getpid()
    assert os.getpriority(os.PRIO_PROCESS, first) == min(19, os.nice(0) + NICENESS)


def test_a_process_imports_the_plug_ins_of_its_calls_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("careful", "brave"):
        (tmp_path / f"{name}.py").write_text(CAREFUL.replace("careful", name))
    monkeypatch.setenv("GAPLAB_PLUGINS", str(tmp_path))
    rollouts = RolloutProcess()
    careful = {"strategy careful": contents.read([tmp_path]).text_of("careful.py")}

    found = [rollouts.call(_external_strategies, plugins=plugins) for plugins in ({}, careful, careful, {})]

    assert [names for _, names in found] == [[], ["careful"], ["careful"], []]
    first, second, third, fourth = (pid for pid, _ in found)
    assert second == third
    assert len({first, second, fourth}) == 3
    (tmp_path / "careful.py").write_text(f"{CAREFUL}\n# edited\n")
    with pytest.raises(EngineInterrupted, match="start the service again if it was edited"):
        rollouts.call(_external_strategies, plugins=careful)
    rollouts.close()


def _external_strategies() -> tuple[int, list[str]]:
    return os.getpid(), list(strategies.files)


def test_a_process_that_was_killed_is_replaced(rollouts: Any) -> None:
    killed = rollouts.call(os.getpid)
    os.kill(killed, signal.SIGKILL)
    wait_until(lambda: gone(killed))

    assert rollouts.call(os.getpid) not in {killed, os.getpid()}


def test_a_process_that_could_not_be_started_is_started_by_the_next_call(monkeypatch: pytest.MonkeyPatch) -> None:
    rollouts = RolloutProcess()
    assert rollouts.pid is None

    def out_of_memory(_: Any) -> None:
        raise OSError(12, "Cannot allocate memory")

    with monkeypatch.context() as patch:
        patch.setattr("multiprocessing.context.SpawnProcess.start", out_of_memory)
        with pytest.raises(EngineInterrupted):
            rollouts.call(os.getpid)

    assert rollouts.call(os.getpid) not in {None, os.getpid()}
    rollouts.close()


def test_physics_that_kills_its_process_is_an_error_of_that_call_alone(rollouts: Any) -> None:
    first = rollouts.call(os.getpid)

    with pytest.raises(EngineInterrupted, match="ended its process"):
        rollouts.call(os._exit, 11)

    assert rollouts.call(os.getpid) not in {first, os.getpid()}


def test_physics_that_takes_too_long_is_ended() -> None:
    rollouts = RolloutProcess(longest_s=60)
    first = rollouts.call(os.getpid)
    rollouts._longest_s = 0.2

    with pytest.raises(EngineInterrupted, match=r"more than 0\.2 s"):
        rollouts.call(time.sleep, DEADLINE_S)

    assert gone(first)
    rollouts._longest_s = 60
    assert rollouts.call(abs, -1) == 1
    rollouts.close()


def test_an_error_of_the_function_reaches_the_caller_and_the_process_goes_on(rollouts: Any) -> None:
    first = rollouts.call(os.getpid)

    with pytest.raises(RuntimeError, match="ValueError: invalid literal"):
        rollouts.call(int, "x")
    with pytest.raises(EngineUnavailable, match="pip install"):
        rollouts.call(_unavailable)

    assert rollouts.call(os.getpid) == first


def _unavailable() -> None:
    raise EngineUnavailable("pip install it")


def test_of_what_a_call_prints_the_beginning_is_logged(rollouts: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")

    for word in ("first", "second"):
        assert rollouts.call(_print, word) == word
        wait_until(lambda word=word: f"{word} to stderr" in caplog.text)  # type: ignore[misc]
    assert rollouts.call(os.write, 1, b"x" * 10_000_000) == 10_000_000
    wait_until(lambda: "no more of this call is logged" in caplog.text)

    assert "first to stdout" in caplog.text
    assert len(caplog.text) < 3 * MOST_OUTPUT


def _print(word: str) -> str:
    sys.stdout.write(f"{word} to stdout\n")
    sys.stdout.flush()
    sys.stderr.write(f"{word} to stderr\n")
    return word


def test_a_call_that_waits_too_long_for_others_is_refused() -> None:
    rollouts = RolloutProcess(line=WaitingLine("replays", longest_s=0.1))
    rollouts.call(abs, -1)
    with ThreadPoolExecutor(1) as other:
        slow = other.submit(rollouts.call, time.sleep, DEADLINE_S)
        wait_until(rollouts._line.lock.locked)

        with pytest.raises(LimitReached, match="try again soon"):
            rollouts.call(abs, -1)

        rollouts.close()  # at once
        with pytest.raises(EngineInterrupted):
            slow.result(DEADLINE_S)
    with pytest.raises(EngineInterrupted, match="shutting down"):
        rollouts.call(abs, -1)


def test_beyond_its_length_a_line_refuses_at_once_and_has_room_again_later() -> None:
    line, free = WaitingLine("figures", longest_s=DEADLINE_S, length=2), Event()

    def work(_: int) -> bool:
        with line.turn():
            return free.wait(DEADLINE_S)

    with ThreadPoolExecutor(3) as others:
        served = others.map(work, range(3))
        wait_until(lambda: line._places._value == 0)
        with pytest.raises(LimitReached, match="2 requests wait for figures already") as refused, line.turn():
            pass
        free.set()
        assert all(served)

    assert refused.value.retry_after_s
    assert work(0)


def test_the_process_ends_with_its_parent_even_if_that_is_killed() -> None:
    program = (
        "import os; from gaplab.services.replay.process import RolloutProcess\n"
        "rollouts = RolloutProcess(); print(rollouts.call(os.getpid), flush=True); input()"
    )
    command = [sys.executable, "-c", program]
    parent = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    child = int(parent.stdout.readline())
    assert not gone(child)

    parent.kill()
    parent.communicate()

    wait_until(lambda: gone(child))


def test_the_cache_drops_the_least_recently_used_answers_first() -> None:
    cache = AnswerCache(most_bytes=10)
    cache.keep(("a",), "A", 4)
    cache.keep(("b",), "B", 4)
    cache.get(("a",))
    cache.keep(("c",), "C", 4)

    assert [cache.get((each,)) for each in "abc"] == ["A", None, "C"]

    cache.keep(("a",), "AA", 6)
    assert [cache.get((each,)) for each in "ac"] == ["AA", "C"]


def test_an_answer_that_is_too_large_for_the_cache_is_not_kept() -> None:
    cache = AnswerCache(most_bytes=10)
    cache.keep(("a",), "A", 4)

    cache.keep(("b",), "B", 11)

    assert [cache.get((each,)) for each in "ab"] == ["A", None]
