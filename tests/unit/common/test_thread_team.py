"""Teams of threads: the end of a process, and of a fork of it."""

import gc
import os
import subprocess
import sys
import threading

import pytest

from sheldrake.common._thread_team import ThreadTeam, in_parallel

LONG = """
import threading, time
from sheldrake.common._thread_team import ThreadTeam

team, begun = ThreadTeam(3), threading.Semaphore(0)

def for_ever(thread, part):
    begun.release()
    while True:
        team.check()
        time.sleep(0.001)

threading.Thread(target=lambda: team.run(for_ever, 3), daemon=True).start()
for _ in range(3):
    begun.acquire()
"""


def test_results_are_in_the_order_of_the_input():
    assert in_parallel(lambda x: x * x, range(50), 4) == [x * x for x in range(50)]


def test_what_a_part_raises_comes_out_and_the_team_works_on():
    team, found = ThreadTeam(3), []
    with pytest.raises(ZeroDivisionError):
        team.run(lambda thread, part: 1 // 0, 9)
    team.run(lambda thread, part: found.append(part), 9)
    assert sorted(found) == list(range(9))


def test_threads_leave_with_their_team():
    team, others = ThreadTeam(3), set()
    meet = threading.Barrier(3)

    def work(thread, part):
        meet.wait(60.0)
        others.add(threading.current_thread())

    team.run(work, 3)
    others.discard(threading.current_thread())
    assert len(others) == 2
    del team, work
    gc.collect()
    for thread in others:
        thread.join(60.0)
        assert not thread.is_alive()


def test_a_process_ends_while_a_team_is_at_work():
    subprocess.run([sys.executable, "-c", LONG], check=True, timeout=120)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_has_threads_of_its_own():
    program = (
        "import os, signal, threading\n"
        "from sheldrake.common._thread_team import ThreadTeam\n"
        "team = ThreadTeam(2)\n"
        "def meet(): b = threading.Barrier(2); team.run(lambda thread, part: b.wait(60.0), 2)\n"
        "meet()\n"
        "child = os.fork()\n"
        "if not child:\n"
        "    signal.alarm(60)\n"
        "    meet()\n"
        "    os._exit(7)\n"
        "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7\n"
        "meet()\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=180)
