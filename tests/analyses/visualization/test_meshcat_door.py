"""Meshcat's own port answers nobody; other sites' pages see nothing, and no message ends it."""

import asyncio
import os
import socket
import subprocess
import sys

import aiohttp
import msgpack
import numpy as np
import pytest
from pydrake.geometry import Rgba, Sphere
from pydrake.math import RigidTransform

from cdpr_drake.analyses.visualization.meshcat_window import (
    open_meshcat,
    page_address,
    private_door,
)
from cdpr_drake.errors import MeshcatError

WAIT = 1.0
"""Time after which what was not answered counts as not answered [s]."""

NAN_CAMERA = msgpack.packb(
    {"type": "camera_pose", "camera_pose": [float("nan")] * 16, "is_perspective": True}
)
"""At which Drake ends the process that holds the scene."""


@pytest.fixture(scope="module")
def scene():
    """A scene with a ball, and where browsers look."""
    meshcat = open_meshcat("localhost")
    meshcat.SetObject("ball", Sphere(0.5), Rgba(1.0, 0.0, 0.0))
    return meshcat, page_address(meshcat)


async def listened(address, origin=None, said=(), **session):
    """What a browser of an origin hears, in bytes, after it has said something."""
    async with (
        aiohttp.ClientSession(**session) as one,
        one.ws_connect(address, origin=origin) as web,
    ):
        for words in said:
            await web.send_bytes(words)
        heard = 0
        try:
            while True:
                message = await asyncio.wait_for(web.receive(), WAIT)
                if message.type != aiohttp.WSMsgType.BINARY:
                    return heard
                heard += len(message.data)
        except TimeoutError:
            return heard


def hear(*arguments, **more):
    return asyncio.run(listened(*arguments, **more))


def status(address, **headers):
    async def asked():
        async with aiohttp.ClientSession() as one, one.get(address, headers=headers) as answer:
            return answer.status, len(await answer.read())

    return asyncio.run(asked())


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux filters who reaches a socket")
def test_the_port_of_meshcat_itself_answers_nobody(scene):
    for _ in range(2):  # also after a browser was let in
        with socket.socket() as web:
            web.settimeout(WAIT)
            with pytest.raises(TimeoutError):
                web.connect(("127.0.0.1", scene[0].port()))
        assert hear(scene[1]) > 100


def test_browsers_get_page_and_scene_again_and_again(scene):
    address = scene[1]
    for _ in range(3):
        assert status(f"{address}/meshcat.html")[1] > 10_000
        assert status(address) == status(f"{address}/meshcat.html")
        assert hear(address) > 100


def test_a_page_of_another_site_sees_nothing(scene):
    address = scene[1]
    for origin in ("http://evil.example", "null", address.replace("http", "https")):
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            hear(address, origin)
    assert hear(address, address) > 100
    assert status(address, Host="evil.example")[0] == 403  # a name that leads here


def test_no_message_ends_the_process(scene):
    button = msgpack.packb({"type": "button", "name": 5})
    bad = (NAN_CAMERA, b"", b"\xff" * 100, button, b"x" * 99_999)
    assert hear(scene[1], said=bad * 5) > 100
    scene[0].SetTransform("ball", RigidTransform(np.ones(3)))
    assert hear(scene[1]) > 100


def test_the_private_door_is_a_socket_of_this_user(scene):
    path = private_door(scene[0])
    assert path.parent.stat().st_mode & 0o077 == 0

    async def behind():
        return await listened(
            "http://scene/", said=(NAN_CAMERA,), connector=aiohttp.UnixConnector(str(path))
        )

    assert asyncio.run(behind()) > 100


def test_a_scene_that_nobody_looks_at_has_no_page():
    meshcat = open_meshcat()
    with pytest.raises(MeshcatError, match="without a page"):
        page_address(meshcat)


@pytest.mark.skipif(sys.platform != "linux", reason="files of a process are listed by Linux alone")
def test_files_of_the_process_are_not_copied(tmp_path):
    files = [(tmp_path / f"{number}").open("w") for number in range(50)]
    before = len(os.listdir("/proc/self/fd"))
    meshcat = open_meshcat("localhost")
    assert len(os.listdir("/proc/self/fd")) - before < 25  # Meshcat's own loops and sockets
    del meshcat
    for file in files:
        file.close()


COLLECTED_ELSEWHERE = """
import gc, os, threading
from pydrake.geometry import MeshcatVisualizer, SceneGraph
from pydrake.systems.framework import DiagramBuilder
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat, private_door

def leave():
    meshcat = open_meshcat("localhost")
    private_door(meshcat)
    cycle = [meshcat, MeshcatVisualizer(meshcat)]
    cycle.append(cycle)

def leave_shown():
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, open_meshcat())
    cycle = [builder.Build()]
    cycle.append(cycle)

def collect():
    thread = threading.Thread(target=gc.collect)
    thread.start()
    thread.join()

leave()
collect()
leave_shown()
again = open_meshcat("localhost")
collect()
others = []
thread = threading.Thread(target=lambda: others.append(open_meshcat()))
thread.start()
thread.join()
others.clear()
del again
child = os.fork()
for _ in range(8):  # these take the place of threads that the child has no more
    threading.Thread(target=threading.Event().wait, daemon=True).start()
meshcat = open_meshcat()
if child:
    print("alive", os.waitpid(child, 0)[1])
"""
"""Scenes that another thread collects, that outlive their own thread, until the end, and that a
forked process has without their threads."""


def test_a_scene_may_be_collected_in_any_thread():
    ran = subprocess.run(
        [sys.executable, "-c", COLLECTED_ELSEWHERE], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout) == (0, "alive 0\n"), ran.stderr


def test_a_scene_that_has_gone_leaves_no_file_open():
    meshcat = open_meshcat("localhost")
    path = private_door(meshcat)
    before, address = len(os.listdir("/proc/self/fd")), page_address(meshcat)
    for _ in range(5):
        del meshcat
        meshcat = open_meshcat("localhost")
    assert len(os.listdir("/proc/self/fd")) <= before
    assert not path.parent.exists()
    assert page_address(meshcat).rpartition(":")[0] == address.rpartition(":")[0]
