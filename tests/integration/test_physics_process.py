"""Physics in a process of its own: whatever happens to it, the asker is answered, and so is the next one."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gaplab.services.core.errors import EngineInterrupted, EngineUnavailable, LimitReached
from gaplab.services.replay.process import NICENESS, Memory, Physics

DEADLINE_S = 120.0


@pytest.fixture
def physics():
    found = Physics()
    yield found
    found.close()


def gone(pid):
    """Whether a process has ended, waited for or not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_until(holds):
    until = time.monotonic() + DEADLINE_S
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.05)


def test_questions_are_answered_by_one_other_process_that_yields_to_this_one(physics):
    assert physics.pid is None

    first, second = physics.ask(os.getpid), physics.ask(os.getpid)

    assert first == second == physics.pid != os.getpid()
    assert os.getpriority(os.PRIO_PROCESS, first) == min(19, os.nice(0) + NICENESS)


def test_a_process_that_was_killed_is_replaced(physics):
    killed = physics.ask(os.getpid)
    os.kill(killed, signal.SIGKILL)
    wait_until(lambda: gone(killed))

    assert physics.ask(os.getpid) not in {killed, os.getpid()}


def test_a_process_that_could_not_be_started_is_started_by_the_next_question(physics, monkeypatch):
    def out_of_memory(_):
        raise OSError(12, "Cannot allocate memory")

    with monkeypatch.context() as patch:
        patch.setattr("multiprocessing.context.SpawnProcess.start", out_of_memory)
        with pytest.raises(EngineInterrupted):
            physics.ask(os.getpid)

    assert physics.ask(os.getpid) not in {None, os.getpid()}


def test_physics_that_kills_its_process_is_an_error_and_no_more(physics):
    first = physics.ask(os.getpid)

    with pytest.raises(EngineInterrupted, match="ended the process"):
        physics.ask(os._exit, 11)

    assert physics.ask(os.getpid) not in {first, os.getpid()}


def test_physics_that_takes_too_long_is_ended():
    physics = Physics(longest_s=60)
    first = physics.ask(os.getpid)
    physics._longest_s = 0.2

    with pytest.raises(EngineInterrupted, match=r"more than 0\.2 s"):
        physics.ask(time.sleep, DEADLINE_S)

    assert gone(first)
    physics._longest_s = 60
    assert physics.ask(abs, -1) == 1
    physics.close()


def test_what_a_question_raises_is_told_and_the_process_goes_on(physics):
    first = physics.ask(os.getpid)

    with pytest.raises(RuntimeError, match="ValueError: invalid literal"):
        physics.ask(int, "x")
    with pytest.raises(EngineUnavailable, match="pip install"):
        physics.ask(_unavailable)

    assert physics.ask(os.getpid) == first


def _unavailable():
    raise EngineUnavailable("pip install it")


def test_who_waits_too_long_for_others_is_told_to_try_again():
    physics = Physics(queue_s=0.1)
    physics.ask(abs, -1)
    with ThreadPoolExecutor(1) as other:
        slow = other.submit(physics.ask, time.sleep, DEADLINE_S)
        wait_until(physics._lock.locked)

        with pytest.raises(LimitReached, match="try again soon"):
            physics.ask(abs, -1)

        physics.close()  # which waits for nobody
        with pytest.raises(EngineInterrupted):
            slow.result(DEADLINE_S)
    with pytest.raises(EngineInterrupted, match="service ends"):
        physics.ask(abs, -1)


def test_the_process_ends_with_the_one_that_started_it_however_that_ends():
    program = (
        "import os; from gaplab.services.replay.process import Physics\n"
        "physics = Physics(); print(physics.ask(os.getpid), flush=True); input()"
    )
    command = [sys.executable, "-c", program]
    parent = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    child = int(parent.stdout.readline())
    assert not gone(child)

    parent.kill()
    parent.communicate()

    wait_until(lambda: gone(child))


def test_memory_forgets_what_was_unused_for_longest():
    memory = Memory(most_bytes=10)
    memory.keep(("a",), "A", 4)
    memory.keep(("b",), "B", 4)
    memory.get(("a",))
    memory.keep(("c",), "C", 4)

    assert [memory.get((each,)) for each in "abc"] == ["A", None, "C"]

    memory.keep(("a",), "AA", 6)
    assert [memory.get((each,)) for each in "ac"] == ["AA", "C"]
    memory.keep(("d",), "D", 11)
    assert [memory.get((each,)) for each in "acd"] == [None, None, None]
