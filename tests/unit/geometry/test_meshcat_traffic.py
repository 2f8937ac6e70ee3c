"""Many pages, slow pages, long sessions: what a Meshcat's server does under traffic, seen by bare websocket clients."""

import gc
import mmap
import threading
import time

import numpy as np
import pytest
from test_meshcat import join, receive_until, wait_until

from sheldrake.geometry import Box

HOUR = 3600 * 64  # publishes of an hour at the page's rate


def done(message):
    return message["type"] == "ReplayDoneMessage"


def height_is(z):
    return lambda m: m["type"] == "SetPositionMessage" and m["name"] == "/drake/box" and m["position"][2] == z


def put(meshcat, z):
    X = np.eye(4)
    X[2, 3] = z
    meshcat.SetTransform("box", X)


def test_twenty_pages_see_the_same(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    pages = [join(meshcat) for _ in range(20)]
    try:
        for page in pages:
            seen = receive_until(page, done)
            assert sum(m["type"] == "BoxMessage" for m in seen) == 1
        assert meshcat.GetNumActiveConnections() == 20
        for z in range(100):
            put(meshcat, float(z))
        for page in pages:
            receive_until(page, height_is(99.0))
        for page in pages[:10]:
            page.close()
        wait_until(lambda: meshcat.GetNumActiveConnections() == 10)
        put(meshcat, 100.0)
        for page in pages[10:]:
            receive_until(page, height_is(100.0))
    finally:
        for page in pages:
            page.close()
    wait_until(lambda: meshcat.GetNumActiveConnections() == 0)


class Stalled:
    """A page that joined and then never reads again, as a laptop with a closed lid."""

    def __init__(self, meshcat):
        self.socket = join(meshcat, max_queue=1)
        receive_until(self.socket, done)

    def close(self):
        self.socket.socket.close()


def test_a_page_that_never_reads_holds_up_nobody(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    stalled = Stalled(meshcat)
    points = np.random.default_rng(1).random((3, 20_000))
    buffer = meshcat._hub.server._websock_server._broadcast_buffer
    with join(meshcat, max_size=None) as page:
        receive_until(page, done)
        for k in range(60):  # 14 MB, far more than the sockets hold
            meshcat.SetLine("big", points + k, 1.0)
            put(meshcat, float(k))
            meshcat._hub.page.sync()
            receive_until(page, height_is(float(k)))
        assert len(buffer.message_from_id) < 200, "what is outdated is not kept for who does not read"
    stalled.close()


def test_a_page_that_never_reads_is_let_go_before_much_is_kept_for_it(meshcat):
    """What comes and goes under ever new names, while one page reads along and one reads nothing."""
    meshcat.SetObject("box", Box(1, 1, 1))
    kept = meshcat._hub.server._websock_server._broadcast_buffer.message_from_id
    stalled, sizes = Stalled(meshcat), []
    with join(meshcat, max_size=None) as page:
        receive_until(page, done)
        wait_until(lambda: meshcat.GetNumActiveConnections() == 2)
        letters = np.random.default_rng(1)
        for k in range(6000):
            name = letters.bytes(1000).hex()  # soon more than the sockets hold
            meshcat.SetObject(name, Box(1, 1, 1))
            meshcat._hub.page.sync()
            meshcat.Delete(name)
            meshcat._hub.page.sync()
            sizes.append(len(kept))
            if k % 20 == 0:
                put(meshcat, float(k))
                receive_until(page, height_is(float(k)))
        assert meshcat.GetNumActiveConnections() == 1, "the page that reads stays"
    assert 1000 < max(sizes) < 9000, "of 12,000 messages"
    with join(meshcat) as again:
        assert any(m["type"] == "BoxMessage" and m["name"] == "/drake/box/<object>" for m in receive_until(again, done))
    stalled.close()


def resident():
    """Returns the memory of this process [bytes]."""
    gc.collect()
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * mmap.PAGESIZE
    except FileNotFoundError:
        pytest.skip("this system does not tell a process's memory by file")


def test_an_hour_of_traffic_leaves_memory_as_it_was(meshcat):
    """An hour of a body at 64 Hz with a page that reads along, as fast as it goes."""
    meshcat.SetObject("box", Box(1, 1, 1))
    over, memory = threading.Event(), []
    with join(meshcat, max_size=None) as page:
        receive_until(page, done)

        def read():
            while not over.is_set():
                try:
                    page.recv(timeout=0.2)
                except TimeoutError:
                    continue

        reader = threading.Thread(target=read)
        reader.start()
        poses = np.tile(np.eye(4)[:3], (1, 1, 1))
        for k in range(HOUR):
            poses = poses.copy()
            poses[0, 2, 3] = k
            meshcat._set_poses(["/drake/box"], poses)
            meshcat._hub.page.sync()
            if k % (HOUR // 10) == 0:
                time.sleep(0.05)  # the page reads up
                memory.append(resident())
        over.set()
        reader.join()
    assert max(memory[5:]) - memory[2] < 4 * 2**20, memory
    assert len(meshcat._hub.server._websock_server._broadcast_buffer.message_from_id) < 200


def test_what_comes_and_goes_under_ever_new_names_is_not_kept(meshcat):
    kept = meshcat._hub.server._websock_server._broadcast_buffer.message_from_id
    sizes = []
    for k in range(2000):
        meshcat.SetObject(f"passing/{k}", Box(1, 1, 1))
        put(meshcat, float(k))
        meshcat.AddButton(f"button {k}", "KeyB")
        meshcat.AddSlider(f"slider {k}", 0.0, 1.0, 0.1, 0.5, "", f"Key{k % 7}")
        meshcat._hub.page.sync()
        meshcat.Delete(f"passing/{k}")
        meshcat.DeleteButton(f"button {k}")
        meshcat.DeleteSlider(f"slider {k}")
        meshcat._hub.page.sync()
        sizes.append(len(kept))
    assert max(sizes) < 1000 and max(sizes[1000:]) <= max(sizes[:1000]), max(sizes)
    with join(meshcat) as late:
        seen = receive_until(late, done)
        assert not [m for m in seen if "passing/" in str(m.get("name")) and m["type"] != "RemoveSceneNodeMessage"]
        assert any(height_is(1999.0)(m) for m in seen)


def test_joining_and_leaving_leaves_no_thread_and_no_memory(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    server, threads, memory = meshcat._hub.server._websock_server, threading.active_count(), []
    for k in range(60):
        with join(meshcat) as page:
            receive_until(page, done)
        wait_until(lambda: meshcat.GetNumActiveConnections() == 0)
        if k % 10 == 9:
            memory.append(resident())
    wait_until(lambda: threading.active_count() <= threads)  # that of the last client may still be ending
    assert memory[-1] - memory[1] < 4 * 2**20, memory
    assert not server._client_state_from_id
